"""Atomic writes: a file appears whole or not at all."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

DESCRIPTORS = Path("/proc/self/fd")  # of Linux: names for files that have none


@contextmanager
def replaced(path: Path, *, named: bool = False) -> Iterator[Path]:
    """A new file to write, which is at `path` once the `with` block has ended well; until then what
    is at `path` stays.

    The new file has no name in the folder, so it goes with a process that is killed. `named`: it
    has one, `.NAME.HOST.PID`, for a library that needs it; so it has where there are no files
    without (NFS). Then the next call for this path removes what a killed process of this machine
    left. Raises OSError at once if `path` cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{socket.gethostname()}.{os.getpid()}")
    try:
        descriptor = None if named else _nameless(path.parent)
        if descriptor is None:
            _remove_leftovers(path)
            temporary.touch()
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from error
    try:
        if descriptor is None:
            yield temporary
        else:
            yield DESCRIPTORS / str(descriptor)
            _give_name(descriptor, temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
        if descriptor is not None:
            os.close(descriptor)


def replace_text(path: Path, text: str) -> None:
    """The text, in UTF-8, is the file's; raises OSError if `path` cannot be written."""
    with replaced(path) as file:
        file.write_text(text, encoding="utf-8")


def _nameless(folder: Path) -> int | None:
    """The descriptor of a new file in no folder; None where there are no such files."""
    if not (hasattr(os, "O_TMPFILE") and DESCRIPTORS.is_dir()):
        return None
    try:
        return os.open(folder, os.O_TMPFILE | os.O_RDWR, 0o666)
    except OSError:
        return None  # a file with a name is tried next, and says what is wrong with the folder


def _give_name(descriptor: int, path: Path) -> None:
    path.unlink(missing_ok=True)
    # Names for descriptors are links, which are followed only relative to a folder (linkat).
    descriptors = os.open(DESCRIPTORS, os.O_RDONLY)
    try:
        os.link(str(descriptor), path, src_dir_fd=descriptors, follow_symlinks=True)
    finally:
        os.close(descriptors)


def _remove_leftovers(path: Path) -> None:
    """Of processes of this machine that are gone."""
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
