"""One writer of a file at a time."""

from __future__ import annotations

import fcntl
import os
from contextlib import suppress
from pathlib import Path

from energymargin.closing import Closing


class Lock(Closing):
    """The right to write what is at a path, until it is closed, or its process is gone.

    The file `.NAME.lock` beside it is locked meanwhile, and has the number of the process.
    """

    def __init__(self, path: Path, doing: str) -> None:
        """`doing`: what it does to the file, as "scoring into". Raises ValueError with the number
        of the process that has the lock."""
        path = Path(os.path.realpath(path))
        self._path = path.with_name(f".{path.name}.lock")
        while True:
            self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                with open(self._file) as file:
                    who = f"process {file.read()} is {doing} {path}"
                raise ValueError(f"{who}: let it finish, or stop it") from None
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self._file), os.stat(self._path)):
                    break
            os.close(self._file)  # its last owner has just removed it
        os.ftruncate(self._file, 0)
        os.write(self._file, str(os.getpid()).encode())

    def close(self) -> None:
        """Gives it up."""
        self._path.unlink(missing_ok=True)
        os.close(self._file)
