"""A file that HDF5 writes to, on a disk that may get full."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import h5py

from energymargin.replacing import replaced

__all__ = ["written"]

_LIBRARY = ("v110", "v110")  # whose metadata has checksums
_CACHE = 2**19  # bytes of chunks of a column that are not written yet; two chunks
# Room for what HDF5 still has to write when it gives up a file; without it, it says long words and
# never closes it.
_RESERVE = 2**22  # bytes


@contextmanager
def written(path: Path) -> Iterator[h5py.File]:
    """A new file, which is at `path` once the `with` block has ended well, whole.

    Raises OSError if it cannot be written; what is at `path` stays.
    """
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such folder", str(path.parent))
    with (
        replaced(path, named=True) as new,  # HDF5 needs a name
        _reserved(path) as reserve,
        h5py.File(new, "w", libver=_LIBRARY, rdcc_nbytes=_CACHE) as file,
    ):
        try:
            yield file
            file.flush()
        except BaseException as error:
            reserve.close()
            if os.strerror(errno.ENOSPC) in str(error):
                raise _full(path) from error
            raise


@contextmanager
def _reserved(path: Path) -> Iterator[IO[bytes]]:
    """Room beside `path`, which is free again once this file without a name is closed."""
    with tempfile.TemporaryFile(dir=path.parent) as reserve:
        try:
            os.posix_fallocate(reserve.fileno(), 0, _RESERVE)
        except OSError as error:
            raise _full(path) if error.errno == errno.ENOSPC else error from None
        yield reserve


def _full(path: Path) -> OSError:
    return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
