"""Pages of results: blocks that commands write, and which of them are of older bits."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from energymargin.evaluate.searches import ALGORITHM
from energymargin_paper import STUDIES
from energymargin_paper.bits import bits, engine_bits
from energymargin_paper.commands import typed
from energymargin_paper.pages import (
    FILE,
    Head,
    all_blocks,
    blocks,
    put,
    table_of_blocks,
    write_block,
)
from energymargin_paper.pieces import PIECES

DOCS = Path(__file__).parents[3] / "docs"
RESULTS = DOCS / "results"
IMPROVED = {piece.name: piece.load().improved for piece in PIECES}

# Blocks that were made by an engine of other bits. Who makes one anew takes it off; nobody adds one
# but with a change of the bits that is meant (CONTRIBUTING.md).
OLD: set[str] = {
    "bench-monitor",
    "bench-scale",
}

PAGE = """# A page

## A part

<!-- made: rare
command: old
version: 0.1.0
-->
old text

<!-- end: rare -->

What a person says.
"""


@pytest.fixture
def study(tmp_path):
    """A study's folder, whole."""
    folder = tmp_path / "out" / "rare"
    folder.mkdir(parents=True)
    (folder / "rare.md").write_text("# Rare\n\nIn short.\n\n## Runs\n\n| a |\n| --- |\n| 1 |\n")
    (folder / "rare.png").write_bytes(b"a picture")
    head = Head.of_today("energymargin reproduce rare", improved=False, seed=3)
    head = replace(head, date="2026-11-26", minutes="1.5")
    (folder / FILE).write_text(head.lines() + "\n")
    return folder


def test_a_block_is_written_anew_below_the_heading_that_it_stands_under(study, tmp_path):
    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    page.write_text(PAGE)
    assert put(page.parent, "rare", study) == [page]
    text = page.read_text()
    assert "old text" not in text and "# Rare" not in text
    assert "\n### Runs\n" in text and text.endswith("What a person says.\n")
    assert (
        "`energymargin reproduce rare`, version " in text and "26 November 2026; seed 3; " in text
    )
    assert "![rare](rare.png)" in text and (page.parent / "rare.png").read_bytes() == b"a picture"
    (block,) = blocks(page)
    assert block.head == Head.of_folder(study)
    assert block.head.algorithm == ALGORITHM and not block.head.is_old(improved=False)
    assert put(page.parent, "rare", study) == [page] and page.read_text() == text
    assert put(page.parent, "act", study) == []


def test_a_head_tells_of_folders_that_its_study_takes_and_that_are_set(monkeypatch):
    monkeypatch.setenv("ENERGYMARGIN_GRASPS", "somewhere")
    monkeypatch.delenv("ENERGYMARGIN_MODELS", raising=False)
    folders = ("ENERGYMARGIN_GRASPS", "ENERGYMARGIN_MODELS")
    head = partial(Head.of_today, "energymargin reproduce rare", improved=False)
    assert head(folders=folders).data == "ENERGYMARGIN_GRASPS" and head().data == ""
    assert "contact" in [piece.name for piece in PIECES if piece.load().folders == folders[:1]]


def test_two_pieces_of_one_study_have_pictures_of_their_own(study, tmp_path):
    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    page.write_text(PAGE.replace("made: rare", "made: two").replace("end: rare", "end: two"))
    put(page.parent, "two", study)
    assert "![two rare](two_rare.png)" in page.read_text()
    assert (page.parent / "two_rare.png").exists()


def test_a_study_that_is_not_whole_changes_no_page(study, tmp_path):
    head = Head.of_folder(study)
    (study / FILE).write_text(replace(head, date="").lines())
    with pytest.raises(ValueError, match="has no finished study"):
        put(tmp_path, "rare", study)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<!-- made: rare\ncommand: a\nversion: 1\n-->\n", "a block without its end"),
        ("<!-- end: rare -->\n", "an end without its block"),
        (PAGE.replace("version", "edition"), "is no head of a block"),
    ],
)
def test_a_page_with_half_a_block_is_refused(text, message, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(text)
    with pytest.raises(ValueError, match=message):
        blocks(page)


def test_a_head_of_other_bits_is_old(study):
    head = Head.of_folder(study)
    assert replace(head, bits="00000000").is_old(improved=False)
    assert head.is_old(improved=True)  # of another search
    assert Head("a", "0.1.0").is_old(improved=False)
    for engine in ("bullet", "mujoco"):
        today = replace(head, engines=f"{engine} {engine_bits(engine)}")
        assert not today.is_old(improved=False)
        assert replace(head, engines=f"{engine} 00000000").is_old(improved=False)


def test_the_bits_are_eight_digits_and_know_the_improved_search():
    assert len(bits()) == 8 and int(bits(), 16) >= 0
    assert len({bits(), bits(improved=True), engine_bits("bullet"), engine_bits("mujoco")}) == 4


def test_a_block_after_a_heading_of_the_first_level_keeps_its_own(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE.replace("## A part\n", ""))
    assert write_block(page, "rare", Head("a", "1", date="2026-11-26"), "## Runs")
    assert "\n## Runs\n" in page.read_text()


# Of the pages in docs.


def test_the_blocks_of_older_bits_are_those_that_are_known():
    """A page whose engine had other bits than today's says figures that no command gives."""
    made = {block.name: block.head for _, block in all_blocks(DOCS)}
    improved = {name: IMPROVED.get(name, False) for name in made}
    old = {name for name in improved if made[name].is_old(improved=improved[name])}
    assert old - OLD == set(), "make them anew: energymargin reproduce all --pages docs --only ..."
    assert OLD - old == set(), "they are of today's bits: take them off OLD"


def test_the_list_of_blocks_says_which_are_of_an_earlier_build():
    rows = [line.split(" | ") for line in table_of_blocks(DOCS, RESULTS).splitlines()[2:]]
    earlier = {row[0][3:].partition("]")[0] for row in rows if row[2] == "earlier"}
    assert earlier == OLD


def test_each_piece_has_its_block_and_each_block_its_command():
    made = [block for _, block in all_blocks(DOCS)]
    pieces = {piece.name: piece for piece in PIECES}
    assert sorted(block.name for block in made if block.name in pieces) == sorted(pieces)
    for block in made:
        if block.name in pieces:
            piece = pieces[block.name]
            assert block.head.command == typed(piece.load(), piece.settings())
        assert block.head.version and block.head.date


def test_each_study_is_a_piece():
    assert {piece.study or piece.name for piece in PIECES} == set(STUDIES)


def test_there_are_at_most_twelve_pages_and_twenty_blocks_and_each_page_of_results_has_one():
    pages = sorted(RESULTS.glob("*.md"))
    made = list(all_blocks(DOCS))
    assert len({page for page, _ in made}) <= 12 and len(made) <= 20
    assert [page.stem for page in pages if not blocks(page)] == ["index"]


def test_the_index_has_a_line_for_each_block():
    assert table_of_blocks(DOCS, RESULTS) in (RESULTS / "index.md").read_text()
