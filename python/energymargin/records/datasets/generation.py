"""Random trajectories of a task, in memory or in a file.

A file of any size is made in shards by any number of workers. Each shard is on disk as soon as it
is done, so that the next run goes on where one ended. The file is the same to the byte, whoever
made which shard.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from energymargin import tasks
from energymargin._core import Cancel
from energymargin.base.checks import core_count, whole_number
from energymargin.base.limits import Limit
from energymargin.evaluate.asking import Pairs, ask
from energymargin.evaluate.executors.choice import Executor
from energymargin.evaluate.executors.processes import Processes
from energymargin.evaluate.executors.threads import Threads
from energymargin.records.datasets import files
from energymargin.records.datasets.columns import Block
from energymargin.records.datasets.dataset import Dataset, load, open
from energymargin.records.datasets.shards import (
    Parts,
    Request,
    Span,
    generate_shard,
    opened_parts,
)
from energymargin.tasks.base import Task, parameters_of
from energymargin.tasks.registry import is_installed

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

    With a `path`, trajectories that are done wait in a store beside the file until it is whole.
    After Ctrl-C, a kill, a full disk or a timeout the same call goes on from there.

    Raises ValueError on an unknown task, numbers out of range, a task that workers cannot make, or
    a store with shards of another dataset; TimeoutError or Cancelled if not even one trajectory is
    done; RuntimeError if a few trajectories end one worker after the other; OSError if the file
    cannot be written.
    """
    limit = Limit(timeout, cancel)
    made = tasks.make(task) if isinstance(task, str) else task
    total = whole_number("trajectories", trajectories, 1)
    core_count("processes", processes)
    request = Request.of(made, frames, seed)
    whole_number("frames", frames, 1)
    with TemporaryDirectory() as temporary:
        file = Path(temporary, "dataset.h5") if path is None else Path(path)
        with opened_parts(file, request) as parts:
            chosen = _executor(made, request, parts.missing(total), processes, executor)
            _make_missing(parts, made, chosen, total=total, limit=limit, progress=progress)
            still_missing = parts.missing(total)
            count = still_missing[0][0] if still_missing else total
            if count == 0:
                limit.require("one trajectory was done")
            whole = parts.trajectories(count)
            files.write(file, request.task, request.parameters, request.seed, whole)
            if count == total:
                parts.forget()
        return load(file) if path is None else open(file)


def _make_missing(
    parts: Parts,
    task: Task,
    executor: Executor | None,
    *,
    total: int,
    limit: Limit,
    progress: Progress | None,
) -> None:
    """Makes the trajectories that are in no shard; an executor of None is this process."""
    size = parts.request.most
    missing = parts.missing(total)
    done = total - sum(last - first for first, last in missing)
    if done and progress is not None:
        progress(done, total)

    def keep(shards: Pairs[int, Block | None]) -> None:
        for first, block in shards:  # written as soon as they come
            if block is not None:
                parts.add(first, block)

    ask(
        (
            range(k, min(k + size, last))
            for first, last in missing
            for k in range(first, last, size)
        ),
        *(partial(generate_shard, parts.request, task if executor is None else None), keep),
        most=size,
        total=total,
        progress=progress and (lambda now, _: progress(done + now, total)),
        executor=executor or Threads(1),
        **limit.rest(),
    )


def _executor(
    task: Task,
    request: Request,
    missing: list[Span],
    processes: int | None,
    executor: Executor | None,
) -> Executor | None:
    """Where the missing trajectories are made; None: in this process."""
    if executor is not None:
        if processes not in (None, 1):
            raise ValueError(f"processes is {processes}, expected 1 or None with an executor")
        _require_registered(task, "there is an executor")
        return executor
    if processes is None:
        processes = core_count("processes", None) if _can_be_made_again(task) else 1
    elif processes > 1:
        _require_registered(task, f"processes is {processes}")
    processes = min(processes, sum(-(-(last - first) // request.most) for first, last in missing))
    return None if processes <= 1 else Processes(processes)


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
