"""A dataset of any size, made in shards by any number of workers, straight into its file.

Each shard is kept as soon as it is there, so that a run that ends, however it ends, is gone on with
by the next. The file is the same to the byte, whoever made which shard and when.
"""

from __future__ import annotations

import json
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from energymargin import tasks
from energymargin._core import Cancel, Cancelled
from energymargin.checks import whole_number
from energymargin.datasets import files
from energymargin.datasets.columns import as_block
from energymargin.datasets.parts import Parts, folder_of, spans_in
from energymargin.datasets.rollouts import Request, Shard, generate_shard, generate_trajectory
from energymargin.executors.jobs import Outcome, Pool
from energymargin.executors.processes import ProcessPool
from energymargin.executors.threads import core_count
from energymargin.limits import Limit
from energymargin.results import collect
from energymargin.tasks.base import Task, parameters_of
from energymargin.tasks.registry import is_installed
from energymargin.trajectories import Trajectory

__all__ = ["generate_file", "trajectories_kept"]

# A shard is at most this large: 0.1 s of balance, 3 s of grasp, and at most 20 MB.
SHARD_TRAJECTORIES = 50
SHARD_STATES = 20_000

KEEP_EVERY = 5.0  # s; what is made in this process is kept at least so often
TAKE = 0.05  # s; how long a timeout or a cancel may go unseen
LAST_WORDS = 0.15  # s; for workers to hand over what they have before they are ended
AHEAD = 3  # jobs for each worker that are handed to the pool
MOST_DEATHS = 3  # of workers, at the same shard

Progress = Callable[[int, int], None]


