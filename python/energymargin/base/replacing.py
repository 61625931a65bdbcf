"""Atomic writes: a file appears whole or not at all."""

from __future__ import annotations

import errno
import os
import socket
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import Any

PAGES = (".html", ".htm")
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""What a write raises without the name of its file."""


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A new file to write, which is at `path` once the `with` block has ended well; until then what
    is at `path` stays.

    The new file is `.NAME.HOST.PID` meanwhile. What a killed process of this machine left, the next
    call for this path removes. Raises OSError at once if `path` cannot be written, and with its
    name where the new file cannot, as on a full disk.
    """
    temporary = path.with_name(f".{path.name}.{socket.gethostname()}.{os.getpid()}")
    try:
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        _remove_leftovers(path)
        temporary.touch()
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        ours = str(error.filename) in (str(temporary), str(path.parent))
        if not (ours or (error.filename is None and error.errno in FULL)):
            raise  # of another file
        raise type(error)(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def replace_figure(path: Path, figure: Any, **options: Any) -> None:
    """The file shows a figure of matplotlib, by its suffix; raises OSError if `path` cannot be
    written."""
    drawn = BytesIO()  # what draws may say a full disk in words of its own
    figure.savefig(drawn, format=path.suffix.removeprefix(".").lower(), **options)
    replace_bytes(path, drawn.getvalue())


def replace_text(path: Path, text: str) -> None:
    """The text, in UTF-8, is the file's; raises OSError if `path` cannot be written."""
    replace_bytes(path, text.encode())


def replace_bytes(path: Path, content: bytes) -> None:
    """The bytes are the file's; raises OSError if `path` cannot be written."""
    with replaced(path) as file:
        file.write_bytes(content)


def require_suffix(name: str, path: Path, suffixes: Collection[str]) -> None:
    """Raises ValueError with `name` unless the path ends with one of these suffixes."""
    if path.suffix not in suffixes:
        expected = " or ".join(suffixes)
        raise ValueError(f"{name} is {str(path)!r}, expected a name with {expected}")


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
