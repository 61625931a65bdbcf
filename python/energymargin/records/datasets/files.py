"""The file of a dataset (HDF5), format version 3: flat columns, written and read in blocks.

    attributes    format, version, task, parameters (JSON), seed
    trajectories  a row for each of T trajectories: type ROW
    times, captured, captured_any, contact_counts, states, contacts, params
                  all trajectories' entries, one after the other: see COLUMNS
    bodies        names, by the numbers in the contacts

The same dataset makes the same bytes: blocks are cut, chunks written, and bodies numbered as the
trajectories alone say. A file is there whole, or as it was; also on a full disk.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from energymargin.base import hdf5
from energymargin.base.aliases import Ints
from energymargin.base.errors import EnergyMarginError
from energymargin.base.replacing import replaced
from energymargin.records.datasets import columns
from energymargin.tasks.trajectories import Trajectory

FORMAT = "energymargin dataset"
VERSION = 3

# Chunks of this many bytes, shuffled and packed with gzip: 2 to 3 times smaller than the numbers
# (of balance, topple and push), and a checksum tells when a disk has changed them.
CHUNK_BYTES = 2**18
_PACKED = {"shuffle": True, "compression": "gzip", "compression_opts": 1, "fletcher32": True}

_BLOCKS_CACHED = 4  # those that were read last

_LIBRARY = ("v110", "v110")  # whose metadata has checksums
_CACHE = 2**19  # bytes of chunks of a column that are not written yet; two chunks


class FileError(EnergyMarginError, ValueError):
    """The file is whole, but not a dataset that can be read here."""


def write(
    path: Path, task: str, parameters: dict[str, Any], seed: int, trajectories: Iterable[Trajectory]
) -> None:
    """Writes the file in one go: it is there whole, or as it was.

    Raises OSError if it cannot be written.
    """
    names = {"format": FORMAT, "version": VERSION, "task": task, "seed": seed}
    with written(path, libver=_LIBRARY, rdcc_nbytes=_CACHE) as (file, sink):
        file.attrs.update(names, parameters=json.dumps(parameters))
        _write_blocks(file, sink, columns.as_blocks(trajectories))


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turns any error into a ValueError that names the file as damaged."""
    try:
        yield
    except (FileError, MemoryError):
        raise
    except Exception as error:
        text = " ".join(str(error).split())
        raise ValueError(f"{path} is damaged or cut short: {text}") from error


class Recorded(Sequence[Trajectory]):
    """The trajectories of an open file, which are read in blocks when they are asked for.

    In memory are a row for each trajectory, and the few blocks that were read last.
    """

    def __init__(self, path: Path) -> None:
        """Opens the file. Raises FileError if it is none of ours, or of another version, and
        ValueError if it is damaged."""
        path.open("rb").close()  # h5py's own words for a file that cannot be read are long
        if not h5py.is_hdf5(path):
            raise FileError(f"{path} is not a dataset: it is not an HDF5 file{_way(path)}")
        with reading(path):
            self.path, self._file = path, h5py.File(path, "r")
            try:
                self._read_all()
            except BaseException:
                self._file.close()
                raise
        self._cuts = np.array(columns.cuts(self.rows["frames"]))
        self._block = lru_cache(_BLOCKS_CACHED)(self._read)

    def _read_all(self) -> None:
        """Reads what is once in the file, and checks it."""
        file = self._file
        hdf5.checked(file)
        _check_format(self.path, file)
        self.task, self.seed = str(file.attrs["task"]), int(file.attrs["seed"])
        self.parameters = json.loads(file.attrs["parameters"])
        if not isinstance(self.parameters, dict):
            raise ValueError(f"its parameters are {self.parameters!r}")
        self.rows = _rows(file)
        self._starts = columns.starts(self.rows)
        self._bodies = [str(name) for name in file["bodies"].asstr()[()]]
        _check_columns(file, self._starts)

    def __len__(self) -> int:
        """T, the number of trajectories."""
        return len(self.rows)

    def __getitem__(self, index: Any) -> Any:
        """Raises ValueError if the file is damaged there, or closed."""
        if isinstance(index, slice):
            return [self[t] for t in range(len(self))[index]]
        t = range(len(self))[index]
        number = int(np.searchsorted(self._cuts, t, side="right")) - 1
        block = self._block(number)
        with reading(self.path):
            return block.trajectory(t - int(self._cuts[number]))

    def blocks(self) -> Iterator[columns.Block]:
        """All trajectories, block by block."""
        for number in range(len(self._cuts) - 1):
            yield self._read(number)

    def close(self) -> None:
        """Closes the file; nothing can be read any more."""
        self._block.cache_clear()
        self._file.close()

    def _read(self, number: int) -> columns.Block:
        if not self._file:
            raise ValueError(f"{self.path} is closed: read from it before, or open it again")
        first, last = self._cuts[number], self._cuts[number + 1]
        with reading(self.path):
            entries = columns.between(self._file, self._starts, first, last)
            block = columns.Block(self.rows[first:last], entries, self._bodies)
            block.check()
        return block


