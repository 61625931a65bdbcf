"""Random trajectories of a task, in memory."""

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
from energymargin.datasets.loading import load
from energymargin.datasets.rollouts import Request, generate_trajectory
from energymargin.limits import Limit
from energymargin.tasks.base import Task, parameters_of

__all__ = ["generate", "load_or_generate"]


def generate(
    task: str | Task,
    trajectories: int = 50,
    frames: int = 10,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    *,
    processes: int | None = 1,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Dataset:
    """Rolls out `trajectories` random trajectories of `frames` frames each.

    `task` is a name, or a task from `tasks.make`. Trajectory i is the same for any number of
    trajectories and of `processes`, which are those of `generate_file`. `progress(done, total)` is
    called after each, or each few.

    After `timeout` [s], or once `cancel` is set, the dataset has the first trajectories, those that
    are done; a task that is no ScriptedTask is asked in between them alone. Raises ValueError on an
    unknown task or numbers out of range; TimeoutError or Cancelled if not even one is done.
    """
    limit = Limit(timeout, cancel)
    made = tasks.make(task) if isinstance(task, str) else task
    trajectories = whole_number("trajectories", trajectories, 1)
    if processes != 1:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "dataset.h5"
            generate_file(
                *(path, made, trajectories, frames, seed),
                processes=processes,
                progress=progress,
                **limit.rest(),
            )
            return load(path)
    request = Request.of(made, frames, seed)
    recorded = []
    for index in range(trajectories):
        try:
            limit.require("one trajectory was done")
            recorded.append(generate_trajectory(made, request, index, limit))
        except (TimeoutError, Cancelled):
            if recorded and limit.reached:
                break
            raise
        if progress is not None:
            progress(index + 1, trajectories)
    return Dataset(made.name, request.parameters, request.seed, recorded)


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
        dataset = generate(task, trajectories, frames, seed, progress)
        dataset.save(path)
        return dataset
    dataset = load(path)
    found = (dataset.task, dataset.parameters, dataset.seed, dataset.lengths.tolist())
    if found != (task.name, parameters_of(task), seed, [frames] * trajectories):
        raise ValueError(f"{path} holds other trajectories: remove it, or choose another folder")
    return dataset
