"""Recordings and their labels as a dataset, which is scored and evaluated as any other."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Region, Scene, World
from energymargin.records.datasets import Dataset
from energymargin.records.recordings.csv_files import read_cells
from energymargin.records.recordings.reading import SourceFile
from energymargin.records.recordings.recording import MOST_OVERLAP, Placed, Recording, placed
from energymargin.tasks.base import Params, Regions, Task, parameters_of
from energymargin.tasks.trajectories import Trajectory

FRAME = re.compile(r"0|[1-9][0-9]{,14}")
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
        states = in_scene.states
        trajectories.append(
            Trajectory(
                times=recording.times,
                states=states,
                contacts=[world.contacts(state) for state in states],
                captured=np.array([_inside(scene, made.captured(s, given), s) for s in states])
                if captured is None
                else _frame_labels(recording, captured[recording.name]),
                success=_inside(scene, made.succeeded(given), states[-1])
                if labels is None
                else labels[recording.name],
                params=given,
                seed=number,
            )
        )
    return Dataset(made.name, parameters_of(made), 0, trajectories)


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
    return {
        name: float(value)
        for name, value in parameters_of(task).items()
        if isinstance(value, (int, float)) and not isinstance(value, bool)
    }


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


def _inside(scene: Scene, sets: Regions, state: NDArray[np.float64]) -> bool:
    if not isinstance(sets, Region):
        raise ValueError("the task has several objects, expected one")
    return bool(sets.contains(scene, state))


def _frame_labels(recording: Recording, captured: Mapping[int, bool]) -> NDArray[np.bool_]:
    """The label of each frame; one that was missing in the file has that of the one before."""
    labels: list[bool] = []
    for number in recording.frames.tolist():
        if number not in captured and number not in recording.repairs.missing:
            raise ValueError(f"captured lacks frame {number} of {recording.name!r}")
        labels.append(captured[number] if number in captured else labels[-1])
    return np.array(labels)


def read_labels(path: str | os.PathLike[str]) -> dict[str, bool]:
    """Whether each recording succeeded, by its file's name.

    The file has the columns recording,success, where success is 1, true or yes, or 0, false or no.
    Raises OSError, ImportError without pandas, and ValueError with the line that is something else
    or names a recording again.
    """
    return {name: label for (name,), label in _labelled(path, ("recording", "success")).items()}


def read_frame_labels(path: str | os.PathLike[str]) -> dict[str, dict[int, bool]]:
    """Whether the object was captured in each frame, by the file's name and the frame's number.

    The file has the columns recording,frame,captured. Raises as `read_labels`.
    """
    labels: dict[str, dict[int, bool]] = {}
    for (name, number), label in _labelled(path, ("recording", "frame", "captured")).items():
        labels.setdefault(name, {})[int(number)] = label
    return labels


def _labelled(path: str | os.PathLike[str], header: tuple[str, ...]) -> dict[tuple[str, ...], bool]:
    """The labels of a file with this header, by what comes before them in their rows."""
    source = SourceFile(Path(path))
    (first, names), *rows = read_cells(source).items()
    if tuple(names) != header:
        raise source.error(f"the header is {','.join(names)}, expected {','.join(header)}", first)
    labels: dict[tuple[str, ...], bool] = {}
    for line, (*key, word) in rows:
        known = key[0] and all(map(FRAME.fullmatch, key[1:])) and word.lower() in WORDS
        if not known or tuple(key) in labels:
            raise source.error(
                f"has {','.join([*key, word])!r}, expected {','.join(header)}: the name of a "
                f"recording's file, a frame's number, one of {', '.join(WORDS)}; each once",
                line,
            )
        labels[tuple(key)] = WORDS[word.lower()]
    if not labels:
        raise source.error("has no labels")
    return labels
