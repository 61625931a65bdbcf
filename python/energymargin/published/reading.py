"""From a folder of published data to datasets, and to the authors' own scores."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import World
from energymargin.datasets import Dataset
from energymargin.evaluation import LabelledScores
from energymargin.published.folder import SIMULATED, Columns, of_part, read_columns, require_same
from energymargin.published.recordings import recorded_dataset, recorded_scores
from energymargin.published.task import SimulatedTask
from energymargin.store.given import add_scores as add_run
from energymargin.tasks.base import Params
from energymargin.trajectories import Trajectory

__all__ = ["add_scores", "dataset", "labelled_scores", "matched_interval"]

SOURCE = {"source": "published"}
NAMES = ("num_traj", "data_id")

LEAST, LONGEST = 10, 120  # steps; the longest trajectories have this interval


def dataset(
    folder: str | os.PathLike[str], part: str, *, notice: Callable[[str], None] | None = None
) -> Dataset:
    """A part of the published data as a dataset: the authors' states and labels.

    The task is at the authors' parameters. `notice` is told of bodies that overlapped in a
    recording and were moved apart. Raises OSError, and ValueError on a folder or part that is none,
    with the file and line that is not as expected.
    """
    own = of_part(folder, part)
    if part not in SIMULATED:
        return recorded_dataset(Path(folder), own, notice)
    return _simulated(own, simulated_task(folder, part))


def simulated_task(folder: str | os.PathLike[str], part: str) -> SimulatedTask:
    """The task of a simulated part."""
    parameters = {"data": str(Path(folder).resolve())} if part == "grasp" else {}
    task = tasks.make(f"published-{part}", **parameters)
    assert isinstance(task, SimulatedTask)  # those of this package are
    return task


def labelled_scores(folder: str | os.PathLike[str], part: str) -> LabelledScores:
    """The authors' own scores of a part, with their labels: capture, success and, of simulated
    data, effort/est and effort/rrt. Errors as `dataset`.

    An effort of inf is one that their search did not find.
    """
    own = of_part(folder, part)
    if part not in SIMULATED:
        return recorded_scores(own)
    labels, success = _labels(own)
    scores = read_columns(own / "prob-aoest.csv", ("maneuverability_metric", "success_metric"))
    found = {"capture": scores["maneuverability_metric"], "success": scores["success_metric"]}
    for planner in ("est", "rrt"):
        path = own / f"effort-ao{planner}.csv"
        found[f"effort/{planner}"] = read_columns(path, ("best_cost",))["best_cost"]
    for name, values in found.items():
        if len(values) != len(labels["num_traj"]):
            raise ValueError(
                f"{own}: there are {len(values)} scores of {name}, and "
                f"{len(labels['num_traj'])} labels, expected one a state"
            )
    return LabelledScores(
        task=f"published-{part}",
        trajectory=labels["num_traj"].astype(np.int64),
        captured=labels["label"] > 0,
        success=np.array([success[number] for number in labels["num_traj"].tolist()]),
        scores=found,
    )


def add_scores(
    path: str | os.PathLike[str], folder: str | os.PathLike[str], dataset: Dataset, part: str
) -> int:
    """Puts the authors' own scores of a part into the store at `path`, as a run of the `dataset` of
    that part; returns the run's number. Errors as `labelled_scores` and ScoreStore."""
    return add_run(path, dataset, labelled_scores(folder, part).scores, SOURCE)


def _labels(own: Path) -> tuple[Columns, dict[float, bool]]:
    """Of the states, and by trajectory whether it succeeded."""
    labels = read_columns(own / "maneuver_labels.csv", (*NAMES, "label"))
    success = read_columns(own / "success_labels.csv", ("num_traj", "label"))
    by_trajectory = dict(zip(success["num_traj"].tolist(), success["label"] > 0, strict=True))
    lacking = set(labels["num_traj"].tolist()) - set(by_trajectory)
    if lacking:
        raise ValueError(f"{own / 'success_labels.csv'}: lacks trajectory {min(lacking):g}")
    return labels, {number: bool(label) for number, label in by_trajectory.items()}


def _simulated(own: Path, task: SimulatedTask) -> Dataset:
    rows = read_columns(own / "viapoints.csv", (*NAMES, *task.columns))
    drawn = read_columns(own / "maneuver_labels.csv", (*NAMES, *task.drawn.values()))
    labels, success = _labels(own)
    for name in NAMES:
        what = "trajectory" if name == "num_traj" else "frame"
        require_same(own / "maneuver_labels.csv", what, labels[name], rows[name])
    numbers = rows["num_traj"]
    values = np.stack([rows[name] for name in task.columns], axis=1)
    starts = np.flatnonzero(np.diff(numbers)) + 1
    trajectories = []
    for members in np.split(np.arange(len(numbers)), starts):
        number = float(numbers[members[0]])
        params = {name: float(drawn[column][members[0]]) for name, column in task.drawn.items()}
        trajectories.append(
            _trajectory(
                task,
                values[members],
                labels["label"][members] > 0,
                params,
                success=success[number],
                number=int(number),
            )
        )
    return Dataset(task.name, task.parameters, 0, trajectories)


def _trajectory(
    task: SimulatedTask,
    rows: NDArray[np.float64],
    captured: NDArray[np.bool_],
    params: dict[str, float],
    *,
    success: bool,
    number: int,
) -> Trajectory:
    scene = task.scene(params)
    world = World(scene)
    states = np.stack([task.separated(world, task.state(scene, row)) for row in rows])
    interval = task.interval or matched_interval(task, params, states)
    return Trajectory(
        times=interval * np.arange(len(states), dtype=np.float64),
        states=states,
        contacts=[world.contacts(state) for state in states],
        captured=captured,
        success=success,
        params=params,
        seed=number,
    )


def matched_interval(task: SimulatedTask, params: Params, states: NDArray[np.float64]) -> float:
    """The interval [s], in whole steps, after which the script's mean brings each state, shape
    (K, n), nearest to the next recorded one, in the mean of the free bodies' distances."""
    scene = task.scene(params)
    bodies = [body.name for body in scene.bodies if body.mass > 0]
    places = [scene.slice(name).start + axis for name in bodies for axis in range(3)]
    steps = range(LEAST, LONGEST + 1)
    distances = np.zeros(len(steps))
    for state, after in pairwise(states):
        plan = task.plan(state, 0.0, params, LONGEST * task.step)
        reached = World(scene, plan).simulate(state, LONGEST, record=list(steps)).states
        away = (reached - after)[:, places].reshape(len(steps), len(bodies), 3)
        distances += np.linalg.norm(away, axis=2).sum(axis=1)
    return (LEAST + int(distances.argmin())) * task.step
