"""Recorded trajectories of a task, with their labels: made, saved and loaded (HDF5).

The file holds one group a trajectory, and says in its root what made it:

    attributes          format, version, task, parameters (JSON), seed, count (of trajectories)
    trajectories/0000/  times (K,), states (K, n), captured (K,), contacts (C,)
                        attributes: success, seed, params (JSON)
                        with several objects also captured_any (K,) and the attribute success_any
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Cancel, Cancelled, Contact, Problem
from energymargin.limits import Limit
from energymargin.tasks.base import (
    ScriptedTask,
    Task,
    Trajectory,
    parameters_of,
    whole_number,
)

__all__ = ["Dataset", "generate", "load", "load_or_generate"]

FORMAT = "energymargin dataset"
VERSION = 2  # 1 had no labels of at least one object

_CONTACT = np.dtype(
    [
        ("frame", "<i8"),
        ("body_a", h5py.string_dtype()),
        ("body_b", h5py.string_dtype()),
        ("position", "<f8", (3,)),
        ("normal", "<f8", (3,)),
        ("distance", "<f8"),
        ("normal_force", "<f8"),
        ("tangential_force", "<f8", (3,)),
        ("friction", "<f8"),
    ]
)


@dataclass(frozen=True)
class Dataset:
    """Trajectories of one task.

    Its states are numbered through: all frames of the first trajectory, then the second's.
    """

    task: str
    """The task's name."""
    parameters: dict[str, Any]
    """The task's parameters: `tasks.make(task, **parameters)` makes it again."""
    seed: int
    """The seed of `generate`."""
    trajectories: list[Trajectory]

    def frames(self) -> list[tuple[int, int]]:
        """Trajectory and frame of each state, in the order of their numbers."""
        return [
            (t, k) for t, trajectory in enumerate(self.trajectories) for k in range(len(trajectory))
        ]

    def problems(self) -> list[Problem]:
        """The problem of each state, with the friction and the contact forces recorded there.

        Raises ValueError with the trajectory and frame of a state that makes no problem.
        """
        task = tasks.make(self.task, **self.parameters)
        problems = []
        for t, k in self.frames():
            trajectory = self.trajectories[t]
            try:
                problem = task.problem(
                    trajectory.states[k], trajectory.params, trajectory.contacts[k]
                )
            except ValueError as error:
                raise ValueError(f"trajectory {t}, frame {k}: {error}") from error
            problems.append(problem)
        return problems

    def digest(self) -> str:
        """A fingerprint of all that can change a score or a label, whatever the file."""
        sha = hashlib.sha256()
        sha.update(json.dumps([self.task, self.parameters], sort_keys=True).encode())
        for trajectory in self.trajectories:
            sha.update(json.dumps([trajectory.params, trajectory.success], sort_keys=True).encode())
            sha.update(
                repr([_contact_row(0, c) for frame in trajectory.contacts for c in frame]).encode()
            )
            arrays = [trajectory.times, trajectory.states, trajectory.captured]
            if trajectory.captured_any is not None:
                arrays.append(trajectory.captured_any)
            if trajectory.success_any is not None:
                arrays.append(np.array(trajectory.success_any))
            for array in arrays:
                sha.update(f"{array.shape}".encode() + np.ascontiguousarray(array).tobytes())
        return sha.hexdigest()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file in one go: it is there whole, or as it was.

        Raises OSError if it cannot be written.
        """
        path = Path(path)
        if not path.parent.is_dir():
            raise FileNotFoundError(errno.ENOENT, "no such folder", str(path.parent))
        temporary = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            with h5py.File(temporary, "w") as file:
                _write(self, file)
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)


def generate(
    task: str | Task,
    trajectories: int = 50,
    frames: int = 10,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    *,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Dataset:
    """Rolls out `trajectories` random trajectories of `frames` frames each.

    `task` is a name, or a task from `tasks.make`. Trajectory i is the same for any number of
    trajectories. `progress(done, total)` is called after each.

    After `timeout` [s], or once `cancel` is set, the dataset has the first trajectories, those that
    are done; a task that is no ScriptedTask is asked in between them alone. Raises ValueError on an
    unknown task or numbers out of range; TimeoutError or Cancelled if not even one is done.
    """
    limit = Limit(timeout, cancel)
    made = tasks.make(task) if isinstance(task, str) else task
    trajectories = whole_number("trajectories", trajectories, 1)
    seed = whole_number("seed", seed, 0, 2**63 - 1)
    recorded = []
    for index in range(trajectories):
        try:
            limit.require("one trajectory was done")
            recorded.append(_rollout(made, _stream(seed, index), frames, limit))
        except (TimeoutError, Cancelled):
            if recorded and limit.reached:
                break
            raise
        if progress is not None:
            progress(index + 1, trajectories)
    return Dataset(made.name, parameters_of(made), seed, recorded)


def _rollout(task: Task, seed: int, frames: int, limit: Limit) -> Trajectory:
    if isinstance(task, ScriptedTask) and type(task).rollout is ScriptedTask.rollout:
        return task.rollout(seed, frames, **limit.rest())
    return task.rollout(seed, frames)


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
    found = (dataset.task, dataset.parameters, dataset.seed, [len(t) for t in dataset.trajectories])
    if found != (task.name, parameters_of(task), seed, [frames] * trajectories):
        raise ValueError(f"{path} holds other trajectories: remove it, or choose another folder")
    return dataset


class _Other(ValueError):
    """A file that is whole, but none of ours."""


def load(path: str | os.PathLike[str]) -> Dataset:
    """The dataset in a file.

    Raises FileNotFoundError if there is none, and ValueError if it is not an HDF5 file, or a
    truncated one, or holds something else than a dataset, or comes from a newer version.
    """
    path = Path(path)
    with path.open("rb"):  # h5py's own words for a file that is missing or not readable are long
        pass
    if not h5py.is_hdf5(path):
        raise ValueError(f"{path} is not a dataset: it is not an HDF5 file")
    try:
        with h5py.File(path, "r") as file:
            _check_format(path, file)
            return _read(file)
    except _Other:
        raise
    except (OSError, LookupError, TypeError, RuntimeError, ValueError) as error:
        raise ValueError(f"{path} is damaged or cut short: {_one_line(error)}") from error


def _stream(seed: int, index: int) -> int:
    """The seed of one trajectory: 63 bits, which fit every integer type on disk."""
    return int(
        np.random.SeedSequence((seed, index)).generate_state(1, np.uint64)[0] >> np.uint64(1)
    )


def _write(dataset: Dataset, file: h5py.File) -> None:
    file.attrs.update(
        format=FORMAT,
        version=VERSION,
        task=dataset.task,
        parameters=json.dumps(dataset.parameters),
        seed=dataset.seed,
        count=len(dataset.trajectories),
    )
    root = file.create_group("trajectories")
    for index, trajectory in enumerate(dataset.trajectories):
        group = root.create_group(f"{index:04d}")
        group.attrs.update(
            success=trajectory.success, seed=trajectory.seed, params=json.dumps(trajectory.params)
        )
        group["times"] = trajectory.times
        group["states"] = trajectory.states
        group["captured"] = trajectory.captured
        if trajectory.captured_any is not None:
            group["captured_any"] = trajectory.captured_any
        if trajectory.success_any is not None:
            group.attrs["success_any"] = trajectory.success_any
        rows = [_contact_row(k, c) for k, frame in enumerate(trajectory.contacts) for c in frame]
        group.create_dataset("contacts", data=np.array(rows, dtype=_CONTACT))


def _check_format(path: Path, file: h5py.File) -> None:
    found = file.attrs.get("format")
    if found != FORMAT:
        what = "an HDF5 file of something else" if found is None else repr(found)
        raise _Other(f"{path} is not a dataset: it is {what}")
    version = int(file.attrs["version"])
    if version < 1:
        raise ValueError(f"its version is {version}")
    if version > VERSION:
        raise _Other(
            f"{path} has version {version} of the dataset format, "
            f"and this energymargin reads up to {VERSION}: update it"
        )


def _read(file: h5py.File) -> Dataset:
    groups = file["trajectories"]
    if len(groups) != file.attrs["count"] or len(groups) == 0:
        raise ValueError(f"it has {len(groups)} of {file.attrs['count']} trajectories")
    return Dataset(
        task=str(file.attrs["task"]),
        parameters=json.loads(file.attrs["parameters"]),
        seed=int(file.attrs["seed"]),
        trajectories=[_read_trajectory(groups[name]) for name in sorted(groups, key=int)],
    )


def _read_trajectory(group: h5py.Group) -> Trajectory:
    times, states, captured = (group[name][()] for name in ("times", "states", "captured"))
    success_any = group.attrs.get("success_any")
    return Trajectory(
        times=times,
        states=states,
        contacts=_read_contacts(group["contacts"][()], len(times)),
        captured=captured,
        success=bool(group.attrs["success"]),
        params=json.loads(group.attrs["params"]),
        seed=int(group.attrs["seed"]),
        captured_any=group["captured_any"][()] if "captured_any" in group else None,
        success_any=None if success_any is None else bool(success_any),
    )


def _read_contacts(rows: NDArray[np.void], frames: int) -> list[list[Contact]]:
    contacts: list[list[Contact]] = [[] for _ in range(frames)]
    for row in rows:
        if not 0 <= row["frame"] < frames:
            raise ValueError(f"a contact is of frame {row['frame']}, and there are {frames}")
        values = {name: row[name] for name in _CONTACT.names or () if name != "frame"}
        values["body_a"], values["body_b"] = values["body_a"].decode(), values["body_b"].decode()
        contacts[row["frame"]].append(Contact(**values))
    return contacts


def _contact_row(frame: int, contact: Contact) -> tuple[Any, ...]:
    return (
        frame,
        contact.body_a,
        contact.body_b,
        tuple(np.asarray(contact.position).tolist()),
        tuple(np.asarray(contact.normal).tolist()),
        float(contact.distance),
        float(contact.normal_force),
        tuple(np.asarray(contact.tangential_force).tolist()),
        float(contact.friction),
    )


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
