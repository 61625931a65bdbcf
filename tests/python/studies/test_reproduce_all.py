"""`energymargin reproduce all`: pieces that go on where they were stopped, and their table."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_line import invoke

from energymargin_paper import reproduce
from energymargin_paper.pages import FILE, Head
from energymargin_paper.pieces import PIECES, QUICK, Piece

COMMAND = [sys.executable, "-c", "from energymargin.cli import main; main()", "reproduce", "all"]
PAGE = "# Results\n\n<!-- made: small\ncommand: a\nversion: 0.1.0\n-->\n\n<!-- end: small -->\n"
SMALL = Piece("small", 0.1, "contact", {"percent": 1, "grasps": 0})


def run(*words):
    return invoke(["reproduce", "all", *map(str, words)])


def lines(folder):
    """Jobs that are done of a study of many jobs."""
    path = folder / "contact" / "runs.jsonl"
    return path.read_text().splitlines() if path.exists() else []


def test_a_piece_is_made_written_into_its_page_and_left_out_the_next_time(tmp_path, monkeypatch):
    monkeypatch.setattr(reproduce, "PIECES", (SMALL,))
    pages = tmp_path / "docs"
    pages.mkdir()
    (pages / "results.md").write_text(PAGE)
    words = ("--only", "small", "-o", tmp_path / "all", "--pages", pages)
    first = run(*words)
    assert first.exit_code == 0, first.output
    head = Head.of_folder(tmp_path / "all" / "small")
    assert head.date and head.command == "energymargin reproduce contact --percent 1 --grasps 0"
    text = (pages / "results.md").read_text()
    assert head.sentence() in text and "| median |" in text
    assert (tmp_path / "all" / "index.html").exists()
    made = (tmp_path / "all" / "small" / "contact.csv").stat().st_mtime_ns
    again = run(*words)
    assert again.exit_code == 0 and "It is there." in again.output
    assert (tmp_path / "all" / "small" / "contact.csv").stat().st_mtime_ns == made
    row = next(line for line in again.output.splitlines() if line.startswith("| small |"))
    assert f"| {head.version} | 0 days | whole |" in row


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_stopped_or_killed_the_same_command_goes_on(how, tmp_path):
    folder = tmp_path / "all"
    command = [*COMMAND, "--quick", "--only", "contact", "--threads", "1", "-o", str(folder)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while len(lines(folder)) < 2 and process.poll() is None:
        time.sleep(0.01)
    os.kill(process.pid, how)
    process.wait(60)
    kept = lines(folder)
    assert len(kept) >= 2
    assert not Head.of_folder(folder / "contact").date
    subprocess.run(command, check=True, capture_output=True)
    assert lines(folder)[: len(kept) - 1] == kept[: len(kept) - 1]
    assert Head.of_folder(folder / "contact").date


def test_first_pictures_go_into_no_page(tmp_path):
    done = run("--quick", "--pages", tmp_path)
    assert done.exit_code == 2 and "leave one of them out" in done.output


def test_the_minutes_end_it_without_an_error(tmp_path):
    command = [*COMMAND, "--quick", "--minutes", "0.0001", "-o", str(tmp_path / "all")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "The time is over" in done.stderr
    assert "not yet" in done.stdout


def test_a_folder_of_other_bits_is_refused_and_stays(tmp_path, monkeypatch):
    monkeypatch.setattr(reproduce, "PIECES", (SMALL,))
    own = tmp_path / "all" / "small"
    assert run("-o", tmp_path / "all").exit_code == 0
    text = (own / FILE).read_text()
    bits = Head.of_folder(own).bits
    (own / FILE).write_text(text.replace(bits, "01234567"))
    done = run("-o", tmp_path / "all")
    assert done.exit_code == 2
    words = " ".join(done.output.split())
    assert "(bits 01234567, mujoco " in words and "), whose scores are others" in words
    assert Head.of_folder(own).bits == "01234567"


def test_the_list_has_each_piece_with_its_minutes_and_makes_none(tmp_path):
    done = run("--list", "-o", tmp_path / "all")
    *rows, left = [line.strip("| ").split(" | ") for line in done.output.splitlines()[2:]]
    assert [row[0] for row in rows] == [piece.name for piece in PIECES]
    assert left[0] == "**left**" and float(left[1]) == pytest.approx(sum(p.minutes for p in PIECES))
    assert not (tmp_path / "all").exists()
    docs = Path(__file__).parents[3] / "docs"
    assert "not yet" not in run("--list", "--pages", docs).output


def test_quick_has_each_study_whose_data_are_here():
    assert {piece.name for piece in QUICK} == {p.study or p.name for p in PIECES if not p.data}
