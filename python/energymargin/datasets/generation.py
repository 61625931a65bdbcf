"""Random trajectories of a task."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from energymargin import tasks
from energymargin._core import Cancel, Cancelled
from energymargin.checks import whole_number
from energymargin.datasets.dataset import Dataset
from energymargin.datasets.generation_to_file import generate_file
from energymargin.datasets.loading import load, open
from energymargin.datasets.rollouts import Request, generate_trajectory
from energymargin.deprecations import once_positional
from energymargin.executors.jobs import Pool
from energymargin.limits import Limit
from energymargin.tasks.base import Task, parameters_of
from energymargin.trajectories import Trajectory

__all__ = ["generate", "load_or_generate"]

MADE = "dataset.h5"  # by workers, to be read into memory


@once_positional("trajectories", "frames", "seed", "progress", after=1)
def generate(
    task: str | Task,
    *,
    path: str | os.PathLike[str] | None = None,
    trajectories: int = 50,
    frames: int = 10,
    seed: int = 0,
    processes: int | None = 1,
    pool: Pool | None = None,
    progress: Callable[[int, int], None] | None = None,
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

    With a `path` what is done is kept in a folder beside the file until the file is whole. After
    Ctrl-C, a kill, a full disk or a timeout the same call goes on from there.

    Raises ValueError on an unknown task, numbers out of range, a task that workers cannot make, or
    a folder with parts of another dataset; TimeoutError or Cancelled if not even one trajectory is
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
            *(path or Path(folder) / MADE, made, trajectories, frames, seed),
            processes=processes,
            pool=pool,
            progress=progress,
            **limit.rest(),
        )
        return load(Path(folder) / MADE) if path is None else open(path)


def _in_memory(
    task: Task,
    request: Request,
    trajectories: int,
    limit: Limit,
    progress: Callable[[int, int], None] | None,
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
    progress: Callable[[int, int], None] | None = None,
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