def _write_blocks(file: h5py.File, sink: Sink, blocks: Iterable[columns.Block]) -> None:
    kinds = {name: kind for name, (_, kind) in columns.COLUMNS.items()}
    made = {}
    for name, kind in {"trajectories": columns.ROW, **kinds}.items():
        chunk = (max(1, CHUNK_BYTES // kind.itemsize),)
        grows: dict[str, Any] = {"chunks": chunk, "maxshape": (None,), **_PACKED}
        made[name] = file.create_dataset(name, (0,), kind, **grows)
    bodies = columns.BodyNumbers()
    for block in blocks:
        contacts = bodies.renumbered(block)
        entries = {**block.columns, "contacts": contacts, "trajectories": block.rows}
        for name, column in made.items():
            before = len(column)
            column.resize(before + len(entries[name]), axis=0)
            column[before:] = entries[name]
        sink.require_written()
    file.create_dataset("bodies", data=list(bodies), dtype=h5py.string_dtype())


def _rows(file: h5py.File) -> NDArray[np.void]:
    rows: NDArray[np.void] = file["trajectories"][()]
    if rows.dtype != columns.ROW or rows.ndim != 1 or len(rows) == 0:
        raise ValueError(f"its table of trajectories has shape {rows.shape} of {rows.dtype}")
    counts = ("frames", "width", "contact_count", "params_bytes")
    if any((rows[name] < 0).any() for name in counts) or (rows["frames"] == 0).any():
        raise ValueError("a trajectory has less than nothing")
    columns.check_labels(rows["success_any"])
    return rows


def _check_columns(file: h5py.File, ends: dict[str, Ints]) -> None:
    for name, (counter, kind) in columns.COLUMNS.items():
        column, expected = file[name], int(ends[counter][-1])
        if column.shape != (expected,) or column.dtype != kind:
            text = f"{name} has shape {column.shape} of {column.dtype}"
            raise ValueError(f"{text}, expected {(expected,)} of {kind}")


def _way(path: Path) -> str:
    """What makes a dataset of another file."""
    if path.suffix == ".json":
        return "; a problem is asked with `energymargin rank`, `limits` or `view`"
    if path.suffix in (".csv", ".mcap", ".db3", ".bag"):
        return f"; `energymargin import {path} --problem PROBLEM.json` makes one of a recording"
    return ""


def _check_format(path: Path, file: h5py.File) -> None:
    found = file.attrs.get("format")
    if found is None:
        raise FileError(f"{path} is not a dataset: it is an HDF5 file of something else")
    if found != FORMAT:
        raise FileError(f"{path} is not a dataset: it is {found!r}")
    version = int(file.attrs["version"])
    if version != VERSION:
        older = "generate or import it again, or save it anew with 0.13"
        raise FileError(
            f"{path} has version {version} of the dataset format, and this energymargin reads "
            f"version {VERSION}: {older if version < VERSION else 'update it'}"
        )


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
