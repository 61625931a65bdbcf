"""Atomic writes: a file appears whole or not at all."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A new file to write, which is at `path` once the `with` block has ended well; until then what
    is at `path` stays.

    The new file is `.NAME.HOST.PID` meanwhile. What a killed process of this machine left, the next
    call for this path removes. Raises OSError at once if `path` cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{socket.gethostname()}.{os.getpid()}")
    try:
        try:
            _remove_leftovers(path)
            temporary.touch()
        except OSError as error:
            raise type(error)(error.errno, error.strerror, str(path)) from error
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def replace_text(path: Path, text: str) -> None:
    """The text, in UTF-8, is the file's; raises OSError if `path` cannot be written."""
    with replaced(path) as file:
        file.write_text(text, encoding="utf-8")


def _remove_leftovers(path: Path) -> None:
    """Removes the files of processes of this machine that are gone."""
    prefix = f".{path.name}.{socket.gethostname()}."
    for name in os.listdir(path.parent):
        process = name.removeprefix(prefix)
        if name.startswith(prefix) and process.isdecimal() and not _is_running(int(process)):
            path.with_name(name).unlink(missing_ok=True)


def _is_running(process: int) -> bool:
    """Whether there is a process of this number, also of another user."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True
