"""Shards of a dataset that is being generated: how a worker makes one, and where each waits.

A folder beside the dataset's file, `.push.h5.parts/`, has the shards that are done:

    request.json         what the trajectories are made from
    000000050-000000100  one shard: these trajectories, the last not among them (a .npz of a Block)

A shard is there whole or not at all, so that a run may end at any moment and another go on. Of two
runs at once the second is refused.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from energymargin import tasks
from energymargin._core import Cancel, Cancelled
from energymargin.base.checks import whole_number
from energymargin.base.closing import Closing
from energymargin.base.limits import Limit
from energymargin.base.locks import Lock
from energymargin.base.replacing import replace_text, replaced
from energymargin.records.datasets.columns import COLUMNS, Block, as_block
from energymargin.tasks.base import Task, parameters_of
from energymargin.tasks.scripted import ScriptedTask
from energymargin.tasks.trajectories import Trajectory

PARTS_VERSION = 1
SUFFIX = ".npz"

Span = tuple[int, int]
"""Trajectories: the first, and the one after the last."""


@dataclass(frozen=True, eq=False)
class Request:
    """What the trajectories depend on: each is made from this and its index alone."""

    task: str
    parameters: dict[str, Any]
    seed: int
    frames: int

    @classmethod
    def of(cls, task: Task, frames: int, seed: int) -> Request:
        """Raises ValueError on a seed of more than 63 bits; a rollout checks `frames`."""
        seed = whole_number("seed", seed, 0, 2**63 - 1)
        return cls(task.name, parameters_of(task), seed, frames)


def generate_shard(
    request: Request, task: Task | None, indices: Sequence[int], cancel: Cancel
) -> list[tuple[int, Block]]:
    """On a worker: trajectories in a row, with the index of the first; once it is cancelled, those
    that are finished. None: the task of the request is made there."""
    task = task or _made(json.dumps(asdict(request)))
    recorded: list[Trajectory] = []
    limit = Limit(cancel=cancel)
    interruptible = isinstance(task, ScriptedTask) and type(task).rollout is ScriptedTask.rollout
    try:
        for index in indices:
            if limit.reached:
                break
            options: dict[str, Any] = {**limit.rest()} if interruptible else {}
            seed = _stream(request.seed, index)
            recorded.append(task.rollout(seed, request.frames, **options))
    except Cancelled:
        if not limit.reached:  # the task's own
            raise
    return [(indices[0], as_block(recorded))] if recorded else []


@lru_cache(1)
def _made(request: str) -> Task:
    """The task, made once for all jobs of a run: its entry point takes longer than a trajectory."""
    fields = json.loads(request)
    return tasks.make(fields["task"], **fields["parameters"])


def _stream(seed: int, index: int) -> int:
    """The seed of one trajectory: 63 bits, which fit every integer type on disk."""
    return int(
        np.random.SeedSequence((seed, index)).generate_state(1, np.uint64)[0] >> np.uint64(1)
    )


def folder_of(path: Path) -> Path:
    """Where the shards of this file wait."""
    return path.with_name(f".{path.name}.parts")


def spans_in(folder: Path) -> list[Span]:
    """Spans of the shards that are there, rising."""
    names = [file.name.removesuffix(SUFFIX) for file in folder.glob(f"[0-9]*{SUFFIX}")]
    return sorted((int(first), int(last)) for first, _, last in (n.partition("-") for n in names))


class ShardFolder(Closing):
    """The folder of the shards of one file, and its lock; use it in a `with` statement."""

    def __init__(self, path: Path, request: Request) -> None:
        """Opens the folder, or makes it.

        Raises ValueError if another process has it, or if it has shards of another request.
        """
        if not path.parent.is_dir():
            raise FileNotFoundError(errno.ENOENT, "no such folder", str(path.parent))
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        self.folder, self.request = folder_of(path), request
        asked = {**asdict(request), "energymargin": version("energymargin"), "parts": PARTS_VERSION}
        self._lock = Lock(path, "generating")
        try:
            self.folder.mkdir(exist_ok=True)
            self._require_asked(json.loads(json.dumps(asked)))
        except BaseException:
            self._lock.close()
            raise

    def add(self, first: int, block: Block) -> None:
        """Writes a shard; the first of its trajectories has this index."""
        last = first + len(block)
        columns: dict[str, Any] = {f"column_{name}": block.columns[name] for name in COLUMNS}
        bodies = np.array(json.dumps(block.bodies))
        try:
            with replaced(self._file((first, last))) as path, path.open("wb") as file:
                np.savez(file, rows=block.rows, bodies=bodies, **columns)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.folder)) from error

    def missing(self, total: int) -> list[Span]:
        """The trajectories of `total` that are in no shard, rising."""
        missing, begin = [], 0
        for first, last in [*spans_in(self.folder), (total, total)]:
            if begin < min(first, total):
                missing.append((begin, min(first, total)))
            begin = max(begin, last)
        return missing

    def trajectories(self, total: int) -> Iterator[Trajectory]:
        """The first `total` trajectories.

        Raises ValueError if a shard is damaged, and removes it.
        """
        for first, last in spans_in(self.folder):
            if first < total:
                block = self._read((first, last))
                yield from map(block.trajectory, range(min(last, total) - first))

    def remove(self) -> None:
        """Removes the folder with all shards."""
        shutil.rmtree(self.folder)

    def close(self) -> None:
        """Unlocks the folder; removes it if it has no shards."""
        if self.folder.exists() and not spans_in(self.folder):
            self.remove()
        self._lock.close()

    def _require_asked(self, asked: dict[str, Any]) -> None:
        file, found = self.folder / "request.json", asked
        if spans_in(self.folder):
            try:
                found = json.loads(file.read_text())
            except (OSError, ValueError):
                found = {}
        different = [name for name in asked if found.get(name) != asked[name]]
        if different:
            shown = "; ".join(f"{n}: {found.get(n)} there, {asked[n]} now" for n in different)
            raise ValueError(
                f"{self.folder} holds parts of other trajectories. To go on with those, ask for "
                f"the same; to drop them, remove that folder. {shown}"
            )
        replace_text(file, json.dumps(asked, indent=1))

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
