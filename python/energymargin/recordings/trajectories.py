"""Recordings and their labels as a dataset, which is scored and evaluated as any other."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Region, Scene, World
from energymargin.datasets import Dataset
from energymargin.recordings.csv_files import SourceFile, lines_of
from energymargin.recordings.recording import MOST_OVERLAP, Placed, Recording, placed
from energymargin.tasks.base import Params, Regions, Task, parameters_of
from energymargin.trajectories import Trajectory

__all__ = ["RecordedTask", "dataset", "read_frame_labels", "read_labels"]


MOST_DIGITS = 15  # of a frame's number
WORDS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}


class RecordedTask(Task, Protocol):
    """What a task needs in addition, for recordings to be scored; each ScriptedTask has it."""

    def scene(self, params: Params) -> Scene:
        """The scene in which the bodies were recorded."""
        ...

    def captured(self, state: NDArray[np.float64], params: Params) -> Regions:
        """Z_cap(z) of a state, shape (n,); of one object."""
        ...

    def succeeded(self, params: Params) -> Regions:
        """Z_suc; of one object. Recordings with labels do without."""
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
    part: bool = True,
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
        object: its body in the scene.
        effector: the same.
        part: as of `placed`.
        most_overlap: as of `placed` [m].
        notice: called with a line of text for each recording in which bodies were moved, or found
            no place.

    Raises ValueError on labels that lack a recording or name another one, and all that `placed`
    does.
    """
    made = _made(task)
    given = _numbers(made) if params is None else dict(params)
    names = [recording.name for recording in recordings]
    _require_recordings(names)
    if labels is not None:
        _require_same("labels", names, labels)
    if captured is not None:
        _require_same("captured", names, captured)
    scene = _scene(made, given)
    world = World(scene)
    trajectories = []
    for number, recording in enumerate(recordings):
        in_scene = placed(
            recording,
            scene,
            object=object,
            effector=effector,
            part=part,
            most_overlap=most_overlap,
        )
        if notice is not None:
            for text in _overlaps(in_scene):
                notice(f"{recording.name}: {text}")
        states = in_scene.states
        trajectories.append(
            Trajectory(
                times=recording.times,
                states=states,
                contacts=[world.contacts(state) for state in states],
                captured=_in_capture_set(made, scene, states, given)
                if captured is None
                else _labels(recording, captured[recording.name]),
                success=_in_success_set(made, scene, states[-1], given)
                if labels is None
                else labels[recording.name],
                params=given,
                seed=number,
            )
        )
    return Dataset(made.name, parameters_of(made), 0, trajectories)


def _overlaps(in_scene: Placed) -> Iterator[str]:
    """Yields a text for frames that were moved apart, and one for those that found no place."""
    frames, stuck = len(in_scene.states), int(in_scene.stuck.sum())
    if in_scene.moved.any():
        yield (
            f"in {in_scene.moved.any(axis=1).sum()} of {frames} frames bodies overlapped and were "
            f"moved apart, by at most {1e3 * in_scene.moved.max():.2g} mm"
        )
    if stuck:
        yield (
            f"in {stuck} of {frames} frames bodies overlap wherever they are moved to, and stay as "
            "measured"
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
    sets = [_of_one_object(task, task.captured(state, params)) for state in states]
    inside = [region.contains(scene, state) for region, state in zip(sets, states, strict=True)]
    return np.array(inside, dtype=bool)


def _in_success_set(
    task: RecordedTask, scene: Scene, state: NDArray[np.float64], params: Params
) -> bool:
    if not callable(getattr(task, "succeeded", None)):
        raise ValueError(
            f"labels is None, and task {task.name!r} has no succeeded(), expected one of them"
        )
    return bool(_of_one_object(task, task.succeeded(params)).contains(scene, state))


def _of_one_object(task: RecordedTask, sets: Regions) -> Region:
    if not isinstance(sets, Region):
        raise ValueError(f"task {task.name!r} has several objects, expected one")
    return sets


def _labels(recording: Recording, captured: Mapping[int, bool]) -> NDArray[np.bool_]:
    """Of each frame; one that was missing in the file is as the one before."""
    numbers = recording.frames.tolist()
    labels = np.zeros(len(numbers), dtype=bool)
    for k, number in enumerate(numbers):
        if number in captured:
            labels[k] = captured[number]
        elif number in recording.repairs.missing:
            labels[k] = labels[k - 1]
        else:
            raise ValueError(f"captured lacks frame {number} of {recording.name!r}")
    unknown = sorted(set(captured) - set(numbers) - set(recording.repairs.left_out))
    if unknown:
        raise ValueError(f"captured has frame {unknown[0]} of {recording.name!r}, which it has not")
    return labels


def _require_recordings(names: Sequence[str]) -> None:
    """Raises ValueError unless there are some, and each has a name of its own."""
    if not names:
        raise ValueError("recordings is empty, expected one at least")
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two recordings are named {name!r}, expected names of their own")


def _require_same(what: str, names: Sequence[str], given: Mapping[str, object]) -> None:
    """Raises ValueError unless each recording is named there, and no other."""
    for name in names:
        if name not in given:
            raise ValueError(f"{what} lacks {name!r}")
    others = [name for name in given if name not in names]
    if others:
        raise ValueError(f"{what} names {others[0]!r}, which is none of the recordings")


def read_labels(path: str | os.PathLike[str]) -> dict[str, bool]:
    """Whether each recording succeeded, by its file's name.

    The file has the columns recording,success, where success is 1, true or yes, or 0, false or no.
    Raises OSError, and ValueError with the line that is something else or names a recording again.
    """
    source = SourceFile(Path(path))
    labels: dict[str, bool] = {}
    for line, (name, word) in _label_rows(path, ("recording", "success")):
        if name in labels:
            raise source.error(f"{name!r} has a label already", line)
        labels[name] = _label(source, line, "success", word)
    return labels


def read_frame_labels(path: str | os.PathLike[str]) -> dict[str, dict[int, bool]]:
    """Whether the object was captured in each frame, by the file's name and the frame's number.

    The file has the columns recording,frame,captured. Raises as `read_labels`.
    """
    source = SourceFile(Path(path))
    labels: dict[str, dict[int, bool]] = {}
    for line, (name, number, word) in _label_rows(path, ("recording", "frame", "captured")):
        of_recording = labels.setdefault(name, {})
        if not (number.isascii() and number.isdecimal() and len(number) <= MOST_DIGITS):
            raise source.error(f"frame is {number!r}, expected a whole number", line)
        if int(number) in of_recording:
            raise source.error(f"frame {number} of {name!r} has a label already", line)
        of_recording[int(number)] = _label(source, line, "captured", word)
    return labels


def _label_rows(
    path: str | os.PathLike[str], header: tuple[str, ...]
) -> list[tuple[int, list[str]]]:
    """Raises ValueError on another header, and on rows that are not as long."""
    source = SourceFile(Path(path))
    (first, names), *rows = lines_of(path)
    if tuple(names) != header:
        raise source.error(f"the header is {','.join(names)}, expected {','.join(header)}", first)
    for line, cells in rows:
        if len(cells) != len(header):
            raise source.error(f"has {len(cells)} cells, expected {len(header)}", line)
        if not cells[0]:
            raise source.error("has no name, expected that of a recording's file", line)
    if not rows:
        raise source.error("has no labels")
    return rows


def _label(source: SourceFile, line: int, name: str, word: str) -> bool:
    if word.lower() not in WORDS:
        raise source.error(f"{name} is {word!r}, expected one of {', '.join(WORDS)}", line)
    return WORDS[word.lower()]