def generate_file(
    path: str | os.PathLike[str],
    task: str | Task,
    trajectories: int = 50,
    frames: int = 10,
    seed: int = 0,
    *,
    processes: int | None = 1,
    pool: Pool | None = None,
    progress: Progress | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> int:
    """Makes the file of `generate`, without holding it in memory; returns how many trajectories it
    has. Arguments and errors: as `generate`, with a path."""
    limit = Limit(timeout, cancel)
    made = tasks.make(task) if isinstance(task, str) else task
    total = whole_number("trajectories", trajectories, 1)
    core_count("processes", processes)
    request = Request.of(made, frames, seed)
    size = max(1, min(SHARD_TRAJECTORIES, SHARD_STATES // whole_number("frames", frames, 1)))
    with Parts(Path(path), request) as parts:
        work = _Work(parts, request, total, size, limit, progress)
        with _pool(made, work, processes, pool) as elsewhere:
            if elsewhere is None:
                _work_here(made, work)
            else:
                shards = _ShardPool(elsewhere, work)
                collect(shards, shards.keep, limit)
        return _join(parts, request, total, limit)


def trajectories_kept(path: str | os.PathLike[str]) -> int:
    """How many trajectories of a file that is being made are kept beside it."""
    return sum(last - first for first, last in spans_in(folder_of(Path(path))))


@dataclass
class _Work:
    """What is to be done, and where it is kept."""

    parts: Parts
    request: Request
    total: int
    size: int
    limit: Limit
    progress: Progress | None

    def __post_init__(self) -> None:
        """Says what is there already."""
        self.done = self.parts.kept(self.total)
        if self.done:
            self.advance(0)

    def shards(self) -> Iterator[Shard]:
        """Those that are missing."""
        missing = self.parts.missing(self.size, self.total)
        return (Shard(self.request, first, last) for first, last in missing)

    def advance(self, count: int) -> None:
        """So many more trajectories are there."""
        self.done += count
        if self.progress is not None:
            self.progress(self.done, self.total)


@contextmanager
def _pool(
    task: Task, work: _Work, processes: int | None, pool: Pool | None
) -> Iterator[Pool | None]:
    """The workers; None is this process."""
    if pool is not None:
        _require_registered(task, "there is a pool of workers")
        yield pool
        return
    if processes is None:
        processes = core_count("processes", None) if _can_be_made_again(task) else 1
    elif processes > 1:
        _require_registered(task, f"processes is {processes}")
    processes = min(processes, sum(1 for _ in work.shards()))
    if processes <= 1:
        yield None
        return
    with ProcessPool(processes) as own:
        yield own


def _work_here(task: Task, work: _Work) -> None:
    """One trajectory after the other."""
    for shard in work.shards():
        recorded: list[Trajectory] = []
        first, kept = shard.first, time.monotonic()
        try:
            for index in range(shard.first, shard.last):
                if work.limit.reached:
                    return
                recorded.append(generate_trajectory(task, work.request, index, work.limit))
                work.advance(1)
                if time.monotonic() - kept > KEEP_EVERY:
                    work.parts.keep(first, as_block(recorded))
                    first, recorded, kept = index + 1, [], time.monotonic()
        except (TimeoutError, Cancelled):
            if not work.limit.reached:  # the task's own
                raise
            return
        finally:
            if recorded:
                work.parts.keep(first, as_block(recorded))


class _ShardPool:
    """The Workers of a pool, with the missing shards: a few at hand for each worker."""

    def __init__(self, pool: Pool, work: _Work) -> None:
        self._pool, self._work = pool, work
        self._waiting = list(work.shards())[::-1]
        self._running: dict[int, Shard] = {}
        self._deaths: Counter[int] = Counter()

    @property
    def busy(self) -> bool:
        """As Workers.busy."""
        return bool(self._waiting or self._running)

    def step(self) -> Sequence[Outcome]:
        """As Workers.step."""
        while self._waiting and len(self._running) < AHEAD * max(1, self._pool.slots):
            shard = self._waiting.pop()
            self._running[shard.first] = shard
            self._pool.submit(shard.first, generate_shard, shard)
        return self._pool.take(TAKE)

    def stop(self) -> Sequence[Outcome]:
        """As Workers.stop."""
        outcomes = self._pool.stop(LAST_WORDS) if self._running else []
        return [outcome for outcome in outcomes if not _went_wrong(outcome)]

    def keep(self, outcomes: Sequence[Outcome]) -> None:
        """Keeps what is done; a shard whose worker has died is done again. Raises what went wrong
        in a shard, once all else is kept."""
        for outcome in sorted(outcomes, key=_went_wrong):
            shard = self._running.pop(outcome.job)
            if outcome.error is not None:
                raise outcome.error
            if outcome.died:
                self._deaths[shard.first] += 1
                _require_few(self._deaths[shard.first], shard, outcome)
                self._waiting.append(shard)
            elif outcome.value is not None:
                self._work.parts.keep(outcome.job, outcome.value)
                self._work.advance(len(outcome.value))


def _went_wrong(outcome: Outcome) -> bool:
    return bool(outcome.died) or outcome.error is not None


def _join(parts: Parts, request: Request, total: int, limit: Limit) -> int:
    """Makes the file of the parts; returns how many trajectories it has."""
    count = parts.without_gap(total)
    if count == 0:
        limit.require("one trajectory was done")
    if count < total and not limit.reached:
        raise RuntimeError(
            f"the pool stopped when {parts.kept(total)} of {total} trajectories were done, which "
            "are kept: hand in another, and the same call goes on"
        )
    files.write(parts.path, request.task, request.parameters, request.seed, parts.blocks(count))
    if count == total:
        parts.remove()
    return count


def _require_few(deaths: int, shard: Shard, outcome: Outcome) -> None:
    if deaths >= MOST_DEATHS:
        raise RuntimeError(
            f"{deaths} workers died at trajectories {shard.first} to {shard.last - 1}, the last "
            f"one {outcome.died}: what is done is kept; see what that task does there, or whether "
            "memory is short"
        )


def _require_registered(task: Task, given: str) -> None:
    if not _can_be_made_again(task):
        raise ValueError(
            f"{given}, but workers cannot make the task {task.name!r} of "
            f"{type(task).__module__}: register it as an entry point of the group "
            "'energymargin.tasks', or use processes=1"
        )


def _can_be_made_again(task: Task) -> bool:
    """Whether a worker gets the same task by its name and parameters."""
    if not is_installed(task.name):
        return False
    parameters = parameters_of(task)
    again = tasks.make(task.name, **json.loads(json.dumps(parameters)))
    return type(again) is type(task) and parameters_of(again) == parameters
