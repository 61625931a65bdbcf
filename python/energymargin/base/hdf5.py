"""Opens HDF5 files, which may be a stranger's: nothing outside of the file is read, and nothing in
it takes more memory than what is stored.

HDF5 has links into other files, data that lies in other files ("external raw storage") or is put
together from them ("virtual"), and arrays that are large without being stored. All are refused.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import h5py
import numpy as np

MOST_THINGS = 100_000  # groups and arrays of a file
MOST_DEPTH = 32  # groups within groups
PACKED = 1_100  # bytes of one that is stored; gzip reaches 1,032
SMALL = 2**20  # bytes that an array may have without being stored
MOST_TEXT = 2**28  # bytes of text in a file: many places may hold the same one


class Array(NamedTuple):
    """An array of a file."""

    name: str
    data: h5py.Dataset


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[h5py.File]:
    """The file, to be read, once `checked`. Raises what that does, and OSError."""
    with h5py.File(path, "r") as file:
        checked(file)
        yield file


def checked(file: h5py.File) -> list[Array]:
    """All arrays of a file, by the first of their names.

    Raises ValueError that names what reaches out of the file, what is not stored, and what is too
    much or nested too deep. Soft links within the file are not followed.
    """
    found: list[Array] = []
    seen, new = {_place(file)}, [(file, "", 0)]
    _check_attributes(file)
    while new:
        group, prefix, depth = new.pop()
        if depth > MOST_DEPTH:
            raise ValueError(f"{prefix[:60]!r} is nested deeper than {MOST_DEPTH} groups")
        for key in group:
            name = f"{prefix}{key}"
            link = group.get(key, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                expected = "expected a file that is whole by itself: copy what it links to into it"
                raise ValueError(f"{name!r} is a link to {link.filename!r}, {expected}")
            thing = None if isinstance(link, h5py.SoftLink) else group[key]
            if thing is None or (place := _place(thing)) in seen:
                continue
            seen.add(place)
            if len(seen) > MOST_THINGS:
                raise ValueError(f"has more than {MOST_THINGS} groups and arrays")
            if isinstance(thing, h5py.Group):
                new.append((thing, f"{name}/", depth + 1))
            elif isinstance(thing, h5py.Dataset):
                _check_stored(name, thing)
                found.append(Array(name, thing))
    return sorted(found)


def texts(array: h5py.Dataset, size: int) -> Any:
    """The texts of an array in a file of `size` bytes; ValueError if they are too much."""
    rows, left = array.asstr(), MOST_TEXT
    if not array.shape:
        return rows[()]
    parts, step = [], max(1, MOST_TEXT // max(1, size) // max(1, int(np.prod(array.shape[1:]))))
    for start in range(0, len(array), step):
        parts.append(rows[start : start + step])
        left -= sum(map(len, parts[-1].ravel()))
        if left < 0:
            raise ValueError(f"{array.name!r} has more than {MOST_TEXT} bytes of text")
    return np.concatenate(parts) if parts else np.empty(array.shape, object)


def _place(thing: Any) -> tuple[int, int]:
    info = h5py.h5o.get_info(thing.id)
    return int(info.fileno), int(info.addr)


def _check_stored(name: str, array: h5py.Dataset) -> None:
    """Raises ValueError unless what an array says it has is in the file."""
    if array.external:
        wrong = f"{name!r} has its data in another file ({array.external[0][0]!r})"
        raise ValueError(f"{wrong}, expected a file that is whole by itself")
    if array.is_virtual:
        raise ValueError(f"{name!r} is put together from other files, expected its own data")
    size, stored = array.nbytes, array.id.get_storage_size()
    if size > SMALL + PACKED * stored:
        wrong = f"{name!r} says that it has {size} bytes, of which {stored} are stored"
        raise ValueError(f"{wrong}, expected at most {PACKED} times as many")


def _check_attributes(file: h5py.File) -> None:
    for key in file.attrs:
        count = int(np.prod(file.attrs.get_id(key).shape or ()))
        if count > MOST_THINGS:
            raise ValueError(f"the attribute {key!r} has {count} values, at most {MOST_THINGS}")
