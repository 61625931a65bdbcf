"""Random trajectories of a task, in memory or in a file.

A file of any size is made in shards by any number of workers. Each shard is on disk as soon as it
is done, so that the next run goes on where one ended. The file is the same to the byte, whoever
made which shard.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NoReturn

from energymargin import tasks
from energymargin._core import Cancel
from energymargin.checks import core_count, whole_number
from energymargin.datasets import files
from energymargin.datasets.columns import Block
from energymargin.datasets.dataset import Dataset, load, open
from energymargin.datasets.shards import (
    Request,
    ShardFolder,
    Span,
    folder_of,
    generate_shard,
    spans_in,
)
from energymargin.executors import Executor, Processes, Threads
from energymargin.executors.choice import chosen_executor
from energymargin.limits import Limit
from energymargin.parallel import run
from energymargin.tasks.base import Task, parameters_of
from energymargin.tasks.registry import is_installed

# At most, of a shard: 0.1 s of balance, 3 s of grasp, 20 MB.
SHARD_TRAJECTORIES = 50
SHARD_STATES = 20_000

Progress = Callable[[int, int], None]


def generate(
    task: str | Task,
    *,
    path: str | os.PathLike[str] | None = None,
    trajectories: int = 50,
    frames: int = 10,
    seed: int = 0,
    processes: int | None = 1,
    executor: Executor | None = None,
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
        executor: in place of processes, of `em.executors`, as Dask(scheduler).
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
    with TemporaryDirectory() as folder:
        file = Path(folder) / "dataset.h5" if path is None else path
        generate_file(
            *(file, task, trajectories, frames, seed),
            processes=processes,
            executor=executor,
            progress=progress,
            **limit.rest(),
        )
        return load(file) if path is None else open(path)


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
        generate_file(path, task, trajectories, frames, seed, progress=progress)
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
    executor: Executor | None = None,
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
        executor = _executor(made, len(work.shards()), processes, executor)
        _run(executor or Threads(1), None if executor else made, work)
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

    def shards(self) -> list[Span]:
        """The trajectories that are missing, at most `size` in a row."""
        return [
            (begin, min(begin + self.size, last))
            for first, last in self.folder.missing(self.total)
            for begin in range(first, last, self.size)
        ]

    def advance(self, count: int) -> None:
        """Counts so many more trajectories."""
        self.done += count
        if self.progress is not None:
            self.progress(self.done, self.total)


def _executor(
    task: Task, shards: int, processes: int | None, executor: Executor | None
) -> Executor | None:
    """Where it is done; None for this process."""
    if executor is not None:
        _require_registered(task, "there is an executor")
        return chosen_executor(executor)
    if processes is None:
        processes = core_count("processes", None) if _can_be_made_again(task) else 1
    elif processes > 1:
        _require_registered(task, f"processes is {processes}")
    processes = min(processes, shards)
    return None if processes <= 1 else Processes(processes)


def _run(executor: Executor, task: Task | None, work: _Generation) -> None:
    """On all workers; a shard is written as soon as it comes."""

    def deliver(shards: Sequence[tuple[int, Block]]) -> None:
        for first, block in shards:
            work.folder.add(first, block)
            work.advance(len(block))

    with executor.workers() as workers:
        make = partial(generate_shard, work.request, task)
        for span in list(work.folder.missing(work.total)):  # a shard is of trajectories in a row
            missing = [range(*span)]
            run(workers, make, missing, deliver, work.limit, give_up=_given_up, most=work.size)


def _given_up(index: int, why: str) -> NoReturn:
    raise RuntimeError(
        f"trajectory {index}: {why}; what is done is kept: see what that task does there, or "
        "whether memory is short"
    )


def _join(folder: ShardFolder, request: Request, total: int, limit: Limit) -> int:
    """Makes the file of the shards; returns how many trajectories it has."""
    count = folder.without_gap(total)
    if count == 0:
        limit.require("one trajectory was done")
    files.write(folder.path, request.task, request.parameters, request.seed, folder.blocks(count))
    if count == total:
        folder.remove()
    return count


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
