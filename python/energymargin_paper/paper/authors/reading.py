"""From a folder of published data to datasets, and to the authors' own scores."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Scene, World
from energymargin.base.reprs import short_repr
from energymargin.datasets import Dataset
from energymargin.evaluation import LabelledScores
from energymargin.records.store.file import add_scores as add_run
from energymargin.scenes import moved_apart
from energymargin.tasks.base import Params
from energymargin.tasks.trajectories import Trajectory
from energymargin_paper.paper.authors.folder import (
    SIMULATED,
    Columns,
    of_part,
    read_columns,
    require_same,
)
from energymargin_paper.paper.authors.recorded import CLEARANCE, HEIGHT, PublishedRecorded
from energymargin_paper.paper.authors.task import SimulatedTask, placed

__all__ = [
    "Track",
    "add_scores",
    "dataset",
    "labelled_scores",
    "matched_interval",
    "measured_states",
    "recent_rates",
    "recorded_dataset",
    "recorded_scores",
    "recorded_task",
    "separated",
    "steady",
    "tracks",
]

SOURCE = {"source": "published"}
NAMES = ("num_traj", "data_id")

LEAST, LONGEST = 10, 120  # steps; the longest trajectories have this interval

RATE = 30.0  # frames/s
WINDOW = 0.5  # s, over which velocities are taken: around a frame, or before it
BACK, FARTHEST = 0.0005, 0.03  # m, in which a tool is drawn back at a time, and at most
STARTED = 0.005  # m; a tool that has gone so far moves
HARDLY = 5  # frames; a tool that moves for no longer has hardly begun
LEAST_SPAN = 0.1  # s, for a velocity

# By body, the columns of its tag's pose; tags are turned about an axis that points down.
TAGS = {
    "effector": ("tvec_world_tag_1_y", "tvec_world_tag_1_x", "rvec_world_tag_1_z"),
    "object": ("tvec_world_tag_2_y", "tvec_world_tag_2_x", "rvec_world_tag_2_z"),
}
SIGNS = np.array([1.0, 1.0, -1.0])


def dataset(
    folder: str | os.PathLike[str], part: str, *, notice: Callable[[str], None] | None = None
) -> Dataset:
    """A part of the published data as a dataset: the authors' states and labels.

    The task is at the authors' parameters. A state that cannot be simulated stays as recorded, with
    its labels; `Dataset.possible_problems` tells which are such. `notice` is called with a line of
    text for each recording in which bodies overlapped and were moved apart. Raises OSError, and
    ValueError on an unknown folder or part, and with the file and line that is not as expected.
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
    return add_run(path, dataset, labelled_scores(folder, part).scores, settings=SOURCE)


def _labels(own: Path) -> tuple[Columns, dict[float, bool]]:
    """The labels of the states, and by trajectory whether it succeeded."""
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
    (K, n), nearest to the next recorded one, in the mean of the free bodies' distances.

    States that cannot be simulated do not count.
    """
    scene = task.scene(params)
    bodies = [body.name for body in scene.bodies if body.mass > 0]
    places = [scene.slice(name).start + axis for name in bodies for axis in range(3)]
    steps = range(LEAST, LONGEST + 1)
    distances = np.zeros(len(steps))
    possible = [_makes_problem(task, state, params) for state in states]
    for k in np.flatnonzero(np.array(possible[:-1]) & np.array(possible[1:])):
        state, after = states[k : k + 2]
        plan = task.plan(state, 0.0, params, LONGEST * task.step)
        reached = World(scene, plan).simulate(state, LONGEST, record=list(steps)).states
        away = (reached - after)[:, places].reshape(len(steps), len(bodies), 3)
        distances += np.linalg.norm(away, axis=2).sum(axis=1)
    return (LEAST + int(distances.argmin())) * task.step


def _makes_problem(task: SimulatedTask, state: NDArray[np.float64], params: Params) -> bool:
    try:
        task.problem(state, params)
    except ValueError:
        return False
    return True


@dataclass(frozen=True, eq=False)
class Track:
    """The poses of tool and object in the last K frames of one recording."""

    __repr__ = short_repr

    number: int
    times: NDArray[np.float64]
    """[s], shape (K,)."""
    poses: dict[str, NDArray[np.float64]]
    """Poses of "object" and "effector": x, y [m] and yaw [rad, without jumps], shape (K, 3)."""
    velocities: dict[str, NDArray[np.float64]]
    """As recorded, the differences of noisy poses [m/s, rad/s], shape (K, 3)."""
    captured: NDArray[np.bool_]
    """The authors' labels, shape (K,)."""
    success: bool


