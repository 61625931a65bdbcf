"""One writer of a file at a time."""

from __future__ import annotations

import os
from pathlib import Path

from energymargin.base.closing import Closing

WAIT = 0.05  # s; an owner that is just leaving may take so long to remove its lock


class Lock(Closing):
    """The right to write what is at a path, until it is closed, or its process is gone.

    The file `.NAME.lock` beside it is locked meanwhile, and has the number of the process.
    """

    def __init__(self, path: Path, doing: str) -> None:
        """`doing`: what it does to the file, as "scoring into". Raises ValueError with the number
        of the process that has the lock."""
        from filelock import FileLock, Timeout  # takes long

        path = Path(os.path.realpath(path))
        self._path = path.with_name(f".{path.name}.lock")
        self._lock = FileLock(self._path, thread_local=False)
        try:
            path.parent.stat()  # filelock would make the folder
            self._lock.acquire(WAIT, poll_interval=WAIT / 10)
            self._path.write_text(str(os.getpid()))
        except Timeout:
            text = f"process {self._path.read_text()} is {doing} {path}: let it finish, or stop it"
            raise ValueError(text) from None
        except OSError as error:  # as of a full disk
            self.close()
            raise type(error)(error.errno, error.strerror, str(path)) from error

    def close(self) -> None:
        """Gives it up, once: its file may be another's then."""
        if self._lock.is_locked:
            self._path.unlink(missing_ok=True)
            self._lock.release()
