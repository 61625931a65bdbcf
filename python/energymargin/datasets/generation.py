"""Random trajectories of a task, in memory or in a file.

A file of any size is made in shards by any number of workers. Each shard is on disk as soon as it
is done, so that the next run goes on where one ended. The file is the same to the byte, whoever
made which shard.
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
from tempfile import TemporaryDirectory

from energymargin import tasks
from energymargin._core import Cancel, Cancelled
from energymargin.checks import whole_number
from energymargin.datasets import files
from energymargin.datasets.columns import as_block
from energymargin.datasets.dataset import Dataset, load, open
from energymargin.datasets.shards import (
    Request,
    Shard,
    ShardFolder,
    folder_of,
    generate_shard,
    generate_trajectory,
    spans_in,
)
from energymargin.executors.pool import Outcome, Pool
from energymargin.executors.processes import ProcessPool
from energymargin.executors.threads import core_count
from energymargin.limits import Limit
from energymargin.results import collect
from energymargin.tasks.base import Task, parameters_of
from energymargin.tasks.registry import is_installed
from energymargin.trajectories import Trajectory

__all__ = ["generate", "generate_file", "load_or_generate", "trajectories_kept"]

IN_MEMORY = "dataset.h5"  # what workers make, to be read into memory

# At most, of a shard: 0.1 s of balance, 3 s of grasp, 20 MB.
SHARD_TRAJECTORIES = 50
SHARD_STATES = 20_000

WRITE_EVERY = 5.0  # s; this process writes what it has made at least so often
POLL = 0.05  # s; how long a timeout or a cancel may stay unnoticed
LAST_SHARDS = 0.15  # s; a stop waits so long for shards of workers
AHEAD = 3  # jobs for each worker that are handed to the pool
MOST_DEATHS = 3  # of workers, at the same shard

Progress = Callable[[int, int], None]


def generate(
    task: str | Task,
    *,
    path: str | os.PathLike[str] | None = None,
    trajectories: int = 50,
    frames: int = 10,
    seed: int = 0,
    processes: int | None = 1,
    pool: Pool | None = None,
    progress: Progress | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Dataset:
    """Random trajectories of a task, in memory or in a file.

    Args:
        task: a name, or a task from `tasks.make`.
        path: the file that is made, and replaced if it is there. The dataset is then open, to be
            read in blocks: close it, or use it in a `with` statement. None: it is in memory.
        trajectories: how many. Trajectory i is the same for any number of them.
        frames: how many of each are recorded, evenly spaced.
        seed: the same seed gives the same trajectories, to the last bit.
        processes: 1 is this one alone, None is one for each core if there is work for more than
            one. The dataset is the same for all.
        pool: workers in place of processes, as `executors.Dask(scheduler).pool()`.
        progress: progress(done, total) is called after each trajectory, or each few.
        timeout: after so many seconds the dataset has the first trajectories, those that are done.
            A task that is no ScriptedTask is asked in between trajectories alone.
        cancel: the same once it is set.

    With a `path`, trajectories that are done wait in a folder beside the file until it is whole.
    After Ctrl-C, a kill, a full disk or a timeout the same call goes on from there.

    Raises ValueError on an unknown task, numbers out of range, a task that workers cannot make, or
    a folder with shards of another dataset; TimeoutError or Cancelled if not even one trajectory is
    done; RuntimeError if a few trajectories end one worker after the other; OSError if the file
    cannot be written.
    """
    limit = Limit(timeout, cancel)
    made = tasks.make(task) if isinstance(task, str) else task
    trajectories = whole_number("trajectories", trajectories, 1)
    if path is None and pool is None and processes == 1:
        return _in_memory(made, Request.of(made, frames, seed), trajectories, limit, progress)
    with TemporaryDirectory() as folder:
        generate_file(
            *(path or Path(folder) / IN_MEMORY, made, trajectories, frames, seed),
            processes=processes,
            pool=pool,
            progress=progress,
            **limit.rest(),
        )
        return load(Path(folder) / IN_MEMORY) if path is None else open(path)


def _in_memory(
    task: Task,
    request: Request,
    trajectories: int,
    limit: Limit,
    progress: Progress | None,
) -> Dataset:
    recorded: list[Trajectory] = []
    for index in range(trajectories):
        try:
            limit.require("one trajectory was done")
            recorded.append(generate_trajectory(task, request, index, limit))
        except (TimeoutError, Cancelled):
            if recorded and limit.reached:
                break
            raise
        if progress is not None:
            progress(index + 1, trajectories)
    return Dataset(task.name, request.parameters, request.seed, recorded)


def load_or_generate(
    path: str | os.PathLike[str],
    task: Task,
    trajectories: int = 50,
    frames: int = 10,
    seed: int = 0,
    *,
    progress: Progress | None = None,
) -> Dataset:
    """The dataset in a file, which is made if there is none. Arguments: as `generate`.

    Raises ValueError if the file holds another.
    """
    path = Path(path)
    if not path.exists():
        dataset = generate(
            task, trajectories=trajectories, frames=frames, seed=seed, progress=progress
        )
        dataset.save(path)
        return dataset
    dataset = load(path)
    found = (dataset.task, dataset.parameters, dataset.seed, dataset.lengths.tolist())
    if found != (task.name, parameters_of(task), seed, [frames] * trajectories):
        raise ValueError(f"{path} holds other trajectories: remove it, or choose another folder")
    return dataset


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
    with ShardFolder(Path(path), request) as folder:
        work = _Generation(folder, request, total, size, limit, progress)
        with _pool(made, work, processes, pool) as elsewhere:
            if elsewhere is None:
                _in_this_process(made, work)
            else:
                shards = _ShardPool(elsewhere, work)
                collect(shards, shards.deliver, limit)
        return _join(folder, request, total, limit)


def trajectories_kept(path: str | os.PathLike[str]) -> int:
    """How many trajectories of a file that is being made are done."""
    return sum(last - first for first, last in spans_in(folder_of(Path(path))))


@dataclass(eq=False)
class _Generation:
    """The trajectories that are asked for, and the folder of those that are done."""

    folder: ShardFolder
    request: Request
    total: int
    size: int
    limit: Limit
    progress: Progress | None

    def __post_init__(self) -> None:
        """Counts what is done already."""
        self.done = self.folder.count(self.total)
        if self.done:
            self.advance(0)

    def shards(self) -> Iterator[Shard]:
        """The shards that are missing."""
        missing = self.folder.missing(self.size, self.total)
        return (Shard(self.request, first, last) for first, last in missing)

    def advance(self, count: int) -> None:
        """Counts so many more trajectories."""
        self.done += count
        if self.progress is not None:
            self.progress(self.done, self.total)


@contextmanager
def _pool(
    task: Task, work: _Generation, processes: int | None, pool: Pool | None
) -> Iterator[Pool | None]:
    """The pool of workers; None for this process."""
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


def _in_this_process(task: Task, work: _Generation) -> None:
    """One trajectory after the other."""
    for shard in work.shards():
        recorded: list[Trajectory] = []
        first, written = shard.first, time.monotonic()
        try:
            for index in range(shard.first, shard.last):
                if work.limit.reached:
                    return
                recorded.append(generate_trajectory(task, work.request, index, work.limit))
                work.advance(1)
                if time.monotonic() - written > WRITE_EVERY:
                    work.folder.add(first, as_block(recorded))
                    first, recorded, written = index + 1, [], time.monotonic()
        except (TimeoutError, Cancelled):
            if not work.limit.reached:  # the task's own
                raise
            return
        finally:
            if recorded:
                work.folder.add(first, as_block(recorded))


class _ShardPool:
    """The Workers of a pool, with the missing shards: a few at hand for each worker."""

    def __init__(self, pool: Pool, work: _Generation) -> None:
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
        return self._pool.take(POLL)

    def stop(self) -> Sequence[Outcome]:
        """As Workers.stop."""
        outcomes = self._pool.stop(LAST_SHARDS) if self._running else []
        return [outcome for outcome in outcomes if not _went_wrong(outcome)]

    def deliver(self, outcomes: Sequence[Outcome]) -> None:
        """Writes shards that are done; one whose worker has died is done again. Raises the error of
        a shard after all others are written."""
        for outcome in sorted(outcomes, key=_went_wrong):
            shard = self._running.pop(outcome.job)
            if outcome.error is not None:
                raise outcome.error
            if outcome.died:
                self._deaths[shard.first] += 1
                _require_few(self._deaths[shard.first], shard, outcome)
                self._waiting.append(shard)
            elif outcome.value is not None:
                self._work.folder.add(outcome.job, outcome.value)
                self._work.advance(len(outcome.value))


def _went_wrong(outcome: Outcome) -> bool:
    return bool(outcome.died) or outcome.error is not None


def _join(folder: ShardFolder, request: Request, total: int, limit: Limit) -> int:
    """Makes the file of the shards; returns how many trajectories it has."""
    count = folder.without_gap(total)
    if count == 0:
        limit.require("one trajectory was done")
    if count < total and not limit.reached:
        raise RuntimeError(
            f"the pool stopped when {folder.count(total)} of {total} trajectories were done, which "
            "are kept: hand in another, and the same call goes on"
        )
    files.write(folder.path, request.task, request.parameters, request.seed, folder.blocks(count))
    if count == total:
        folder.remove()
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
