"""HDF5 files that are there whole, or as they were; also on a full disk."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py

from energymargin.base.replacing import replaced


class Sink(io.FileIO):
    """The bytes of a file that HDF5 writes.

    HDF5 ends the process where it cannot write what is left as a file is closed. So it is told of
    no error: the first one is kept, and what comes after it is dropped.
    """

    _error: OSError | None = None

    def __init__(self, path: Path) -> None:
        """Makes the file, or empties it."""
        super().__init__(path, "w+")

    def __exit__(self, kind: type[BaseException] | None, *error: Any) -> None:
        """Closes it. Raises the error of writing, if there was one."""
        super().__exit__(kind, *error)
        if kind is None or issubclass(kind, Exception):
            self.require_written()

    def require_written(self) -> None:
        """Raises OSError unless all bytes so far are in the file."""
        if self._error is not None:
            raise self._error

    def write(self, data: Any) -> int:
        """Writes all of the data, if there was no error."""
        left = memoryview(data).cast("B")
        size = len(left)
        try:
            while left and self._error is None:
                left = left[super().write(left) :]
        except OSError as error:
            self._error = error
        return size

    def readinto(self, buffer: Any) -> int:
        """Reads; what was dropped is zeros, where HDF5 would take what is in the buffer."""
        into = memoryview(buffer).cast("B")
        count = super().readinto(into) or 0
        into[count:] = bytes(len(into) - count)
        return len(into)

    def truncate(self, size: int | None = None) -> int:
        """Sets the length, if there was no error."""
        try:
            return super().truncate(size)
        except OSError as error:
            self._error = self._error or error
            return self.tell()


@contextmanager
def written(path: Path, **options: Any) -> Iterator[tuple[h5py.File, Sink]]:
    """A new HDF5 file and its bytes, which is at `path` once the `with` block has ended well.

    Raises OSError if it cannot be written; what is at `path` stays.
    """
    with replaced(path) as new, Sink(new) as sink, h5py.File(sink, "w", **options) as file:
        yield file, sink
