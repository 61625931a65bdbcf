"""The tool that puts the results of studies into pages."""

import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from results_pages import BEGIN, END, put_into

TOOL = Path(__file__).parents[2] / "tools" / "results_pages.py"


@pytest.fixture
def studies(tmp_path):
    """A folder of two studies, as `energymargin reproduce all` makes it."""
    for name, text in (("table2", "| rectangle-jaw | .9 |"), ("closed-forms", "| push | 1.0 |")):
        own = tmp_path / "all" / name
        own.mkdir(parents=True)
        (own / f"{name.replace('-', '_')}.md").write_text(f"# Title\n\n{text}\n")
        (own / f"{name.replace('-', '_')}.png").write_bytes(b"a picture")
    return tmp_path / "all"


@pytest.fixture
def pages(tmp_path):
    folder = tmp_path / "pages"
    folder.mkdir()
    return folder


def test_a_page_gets_its_results_and_the_pictures(studies, pages):
    page, other = pages / "table2.md", pages / "walls.md"
    page.write_text(f"# before\n{BEGIN}\nto be replaced\n{END}\nafter\n")
    other.write_text(f"{BEGIN}\nas it was\n{END}\n")
    assert put_into(pages, studies) == [page]
    text = page.read_text()
    assert text.startswith(f"# before\n{BEGIN}") and text.endswith(f"{END}\nafter\n")
    assert "to be replaced" not in text and "| rectangle-jaw | " in text and "Title" not in text
    assert f"Version {version('energymargin')}" in text
    assert "`energymargin reproduce table2`" in text
    assert "![table2](table2.png)" in text and (pages / "table2.png").read_bytes() == b"a picture"
    assert "as it was" in other.read_text()


def test_the_command_line_names_the_pages_that_it_wrote(studies, pages):
    (pages / "closed_forms.md").write_text(f"{BEGIN}\n{END}\n")
    command = [sys.executable, str(TOOL), str(studies), str(pages)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "closed_forms.md" in done.stdout
    assert "| push | 1.0 |" in (pages / "closed_forms.md").read_text()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nothing", "has no page with the lines"),
        (BEGIN, "expected both"),
        (f"{BEGIN}{END}", "has no study of the pages in"),
    ],
)
def test_pages_that_cannot_be_made_are_refused_and_stay_as_they_were(text, message, studies, pages):
    page = pages / "table1.md"
    page.write_text(text)
    command = [sys.executable, str(TOOL), str(studies), str(pages)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and message in done.stderr
    assert page.read_text() == text
