"""One writer of a file at a time."""

from __future__ import annotations

import fcntl
import os
from contextlib import suppress
from pathlib import Path

from energymargin.base.closing import Closing


class Lock(Closing):
    """The right to write what is at a path, until it is closed, or its process is gone.

    The file `.NAME.lock` beside it is locked meanwhile, and has the number of the process.
    """

    def __init__(self, path: Path, doing: str) -> None:
        """`doing`: what it does to the file, as "scoring into". Raises ValueError with the number
        of the process that has the lock."""
        path = Path(os.path.realpath(path))
        self._path = path.with_name(f".{path.name}.lock")
        try:
            self._take(f"is {doing} {path}: let it finish, or stop it")
        except OSError as error:  # as of a full disk
            raise type(error)(error.errno, error.strerror, str(path)) from error

    def _take(self, held: str) -> None:
        while True:
            self._file = self._path.open("ab+", buffering=0)
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                with self._file:
                    self._file.seek(0)
                    raise ValueError(f"process {self._file.read().decode()} {held}") from None
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self._file.fileno()), os.stat(self._path)):
                    break
            self._file.close()  # its last owner has just removed it
        try:
            self._file.truncate(0)
            self._file.write(str(os.getpid()).encode())
        except OSError:
            self.close()
            raise

    def close(self) -> None:
        """Gives it up, once: its file may be another's then."""
        if not self._file.closed:
            with self._file:
                self._path.unlink(missing_ok=True)
