"""What commands print never commands the terminal."""

import io
import re

import pytest
from rich.console import Console
from rich.table import Table

from energymargin.cli import terminal
from energymargin.cli.terminal import progress_bar

EVIL = "\x1b]0;title\x07a\x1b[2J\x9b31m\u202eb\x7f"


@pytest.fixture
def shown(monkeypatch):
    """What is written to a terminal."""
    written = io.StringIO()
    for console in (terminal.out, terminal.err):
        monkeypatch.setattr(console, "_file", written)
    return written


def names(text):
    return re.sub(r"[^\x00-\x7f\x9b\u202e]", "", text)


def test_names_of_files_in_tables_warnings_and_lines_are_plain_text(shown):
    table = Table("name")
    table.add_row(EVIL)
    terminal.out.print(table)
    terminal.out.print(EVIL, markup=False, soft_wrap=True)
    terminal.warn(EVIL)
    terminal.say(f"[yellow]warning:[/] {EVIL.replace('[', '')}")
    text = names(shown.getvalue())
    assert text.count("0;titlea") == 4
    assert not set(text) & set("\x1b\x07\x9b\u202e\x7f")


def test_new_lines_tabs_and_styles_of_our_own_stay(monkeypatch):
    written = io.StringIO()
    monkeypatch.setattr(terminal.err, "_file", written)
    terminal.err.print("a\tb\nc")
    assert written.getvalue().splitlines()[1] == "c"


def test_titles_of_bars_are_plain_text(shown):
    console = Console(file=shown)
    with progress_bar(f"Decomposing {EVIL}", "meshes", console) as update:
        update(1, 1)
    assert not set(names(shown.getvalue())) & set("\x1b\x07\x9b\u202e\x7f")
