"""The parts of a dataset that is being made: a folder beside its file, `.push.h5.parts/`.

    request.json         what the trajectories are made from
    000000050-000000100  one part: these trajectories, the last not among them (a .npz of a Block)

A part is there whole or not at all, so that a run may end at any moment and another go on. Of two
runs at once the second is refused: the first has locked the folder.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import zipfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from energymargin.closing import Closing
from energymargin.datasets.columns import COLUMNS, Block
from energymargin.datasets.rollouts import Request
from energymargin.replacing import replace_text, replaced

__all__ = ["Parts", "folder_of"]

PARTS_VERSION = 1
SUFFIX = ".npz"

Span = tuple[int, int]
"""Trajectories: the first, and the one after the last."""


def folder_of(path: Path) -> Path:
    """Where the parts of this file are kept."""
    return path.with_name(f".{path.name}.parts")


def spans_in(folder: Path) -> list[Span]:
    """Of the parts that are there, rising."""
    names = [file.name.removesuffix(SUFFIX) for file in folder.glob(f"[0-9]*{SUFFIX}")]
    return sorted((int(first), int(last)) for first, _, last in (n.partition("-") for n in names))


class Parts(Closing):
    """The folder of the parts of one file, locked; use it in a `with` statement."""

    def __init__(self, path: Path, request: Request) -> None:
        """Opens it, or makes it.

        Raises ValueError if another process works on it, or if it holds parts of another request.
        """
        if not path.parent.is_dir():
            raise FileNotFoundError(errno.ENOENT, "no such folder", str(path.parent))
        self.path, self.folder = path, folder_of(path)
        self._asked = {
            **request.as_json(),
            "energymargin": version("energymargin"),
            "parts": PARTS_VERSION,
        }
        self.folder.mkdir(exist_ok=True)
        self._lock = os.open(self.folder, os.O_RDONLY)
        try:
            self._take()
        except BaseException:
            os.close(self._lock)
            raise

    def keep(self, first: int, block: Block) -> None:
        """Keeps these trajectories, of which the first has this index."""
        last = first + len(block)
        columns: dict[str, Any] = {f"column_{name}": block.columns[name] for name in COLUMNS}
        bodies = np.array(json.dumps(block.bodies))
        try:
            with replaced(self._file((first, last))) as path, path.open("wb") as file:
                np.savez(file, rows=block.rows, bodies=bodies, **columns)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.folder)) from error

    def spans(self) -> list[Span]:
        """Of the parts that are there, rising."""
        return spans_in(self.folder)

    def missing(self, size: int, total: int) -> Iterator[Span]:
        """The trajectories of `total` that are in no part, in spans of at most `size`."""
        begin = 0
        for first, last in [*self.spans(), (total, total)]:
            while begin < min(first, total):
                end = min((begin // size + 1) * size, first, total)
                yield begin, end
                begin = end
            begin = max(begin, last)

    def kept(self, total: int) -> int:
        """How many of the first `total` trajectories are there."""
        return sum(max(0, min(last, total) - first) for first, last in self.spans())

    def without_gap(self, total: int) -> int:
        """How many of the first `total` are there before one is missing."""
        return next((first for first, _ in self.missing(total, total)), total)

    def blocks(self, total: int) -> Iterator[Block]:
        """The first `total` trajectories.

        Raises ValueError if a part is damaged, and removes that part.
        """
        for first, last in self.spans():
            if first < total:
                yield self._read((first, last)).part(0, min(last, total) - first)

    def remove(self) -> None:
        """Removes the folder with all parts."""
        shutil.rmtree(self.folder)

    def close(self) -> None:
        """Unlocks the folder; one without parts is removed."""
        if self.folder.exists() and not self.spans():
            self.remove()
        os.close(self._lock)

    def _take(self) -> None:
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(f"another process is generating {self.path}: let it finish") from None
        asked = self.folder / "request.json"
        if self.spans():
            self._require_same(asked)
        replace_text(asked, json.dumps(self._asked, indent=1))

    def _require_same(self, asked: Path) -> None:
        try:
            found: dict[str, Any] = json.loads(asked.read_text())
        except (OSError, ValueError):
            found = {}
        different = [name for name in self._asked if found.get(name) != self._asked[name]]
        if different:
            shown = "; ".join(
                f"{name}: {found.get(name)} there, {self._asked[name]} now" for name in different
            )
            raise ValueError(
                f"{self.folder} holds parts of other trajectories. To go on with those, ask for "
                f"the same; to drop them, remove that folder. {shown}"
            )

    def _read(self, span: Span) -> Block:
        try:
            with np.load(self._file(span), allow_pickle=False) as arrays:
                columns = {name: arrays[f"column_{name}"] for name in COLUMNS}
                return Block(arrays["rows"], columns, json.loads(str(arrays["bodies"])))
        except (ValueError, LookupError, EOFError, zipfile.BadZipFile) as error:
            self._file(span).unlink()
            raise ValueError(
                f"{self._file(span)} was damaged, and is removed: the same call makes it again"
            ) from error

    def _file(self, span: Span) -> Path:
        first, last = span
        return self.folder / f"{first:09d}-{last:09d}{SUFFIX}"
