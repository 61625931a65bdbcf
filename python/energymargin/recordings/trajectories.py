"""From recordings to a dataset, which is scored, evaluated and exported as any other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Region, Scene, World
from energymargin.datasets import Dataset
from energymargin.recordings.recording import MOST_OVERLAP, Placed, Recording, placed
from energymargin.tasks.base import Params, Regions, Task, parameters_of
from energymargin.trajectories import Trajectory

__all__ = ["RecordedTask", "dataset"]


class RecordedTask(Task, Protocol):
    """What a task needs beside, for recordings to be scored; each ScriptedTask has it."""

    def scene(self, params: Params) -> Scene:
        """The scene in which the bodies were recorded."""
        ...

    def captured(self, state: NDArray[np.float64], params: Params) -> Regions:
        """Z_cap(z) of a state, shape (n,); of one object."""
        ...


def dataset(
    task: str | Task,
    recordings: Sequence[Recording],
    labels: Mapping[str, bool],
    *,
    captured: Mapping[str, Mapping[int, bool]] | None = None,
    params: Params | None = None,
    object: str = "object",
    effector: str = "effector",
    part: bool = True,
    most_overlap: float = MOST_OVERLAP,
    notice: Callable[[str], None] | None = None,
) -> Dataset:
    """Recordings as trajectories of a task, in their order; a trajectory's seed is its number.

    `task`: a name, or a task from `tasks.make`; it has to be a RecordedTask. `labels`: whether each
    ended well, by its name (`read_labels`). `captured`: whether the object was captured in each
    frame (`read_frame_labels`); a frame that was missing is as the one before. If not given, a
    state is captured that lies in the task's own capture set. `params`: what the
    task draws for a trajectory, as its friction; by default its parameters that are numbers.
    `object`, `effector`, `part` and `most_overlap`: as of `placed`; `notice` is told of each
    recording in which bodies were moved. The contacts are those that the scene has at each state.

    Raises ValueError on labels that lack a recording or name another one, and all that `placed`
    does.
    """
    made = _made(task)
    given = _numbers(made) if params is None else dict(params)
    names = [recording.name for recording in recordings]
    _require_same("labels", names, labels)
    if captured is not None:
        _require_same("captured", names, captured)
    scene = _scene(made, given)
    world = World(scene)
    trajectories = []
    for number, recording in enumerate(recordings):
        found = placed(recording, scene, object, effector, part=part, most_overlap=most_overlap)
        if found.moved.any() and notice is not None:
            notice(f"{recording.name}: {_moved(found)}")
        states = found.states
        trajectories.append(
            Trajectory(
                times=recording.times,
                states=states,
                contacts=[world.contacts(state) for state in states],
                captured=_in_capture_set(made, scene, states, given)
                if captured is None
                else _labels(recording, captured[recording.name]),
                success=labels[recording.name],
                params=given,
                seed=number,
            )
        )
    return Dataset(made.name, parameters_of(made), 0, trajectories)


def _moved(found: Placed) -> str:
    frames = int(found.moved.any(axis=1).sum())
    return (
        f"in {frames} of {len(found.states)} frames bodies overlapped and were moved apart, by at "
        f"most {1e3 * found.moved.max():.2g} mm"
    )


def _made(task: str | Task) -> RecordedTask:
    made = tasks.make(task) if isinstance(task, str) else task
    for method in ("scene", "captured"):
        if not callable(getattr(made, method, None)):
            raise ValueError(f"task {made.name!r} has no {method}(), which recordings need")
    return cast(RecordedTask, made)


def _numbers(task: RecordedTask) -> dict[str, float]:
    """The task's parameters that are numbers."""
    return {
        name: float(value)
        for name, value in parameters_of(task).items()
        if isinstance(value, (int, float)) and not isinstance(value, bool)
    }


def _scene(task: RecordedTask, params: Params) -> Scene:
    try:
        return task.scene(params)
    except KeyError as error:
        raise ValueError(
            f"task {task.name!r} draws its {error.args[0]} for each trajectory: give the one of "
            f"these recordings, as -p {error.args[0]}=0.3"
        ) from error


def _in_capture_set(
    task: RecordedTask, scene: Scene, states: NDArray[np.float64], params: Params
) -> NDArray[np.bool_]:
    inside = np.zeros(len(states), dtype=bool)
    for k, state in enumerate(states):
        region = task.captured(state, params)
        if not isinstance(region, Region):
            raise ValueError(f"task {task.name!r} has several objects, expected one")
        inside[k] = bool(region.contains(scene, state))
    return inside


def _labels(recording: Recording, captured: Mapping[int, bool]) -> NDArray[np.bool_]:
    """Of each frame; one that was missing in the file is as the one before."""
    numbers = recording.frames.tolist()
    labels = np.zeros(len(numbers), dtype=bool)
    for k, number in enumerate(numbers):
        if number in captured:
            labels[k] = captured[number]
        elif number in recording.mended.missing:
            labels[k] = labels[k - 1]
        else:
            raise ValueError(f"captured lacks frame {number} of {recording.name!r}")
    unknown = sorted(set(captured) - set(numbers) - set(recording.mended.left_out))
    if unknown:
        raise ValueError(f"captured has frame {unknown[0]} of {recording.name!r}, which it has not")
    return labels


def _require_same(what: str, names: Sequence[str], given: Mapping[str, object]) -> None:
    """Raises ValueError unless each recording is named once."""
    if not names:
        raise ValueError("recordings is empty, expected one at least")
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two recordings are named {name!r}, expected names of their own")
        if name not in given:
            raise ValueError(f"{what} lacks {name!r}")
    others = [name for name in given if name not in names]
    if others:
        raise ValueError(f"{what} names {others[0]!r}, which is none of the recordings")
