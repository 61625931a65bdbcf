"""Recorded pushes, and the page of all studies; small and real."""

from importlib.metadata import version

import numpy as np
import pytest
from typer.testing import CliRunner

import energymargin as em
from energymargin.cli import app
from energymargin.experiments import table2
from energymargin.experiments.results_pages import BEGIN, END, put_into
from energymargin.settings import SearchSettings


def run(*words):
    return CliRunner().invoke(app, ["reproduce", *map(str, words)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("table2")
    done = run(
        "all", "--quick", "--only", "table2,enlarged,figure-quality", "--out", made, "--threads", 1
    )
    assert done.exit_code == 0, done.output
    return made


def test_the_table_has_the_scores_of_the_recorded_states(folder):
    """Of some of them, one by one."""
    row = table2.reproduce(table2.QUICK, folder / "table2", threads=1).rows[1]
    assert row.combination == "rectangle-round"
    settings = SearchSettings(table2.QUICK.nodes, 0)
    for number in (5, 777):
        (problem,) = row.dataset.problems([number])
        score = em.capture_score(
            problem, nodes=settings.nodes, seed=em.stream(settings.seed, number)
        )
        assert score.capture == row.labelled.scores["capture"][number]
        assert score.success == row.labelled.scores["success"][number]


def test_success_counts_the_last_60_frames_with_rising_weights(folder):
    row = table2.reproduce(table2.QUICK, folder / "table2", threads=1).rows[0]
    of_state = row.labelled.scores["success"].reshape(12, 100)[:, 40:]
    scores = of_state @ np.arange(1, 61) / np.arange(1, 61).sum()
    success = row.labelled.success.reshape(12, 100)[:, 0]
    pairs = [(a > b) + 0.5 * (a == b) for a in scores[success] for b in scores[~success]]
    assert row.evaluation.success.auc == pytest.approx(np.mean(pairs))


def test_every_place_says_that_the_recordings_are_a_stand_in(folder):
    for path in (folder / "table2" / "table2.md", folder / "index.md", folder / "index.html"):
        assert "simulated stand-in" in path.read_text()


def test_the_page_has_the_studies_that_were_made_with_their_times_and_pictures(folder):
    text = (folder / "index.md").read_text()
    assert "![table2](table2/table2.png)" in text and "(enlarged/enlarged.csv)" in text
    assert "| [figure-quality](#figure-quality) |" in text
    assert (
        "| closed-forms | The effort of escape against answers known on paper | not yet |" in text
    )
    html = (folder / "index.html").read_text()
    assert "<td>not yet</td>" in html and '<img src="table2/table2.png"' in html


def test_a_page_gets_its_results_and_the_pictures(folder, tmp_path):
    page, other = tmp_path / "table2.md", tmp_path / "walls.md"
    page.write_text(f"# before\n{BEGIN}\nto be replaced\n{END}\nafter\n")
    other.write_text(f"{BEGIN}\nas it was\n{END}\n")
    assert put_into(tmp_path, folder) == [page]
    text = page.read_text()
    assert text.startswith(f"# before\n{BEGIN}") and text.endswith(f"{END}\nafter\n")
    assert "to be replaced" not in text and "| rectangle-jaw | " in text
    assert (
        f"Version {version('energymargin')}" in text and "`energymargin reproduce table2`" in text
    )
    assert "![table2](table2.png)" in text and (tmp_path / "table2.png").stat().st_size > 10_000
    assert "as it was" in other.read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("table2", "--combinations", "cube-jaw"), "combinations has 'cube-jaw', expected some of"),
        (("table2", "--nodes", 0), "nodes is 0"),
        (("all", "--only", "table3"), "only has 'table3', expected some of table1"),
        (("all", "--quick", "--pages", "docs/results"), "expected no --quick with them"),
        (("enlarged", "--frames", 101), "frames is 101, expected a whole number from 1 to 100"),
    ],
)
def test_wrong_options_are_named_before_anything_is_written(words, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run(*words)
    assert done.exit_code == 2 and message in " ".join(done.output.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("text", "message"), [("nothing", "has no page with the lines"), (BEGIN, "expected both")]
)
def test_pages_without_the_lines_are_refused_before_anything_is_made(text, message, tmp_path):
    page = tmp_path / "table1.md"
    page.write_text(text)
    done = run("all", "--out", tmp_path / "all", "--pages", tmp_path)
    assert done.exit_code == 2 and message in " ".join(done.output.split())
    assert page.read_text() == text
    assert not (tmp_path / "all").exists()
