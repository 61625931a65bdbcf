"""Shards of a dataset that is being generated: how a worker makes one, and where each waits.

A store beside the dataset's file, `.push.h5.parts`, has the shards that are done: trajectories in a
row, as a .npz of a Block. So a run may end at any moment, and another one goes on.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from functools import lru_cache
from importlib.metadata import version
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from energymargin import tasks
from energymargin._core import Cancel, Cancelled
from energymargin.base.checks import whole_number
from energymargin.evaluate.store.answer_file import AnswerFile
from energymargin.records.datasets.columns import COLUMNS, Block, as_block
from energymargin.tasks.base import Task, parameters_of
from energymargin.tasks.scripted import ScriptedTask
from energymargin.tasks.trajectories import Trajectory

# At most, of a shard: 0.1 s of balance, 3 s of grasp, 20 MB.
SHARD_TRAJECTORIES = 50
SHARD_STATES = 20_000
SHARDS, REQUEST = b"shards", b"request"  # what the store has

Span = tuple[int, int]
"""Trajectories: the first, and the one after the last."""


@dataclass(frozen=True, eq=False)
class Request:
    """What the trajectories depend on: each is made from this and its index alone."""

    task: str
    parameters: dict[str, Any]
    seed: int
    frames: int

    @property
    def most(self) -> int:
        """Trajectories of a shard."""
        return max(1, min(SHARD_TRAJECTORIES, SHARD_STATES // self.frames))

    @classmethod
    def of(cls, task: Task, frames: int, seed: int) -> Request:
        """Raises ValueError on a seed of more than 63 bits; a rollout checks `frames`."""
        seed = whole_number("seed", seed, 0, 2**63 - 1)
        return cls(task.name, parameters_of(task), seed, frames)


def generate_shard(
    request: Request, task: Task | None, indices: Sequence[int], cancel: Cancel
) -> list[Block | None]:
    """On a worker: trajectories in a row as one shard, at the first of them; once it is cancelled,
    those that are finished. None: the task of the request is made there."""
    task = task or _made(json.dumps(asdict(request)))
    recorded: list[Trajectory] = []
    interruptible = isinstance(task, ScriptedTask) and type(task).rollout is ScriptedTask.rollout
    try:
        for index in indices:
            if cancel.is_set:
                break
            options: dict[str, Any] = {"cancel": cancel} if interruptible else {}
            seed = _stream(request.seed, index)
            recorded.append(task.rollout(seed, request.frames, **options))
    except Cancelled:
        if not cancel.is_set:  # the task's own
            raise
    places = range(len(recorded))
    results: list[Block | None] = []
    for _, row in groupby(places, lambda place: indices[place] - place):
        first, *others = row
        results += [as_block(recorded[first : first + 1 + len(others)]), *(None for _ in others)]
    return results


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


class Parts(AnswerFile):
    """The store of the shards of one file."""

    doing = "generating"

    def __init__(self, path: Path, request: Request) -> None:
        """Opens it, or makes it.

        Raises ValueError if another process has it, or if it has shards of another request.
        """
        place = parts_of(path)
        if place.is_dir():
            raise ValueError(f"{place} is a folder of parts, as of 0.14: remove it, and ask again")
        super().__init__(place, create=True)
        self.request = request
        asked = json.dumps({**asdict(request), "energymargin": version("energymargin")})
        try:
            self._require_asked(json.loads(asked))
            if self.answer(REQUEST) != asked.encode():
                self.keep(REQUEST, asked.encode())
        except BaseException:
            self.close()
            raise

    def add(self, first: int, block: Block) -> None:
        """Keeps a shard; the first of its trajectories has this index."""
        columns: dict[str, Any] = {f"column_{name}": block.columns[name] for name in COLUMNS}
        file = io.BytesIO()
        np.savez(file, rows=block.rows, bodies=np.array(json.dumps(block.bodies)), **columns)
        self.keep(SHARDS, file.getvalue(), first, len(block))

    def missing(self, total: int) -> list[Span]:
        """The trajectories of `total` that are in no shard, rising."""
        missing, begin = [], 0
        for first, last in [*self.spans(SHARDS), (total, total)]:
            if begin < min(first, total):
                missing.append((begin, min(first, total)))
            begin = max(begin, last)
        return missing

    def trajectories(self, total: int) -> Iterator[Trajectory]:
        """The first `total` trajectories.

        Raises ValueError if a shard is damaged, and drops it.
        """
        for first, last in self.spans(SHARDS):
            if first < total:
                block = self._read(first)
                yield from map(block.trajectory, range(min(last, total) - first))

    def forget(self) -> None:
        """Drops all shards, once the file is whole."""
        with self.transaction():
            self.database.execute("DELETE FROM answers")

    def _require_asked(self, asked: dict[str, Any]) -> None:
        found = json.loads(self.answer(REQUEST) or "{}")
        different = [name for name in asked if found.get(name) != asked[name]]
        if different and self.spans(SHARDS):
            shown = "; ".join(f"{n}: {found.get(n)} there, {asked[n]} now" for n in different)
            raise ValueError(
                f"{self.path} holds parts of other trajectories. To go on with those, ask for "
                f"the same; to drop them, remove that file. {shown}"
            )

    def _read(self, first: int) -> Block:
        content = self.answer(SHARDS, first) or b""
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
                columns = {name: arrays[f"column_{name}"] for name in COLUMNS}
                return Block(arrays["rows"], columns, json.loads(str(arrays["bodies"])))
        except (ValueError, LookupError, EOFError, zipfile.BadZipFile) as error:
            with self.transaction():
                self.database.execute("DELETE FROM answers WHERE first = ?", (first,))
            raise ValueError(
                f"the shard of {self.path} that begins with trajectory {first} was damaged, and is "
                "removed: the same call makes it again"
            ) from error


def parts_of(path: Path) -> Path:
    """Where the shards of this file wait."""
    return path.with_name(f".{path.name}.parts")


@contextmanager
def opened_parts(path: Path, request: Request) -> Iterator[Parts]:
    """The store of a file, which goes if it has no shards when it is closed. It needs no checksum:
    each .npz has its own."""
    parts = Parts(path, request)
    try:
        yield parts
    finally:
        parts.close(remove=not parts.spans(SHARDS))


def trajectories_kept(path: Path) -> int:
    """How many trajectories of a file that is being made are done."""
    with suppress(FileNotFoundError, ValueError), AnswerFile(parts_of(path)) as parts:
        return sum(last - first for first, last in parts.spans(SHARDS))
    return 0
