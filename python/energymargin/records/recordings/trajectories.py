"""Recordings and their labels as a dataset, which is scored and evaluated as any other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from energymargin import Scene, World, tasks
from energymargin.datasets import Dataset
from energymargin.records.recordings.placing import MOST_OVERLAP, Placed, placed
from energymargin.records.recordings.recording import Recording
from energymargin.tasks import Params, Regions, Task, Trajectory, inside, parameters_of


class RecordedTask(Task, Protocol):
    """What a task needs in addition, for recordings to be scored; each ScriptedTask has it."""

    def scene(self, params: Params) -> Scene:
        """The scene in which the bodies were recorded."""
        ...

    def captured(self, state: NDArray[np.float64], params: Params) -> Regions:
        """Z_cap(z) of a state, shape (n,), or that of each object."""
        ...

    def succeeded(self, params: Params) -> Regions:
        """Z_suc, or that of each object. Recordings with labels do without."""
        ...


def dataset(
    task: str | Task,
    recordings: Sequence[Recording],
    labels: Mapping[str, bool] | None = None,
    *,
    captured: Mapping[str, Mapping[int, bool]] | None = None,
    params: Params | None = None,
    object: str = "object",
    effector: str = "effector",
    most_overlap: float = MOST_OVERLAP,
    notice: Callable[[str], None] | None = None,
) -> Dataset:
    """Recordings as trajectories of a task, in their order; a trajectory's seed is its number.

    The contacts are those that the scene has at each state.

    Args:
        task: a name, or a task from `tasks.make`; it has to be a RecordedTask.
        recordings: as `read_csv` gives them.
        labels: by recording, whether it succeeded (`read_labels`). None: one succeeded whose last
            state lies in the task's own success set.
        captured: by recording and frame, whether the object was captured (`read_frame_labels`); a
            frame that was missing has the label of the one before. None: a state is captured that
            lies in the task's own capture set.
        params: what the task draws for a trajectory, as its friction; None: the task's parameters
            that are numbers.
        object: the name of the recordings' body "object" in the scene.
        effector: the same of "effector"; all other bodies have the names of the scene.
        most_overlap: as of `placed` [m].
        notice: called with a line of text for each recording in which bodies were moved, or found
            no place.

    Raises ValueError on labels that lack a recording, and all that `placed` does.
    """
    made = _recorded_task(task, labelled=labels is not None)
    given = _numbers(made) if params is None else dict(params)
    _require_names([recording.name for recording in recordings], labels, captured)
    scene = _scene(made, given)
    world = World(scene)
    trajectories = []
    for number, recording in enumerate(recordings):
        in_scene = placed(
            recording, scene, object=object, effector=effector, most_overlap=most_overlap
        )
        if notice is not None and (in_scene.moved.any() or in_scene.stuck.any()):
            notice(f"{recording.name}: {_overlaps(in_scene)}")
        states, some, any_end = in_scene.states, None, None
        if captured is None:
            now, some = _inside(scene, [made.captured(s, given) for s in states], states)
        else:
            now = _frame_labels(recording, captured[recording.name])
        if labels is None:
            end, ends = _inside(scene, [made.succeeded(given)], states[-1:])
            success, any_end = bool(end[0]), None if ends is None else bool(ends[0])
        else:
            success = labels[recording.name]
        touching, drawn = [world.contacts(state) for state in states], (given, number)
        one = Trajectory(recording.times, states, touching, now, success, *drawn, some, any_end)
        trajectories.append(one)
    return Dataset(made.name, parameters_of(made), 0, trajectories)


def _inside(
    scene: Scene, sets: Sequence[Regions], states: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_] | None]:
    """Whether all objects are in their sets, of each state, shape (K,), and whether any of several
    is; None of one set for all."""
    each = [inside(own, scene, state) for own, state in zip(sets, states, strict=True)]
    some = np.array([own.any() for own in each]) if isinstance(sets[0], dict) else None
    return np.array([own.all() for own in each]), some


def _recorded_task(task: str | Task, *, labelled: bool) -> RecordedTask:
    made = tasks.make(task) if isinstance(task, str) else task
    for method in ("scene", "captured", *(() if labelled else ("succeeded",))):
        if not callable(getattr(made, method, None)):
            without = "" if labelled else " without labels"
            raise ValueError(
                f"task {made.name!r} has no {method}(), which recordings{without} need"
            )
    return cast(RecordedTask, made)


def _numbers(task: RecordedTask) -> dict[str, float]:
    """The task's parameters that are numbers."""
    given = parameters_of(task).items()
    known = {name: v for name, v in given if isinstance(v, (int, float))}
    return {name: float(v) for name, v in known.items() if not isinstance(v, bool)}


def _require_names(names: Sequence[str], *labels: Mapping[str, Any] | None) -> None:
    """Raises ValueError unless there are some, and each has a name and labels of its own."""
    if not names:
        raise ValueError("recordings is empty, expected one at least")
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two recordings are named {name!r}, expected names of their own")
        if any(given is not None and name not in given for given in labels):
            raise ValueError(f"labels or captured lacks {name!r}, expected each recording")


def _scene(task: RecordedTask, params: Params) -> Scene:
    try:
        return task.scene(params)
    except KeyError as error:
        raise ValueError(
            f"task {task.name!r} draws its {error.args[0]} for each trajectory: give the one of "
            f"these recordings, as -p {error.args[0]}=0.3"
        ) from error


def _overlaps(in_scene: Placed) -> str:
    """How many frames were moved apart, and how many found no place."""
    return (
        f"in {in_scene.moved.any(axis=1).sum()} of {len(in_scene.states)} frames bodies overlapped "
        f"and were moved apart, by at most {1e3 * in_scene.moved.max():.2g} mm; "
        f"{in_scene.stuck.sum()} found no place and stay as measured"
    )


def _frame_labels(recording: Recording, captured: Mapping[int, bool]) -> NDArray[np.bool_]:
    """The label of each frame; one that was missing in the file has that of the one before."""
    labels: list[bool] = []
    for number in recording.frames.tolist():
        if number not in captured and number not in recording.repairs.missing:
            raise ValueError(f"captured lacks frame {number} of {recording.name!r}")
        labels.append(captured[number] if number in captured else labels[-1])
    return np.array(labels)
