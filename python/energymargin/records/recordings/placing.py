"""Recordings in a scene: their frames as states without overlaps, and with labels as a dataset that
is scored and evaluated as any other."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np

from energymargin import Scene, World, tasks
from energymargin.base.aliases import Floats, Mask
from energymargin.base.checks import positive_number
from energymargin.base.reprs import Record
from energymargin.datasets import Dataset
from energymargin.records.recordings.poses import planar
from energymargin.records.recordings.recording import Motion, Recording
from energymargin.scenes import moved_apart
from energymargin.tasks import Params, Regions, Task, Trajectory, inside, parameters_of

MOST_OVERLAP = 0.01  # m; an arm's error of 5 to 8 mm, and a camera's
UPRIGHT = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Placed(Record):
    """K frames of a recording of B bodies in a scene."""

    states: Floats
    """State vector of each frame, shape (K, n)."""
    moved: Floats
    """Distances by which the bodies were moved out of an overlap [m], shape (K, B), in the order of
    the recording, tools last: of object and effector."""
    stuck: Mask
    """Frames as measured, whose bodies overlap wherever they are moved to, shape (K,)."""


def placed(
    recording: Recording,
    scene: Scene,
    *,
    object: str = "object",
    effector: str = "effector",
    most_overlap: float = MOST_OVERLAP,
) -> Placed:
    """The recording's frames as states of a scene.

    Poses and velocities are those of the recording, and all else is that of the scene, as the
    height of a body that moves in the plane. `object` and `effector` are what these bodies of the
    recording are called in the scene; other bodies have the same names in both. Bodies that overlap
    are moved until they touch: each out of what stands in the scene and of those before it, tools
    last; along the ground alone, if all bodies move in the plane. Raises ValueError on a body that
    is unknown, fixed or a link, on one that is tilted in the scene and moves in the plane, where a
    body would be moved by more than `most_overlap` [m], and if no frame at all has a place for all,
    as between two others.
    """
    most_overlap = positive_number("most_overlap", most_overlap)
    heights = {body.name: body.position[2] for body in scene.bodies}
    tools = {effector, *(body.name for body in scene.bodies if body.role == "effector")}
    motions = recording.in_scene(object, effector)
    _require_bodies(recording, scene, {"object": object, "effector": effector})
    names = sorted(motions, key=tools.__contains__)
    starts = [scene.slice(name).start for name in names]
    in_plane = [_moves_in_plane(scene, name, motions[name]) for name in names]
    ways = (1.0, 1.0, 0.0 if all(in_plane) else 1.0)
    world, states, reasons = World(scene), np.empty((len(recording), scene.dimension)), {}
    for k in range(len(recording)):
        poses = {name: motion.at(k, heights[name]) for name, motion in motions.items()}
        states[k] = scene.pack(**poses)
    measured = states.copy()
    for k, number in enumerate(recording.frames.tolist()):
        try:
            states[k] = moved_apart(world, measured[k], names, directions=ways)
        except ValueError as error:
            reasons[k] = f"{recording.name}, frame {number}: {error}"
    if len(reasons) == len(recording):
        raise ValueError(f"{reasons[0]}; so it is in every frame: do the shapes fit?")
    stuck = np.isin(np.arange(len(recording)), list(reasons))
    apart = [(states - measured)[:, start : start + 3] for start in starts]
    moved = np.linalg.norm(np.stack(apart, axis=1), axis=2)
    if moved.max() > most_overlap:
        k, body = divmod(int((moved > most_overlap).argmax()), len(names))
        raise ValueError(
            f"{recording.name}, frame {recording.frames[k]}: {names[body]!r} overlaps others by "
            f"{moved[k, body]:.3g} m, expected at most most_overlap = {most_overlap:g} m: do the "
            "shapes, the units and the origin of the camera's frame fit?"
        )
    return Placed(states, moved, stuck)


def _require_bodies(recording: Recording, scene: Scene, given: dict[str, str]) -> None:
    """Raises ValueError on a body that the scene does not have, with the way out."""
    known = ", ".join(body.name for body in scene.bodies)
    for body in recording.bodies:
        name = given.get(body, body)
        if name not in [one.name for one in scene.bodies]:
            way = f"{body}=NAME says how it is called there" if body in given else "rename one"
            text = f"{recording.name} has the body {body!r}, and the scene has no {name!r}"
            raise ValueError(f"{text}: {way}, one of {known}")


def _moves_in_plane(scene: Scene, name: str, motion: Motion) -> bool:
    """Whether a body moves in the plane; ValueError if it does, and is tilted in the scene."""
    start = scene.slice(name).start
    if planar(motion.poses) and math.hypot(*scene.pack()[start + 3 : start + 5]) > UPRIGHT:
        text = f"body {name!r} is tilted in the scene, expected one that is turned about z alone"
        raise ValueError(text)
    return planar(motion.poses)


class RecordedTask(Task, Protocol):
    """What a task needs in addition, for recordings to be scored; each ScriptedTask has it."""

    def scene(self, params: Params) -> Scene:
        """The scene in which the bodies were recorded."""
        ...

    def captured(self, state: Floats, params: Params) -> Regions:
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
    world, names = World(scene), {"object": object, "effector": effector}
    trajectories = []
    for number, recording in enumerate(recordings):
        in_scene = placed(recording, scene, **names, most_overlap=most_overlap)
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


def _inside(scene: Scene, sets: Sequence[Regions], states: Floats) -> tuple[Mask, Mask | None]:
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
            text = f"task {made.name!r} has no {method}(), which recordings{without} need"
            raise ValueError(text)
    return cast(RecordedTask, made)


def _numbers(task: RecordedTask) -> dict[str, float]:
    """The task's parameters that are numbers."""
    given = parameters_of(task).items()
    plain = ((n, v) for n, v in given if isinstance(v, (int, float)))
    return {name: float(value) for name, value in plain if not isinstance(value, bool)}


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
    many = f"in {in_scene.moved.any(axis=1).sum()} of {len(in_scene.states)} frames"
    far = f"by at most {1e3 * in_scene.moved.max():.2g} mm"
    stuck = f"{in_scene.stuck.sum()} found no place and stay as measured"
    return f"{many} bodies overlapped and were moved apart, {far}; {stuck}"


def _frame_labels(recording: Recording, captured: Mapping[int, bool]) -> Mask:
    """The label of each frame; one that was missing in the file has that of the one before."""
    labels: list[bool] = []
    for number in recording.frames.tolist():
        if number not in captured and number not in recording.repairs.missing:
            raise ValueError(f"captured lacks frame {number} of {recording.name!r}")
        labels.append(captured[number] if number in captured else labels[-1])
    return np.array(labels)