def tracks(own: Path) -> list[Track]:
    """The recordings of a combination's folder, in the order of their numbers.

    Raises OSError, and ValueError with the file and line that is not as expected.
    """
    labels = read_columns(own / "labels.csv", ("id", "task_success"))
    success = dict(zip(labels["id"].tolist(), labels["task_success"] > 0, strict=True))
    captured = read_columns(_frame_labels(own), ("traj_id", "data_id", "maneuver_label"))
    found = []
    for number in dict.fromkeys(captured["traj_id"].tolist()):
        if number not in success:
            raise ValueError(f"{own / 'labels.csv'}: lacks recording {number:g}")
        members = captured["traj_id"] == number
        found.append(
            _track(own, int(number), captured["maneuver_label"][members] > 0, success[number])
        )
    return found


def _frame_labels(own: Path) -> Path:
    return own / "maneuver_labels_PlanePushReal.csv"


def _track(own: Path, number: int, captured: NDArray[np.bool_], success: np.bool_) -> Track:
    path = own / f"{number:02}" / "apriltag_results.csv"
    of_poses = [name for names in TAGS.values() for name in names]
    names = ("timestamp_sec", *of_poses, *(f"vel_{name}" for name in of_poses))
    table = read_columns(path, names)
    frames = len(captured)
    if len(table["timestamp_sec"]) < frames:
        raise ValueError(
            f"{path}: has {len(table['timestamp_sec'])} frames, and there are labels of {frames}"
        )
    poses, velocities = {}, {}
    for body, own_names in TAGS.items():
        turned = np.stack([table[name] for name in own_names], axis=1) * SIGNS
        turned[:, 2] = np.unwrap(turned[:, 2])
        poses[body] = turned[-frames:]
        rates = np.stack([table[f"vel_{name}"] for name in own_names], axis=1) * SIGNS
        velocities[body] = rates[-frames:]
    times = table["timestamp_sec"][-frames:]
    return Track(number, times - times[0], poses, velocities, captured, bool(success))


def recorded_dataset(
    folder: Path,
    own: Path,
    notice: Callable[[str], None] | None = None,
    *,
    smoothed: bool = False,
) -> Dataset:
    """The recordings of a combination; `smoothed`: velocities, and with them the labels, are those
    over half a second around each frame, instead of the authors' own."""
    task = recorded_task(folder, own.name)
    scene = task.scene({})
    world = World(scene)
    trajectories = []
    for track in tracks(own):
        rates = {b: _mean_rates(track, b) for b in TAGS} if smoothed else track.velocities
        measured = measured_states(scene, track, rates)
        states = np.stack([separated(world, state) for state in measured])
        moved = int((states != measured).any(axis=1).sum())
        if moved and notice is not None:
            notice(
                f"{own.name}, recording {track.number}: in {moved} of {len(states)} frames bodies "
                "overlapped and were moved apart"
            )
        captured = track.captured
        if smoothed:
            captured = np.asarray(task.captured_throughout({}).contains(scene, measured))
        trajectories.append(
            Trajectory(
                times=track.times,
                states=states,
                contacts=[world.contacts(state) for state in states],
                captured=captured,
                success=track.success,
                params={},
                seed=track.number,
            )
        )
    return Dataset(task.name, task.parameters, 0, trajectories)


