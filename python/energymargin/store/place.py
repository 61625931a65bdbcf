"""Where an open file is: others may rename or remove it meanwhile."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["OpenPlace"]

DESCRIPTORS = Path("/proc/self/fd")  # of Linux: the present names of all files that are open


class OpenPlace:
    """The place of a file that this process has open."""

    def __init__(self, path: Path) -> None:
        """Of a file that may not be there yet."""
        self._path = Path(os.path.abspath(path))  # the process may change its folder
        self._identity: tuple[int, int] | None = None

    def begin(self) -> None:
        """The file is there now."""
        self._identity = _identity(self._path)

    def change(self) -> str:
        """What became of the file, and what to do; empty if it is where it was."""
        if self._identity is None or _identity(self._path) == self._identity:
            return ""
        name = self._present_name()
        if name is None:
            return (
                "was renamed while it was written: the file of the new name has all scores; give "
                "it the old name again, and the same command goes on"
            )
        if not os.path.exists(name):
            return "was removed while it was written, and what was scored since then is lost"
        return (
            f"was renamed to {name} while it was written: that file has all scores; give it the "
            "old name again, and the same command goes on"
        )

    def _present_name(self) -> str | None:
        """None where the system does not tell."""
        if not DESCRIPTORS.is_dir():
            return None
        links = (DESCRIPTORS / name for name in os.listdir(DESCRIPTORS))
        found = (os.readlink(link) for link in links if _identity(link) == self._identity)
        return next(found, None)


def _identity(path: Path) -> tuple[int, int] | None:
    """The same for all names of a file; None if there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino
