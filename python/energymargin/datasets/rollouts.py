"""What a dataset is generated from: one trajectory, or a shard of them in a worker."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from energymargin import tasks
from energymargin._core import Cancel, Cancelled
from energymargin.checks import whole_number
from energymargin.datasets.columns import Block, as_block
from energymargin.executors.jobs import Stopped
from energymargin.limits import Limit
from energymargin.tasks.base import ScriptedTask, Task, parameters_of
from energymargin.trajectories import Trajectory

__all__ = ["Request", "Shard", "generate_shard", "generate_trajectory"]

STOP_ASKED = 0.01  # s between two looks at whether a job is to stop


@dataclass(frozen=True)
class Request:
    """What its trajectories depend on: each is made from this and its index alone."""

    task: str
    parameters: dict[str, Any]
    seed: int
    frames: int

    @classmethod
    def of(cls, task: Task, frames: int, seed: int) -> Request:
        """Raises ValueError on a seed that no file can hold; of frames, the task knows."""
        seed = whole_number("seed", seed, 0, 2**63 - 1)
        return cls(task.name, parameters_of(task), seed, frames)

    def as_json(self) -> dict[str, Any]:
        """As it is read back. Raises TypeError on a parameter that JSON has not."""
        made: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return made


@dataclass(frozen=True)
class Shard:
    """A job: the trajectories from `first` on, before `last`."""

    request: Request
    first: int
    last: int


def generate_trajectory(task: Task, request: Request, index: int, limit: Limit) -> Trajectory:
    """The trajectory of this index."""
    seed = _stream(request.seed, index)
    if isinstance(task, ScriptedTask) and type(task).rollout is ScriptedTask.rollout:
        return task.rollout(seed, request.frames, **limit.rest())
    return task.rollout(seed, request.frames)


def generate_shard(shard: Shard, stopped: Stopped) -> Block | None:
    """The job of a worker: the trajectories of a shard, the first of them if it is stopped."""
    task = _made(json.dumps(asdict(shard.request)))
    recorded: list[Trajectory] = []
    with _cancelled_when(stopped) as cancel:
        limit = Limit(cancel=cancel)
        try:
            for index in range(shard.first, shard.last):
                if limit.reached:
                    break
                recorded.append(generate_trajectory(task, shard.request, index, limit))
        except Cancelled:
            if not limit.reached:  # the task's own
                raise
    return as_block(recorded) if recorded else None


@lru_cache(1)
def _made(request: str) -> Task:
    """Once for all jobs of a run: looking for it takes longer than a quick trajectory."""
    fields = json.loads(request)
    return tasks.make(fields["task"], **fields["parameters"])


@contextmanager
def _cancelled_when(stopped: Stopped) -> Iterator[Cancel]:
    """A cancel that is set when a job is to stop, so that a long simulation ends as well."""
    cancel, done = Cancel(), threading.Event()

    def watch() -> None:
        while not done.wait(STOP_ASKED):
            if stopped():
                cancel.set()
                return

    if stopped():
        cancel.set()
    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield cancel
    finally:
        done.set()
        watcher.join()


def _stream(seed: int, index: int) -> int:
    """The seed of one trajectory: 63 bits, which fit every integer type on disk."""
    return int(
        np.random.SeedSequence((seed, index)).generate_state(1, np.uint64)[0] >> np.uint64(1)
    )