def recorded_task(folder: Path, part: str) -> PublishedRecorded:
    """The task of a combination, such as "jaw-pushes-rectangle"."""
    tool, _, object = part.partition("-pushes-")
    return PublishedRecorded(str(folder.resolve()), object, tool)


def recent_rates(track: Track, body: str) -> NDArray[np.float64]:
    """Mean velocities over half a second before each frame, shape (K, 3)."""
    times, poses = track.times, track.poses[body]
    first = np.searchsorted(times, times - WINDOW)
    spans = np.maximum(times - times[first], 1 / RATE)
    return np.asarray((poses - poses[first]) / spans[:, None])


def measured_states(
    scene: Scene, track: Track, rates: Mapping[str, NDArray[np.float64]]
) -> NDArray[np.float64]:
    """The states of the frames, shape (K, n), with these velocities, by body, shape (K, 3)."""
    heights = {"object": HEIGHT / 2, "effector": HEIGHT / 2 + CLEARANCE}
    rows = {body: np.hstack([track.poses[body], rates[body]]) for body in heights}
    frames = range(len(track.times))
    return np.stack(
        [
            scene.pack(**{b: placed(rows[b][k], height) for b, height in heights.items()})
            for k in frames
        ]
    )


def separated(world: World, state: NDArray[np.float64]) -> NDArray[np.float64]:
    """A state, shape (n,), without overlaps.

    Where a tool embraces an object, and no place along the contacts is free, it is drawn back
    against the direction of the push.
    """
    with suppress(ValueError):
        return moved_apart(world, state, ("object", "effector"))
    back = world.scene.slice("effector").start + 1
    drawn = state.copy()
    while world.distance(drawn, "object", "effector") < 0 and drawn[back] < state[back] + FARTHEST:
        drawn[back] += BACK
    return drawn


def _mean_rates(track: Track, body: str) -> NDArray[np.float64]:
    """Mean velocities over WINDOW around each frame, shape (K, 3)."""
    times, poses = track.times, track.poses[body]
    first = np.searchsorted(times, times - WINDOW / 2)
    last = np.searchsorted(times, times + WINDOW / 2, side="right") - 1
    spans = np.maximum(times[last] - times[first], 1 / RATE)
    return np.asarray((poses[last] - poses[first]) / spans[:, None])


def steady(track: Track, frame: int) -> NDArray[np.float64]:
    """The tool's mean velocity since it began to move, or over half a second where it has hardly
    begun, [m/s, rad/s], shape (3,): what is known at the frame, and nothing of later ones."""
    poses, times = track.poses["effector"], track.times
    away = np.linalg.norm(poses[: frame + 1, :2] - poses[0, :2], axis=1)
    moved = np.flatnonzero(away > STARTED)
    half = int(WINDOW * RATE)
    first = int(moved[0]) if len(moved) and moved[0] < frame - HARDLY else max(0, frame - half)
    span = max(times[frame] - times[first], LEAST_SPAN)
    return np.asarray((poses[frame] - poses[first]) / span)


def recorded_scores(own: Path) -> LabelledScores:
    """The authors' own scores of a combination, with their labels."""
    path = own / "ao_est.csv"
    scores = read_columns(path, ("traj_id", "success_metric", "maneuverability_metric"))
    labels = read_columns(_frame_labels(own), ("traj_id", "maneuver_label"))
    require_same(path, "recording", scores["traj_id"], labels["traj_id"])
    success = {track.number: track.success for track in tracks(own)}
    numbers = scores["traj_id"].astype(np.int64)
    return LabelledScores(
        task="published-recorded",
        trajectory=numbers,
        captured=labels["maneuver_label"] > 0,
        success=np.array([success[number] for number in numbers.tolist()]),
        scores={
            "capture": scores["maneuverability_metric"],
            "success": scores["success_metric"],
        },
    )
