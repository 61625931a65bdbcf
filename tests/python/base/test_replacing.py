"""A file is there whole or as it was; what a process that dies leaves, the next one removes."""

import os
import signal
import socket
import subprocess
import sys

import pytest

from energymargin.base.replacing import replace_text, replaced

KILLED = """
import os, pathlib, signal, sys
from energymargin.base.replacing import replaced
with replaced(pathlib.Path(sys.argv[1])) as file:
    file.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def path(tmp_path):
    return tmp_path / "page.html"


def names(path):
    return sorted(os.listdir(path.parent))


def test_the_new_file_is_there_at_the_end_of_the_block_alone(path):
    path.write_text("before")
    with replaced(path) as file:
        file.write_text("after")
        assert path.read_text() == "before"
    assert path.read_text() == "after"
    assert names(path) == ["page.html"]


def test_a_new_file_has_the_mode_of_any_other(path):
    with replaced(path) as file:
        file.write_text("after")
    (path.parent / "other").write_text("")
    assert path.stat().st_mode == (path.parent / "other").stat().st_mode


def test_an_error_leaves_what_was_there(path):
    path.write_text("before")
    with pytest.raises(RuntimeError), replaced(path) as file:
        file.write_text("half")
        raise RuntimeError
    assert path.read_text() == "before"
    assert names(path) == ["page.html"]


def test_a_folder_that_is_not_there_is_an_error_at_once_that_names_the_file(path):
    place = path.parent / "no" / "page.html"
    with pytest.raises(FileNotFoundError) as refused, replaced(place):
        pytest.fail("it began")
    assert refused.value.filename == str(place)


def killed(path):
    command = [sys.executable, "-c", KILLED, str(path)]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL


def test_what_a_killed_writer_leaves_is_gone_with_the_next(path):
    path.write_text("before")
    killed(path)
    assert path.read_text() == "before" and len(names(path)) == 2
    with replaced(path) as file:
        file.write_text("after")
    assert names(path) == ["page.html"]


def test_files_of_other_writers_stay(path):
    here, living = socket.gethostname(), os.getppid()
    others = (
        *(f".page.html.{here}.{living}", f".page.html.elsewhere.{2**30}"),
        *(f".page.html.{here}.x", f".other.html.{here}.{2**30}"),
    )
    for name in others:
        (path.parent / name).write_text("")
    with replaced(path) as file:
        file.write_text("after")
    assert names(path) == sorted([*others, "page.html"])


def test_a_text_replaces_a_file(path):
    path.write_text("before, and longer")
    replace_text(path, "für")
    assert path.read_text(encoding="utf-8") == "für"
    assert names(path) == ["page.html"]
