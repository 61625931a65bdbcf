"""Recorded trajectories of a task, with their labels: in memory, or in an open file (HDF5).

A dataset's digest depends on all that can change a score or a label, and not on its file.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Problem
from energymargin.base.aliases import AnyPath, Floats, Ints, Mask
from energymargin.base.checks import check_type, shown, whole_number
from energymargin.base.closing import Closing
from energymargin.base.errors import EnergyMarginError
from energymargin.base.summary import Summarized
from energymargin.model.beliefs.belief import Belief
from energymargin.model.beliefs.uncertainty import Uncertainty
from energymargin.records.datasets import files
from energymargin.records.datasets.columns import COLUMNS, ROW, Block, BodyNumbers, as_blocks
from energymargin.records.datasets.future import Future
from energymargin.tasks.base import Task
from energymargin.tasks.scripted import Following, engine_of
from energymargin.tasks.trajectories import Trajectory

Label = tuple[int, int, bool, bool, bool | None, bool | None]
"""Label of a state: trajectory, frame, captured, success, captured_any, success_any."""

# The seed of a trajectory changes none of its numbers.
_HASHED = [name for name in (*(ROW.names or ()), *COLUMNS) if name != "seed"]
FRAMES = 5  # as the results ask: 0.8 to 1.4 s of the tasks of this package
SECONDS = 0.5  # where frames are closer together, as those of a camera, so many as this has
PLANS: tuple[Following | None, ...] = ("script", "hold", None)
SAMPLE = 20  # states that tell whether a plan can be asked, and which metrics there are


class StateError(EnergyMarginError, ValueError):
    """A recorded state makes no problem. The message has its trajectory, frame, and the reason."""


def left_out_text(reasons: Mapping[int, str], states: int) -> str:
    """Counts the states that cannot be simulated, of so many, with the reason of the first."""
    first = reasons[min(reasons)]
    return f"{len(reasons)} of {states} states cannot be simulated and are left out; first {first}"


@dataclass(frozen=True, eq=False)
class Dataset(Closing, Summarized):
    """Trajectories of one task.

    Its states are numbered through: all frames of the first trajectory, then the second's. In
    memory or in an open file, it is the same dataset. What needs all states reads them in blocks.
    """

    task: str
    """The task's name."""
    parameters: dict[str, Any]
    """The task's parameters: `tasks.make(task, **parameters)` makes it again."""
    seed: int
    """The seed of `generate`."""
    trajectories: Sequence[Trajectory]

    def __post_init__(self) -> None:
        """Raises ValueError without a trajectory."""
        if len(self.trajectories) == 0:
            raise ValueError("trajectories is empty, expected one at least")

    def __getstate__(self) -> dict[str, Any]:
        """What it was made of; what it found out since is found again."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def __repr__(self) -> str:
        """Task, parameters, seed, and how many trajectories and states."""
        made = f"task={self.task!r}, parameters={self.parameters!r}, seed={self.seed}"
        return f"Dataset({made}, trajectories={len(self.trajectories)}, states={self.size})"

    @property
    def lengths(self) -> Ints:
        """Frames of each trajectory, shape (T,)."""
        return np.asarray(self._rows["frames"])

    @property
    def size(self) -> int:
        """Number of all states."""
        return int(self._ends[-1])

    @property
    def successes(self) -> Mask:
        """Whether each trajectory ends in the success set, shape (T,)."""
        return np.asarray(self._rows["success"])

    def frames(self) -> list[tuple[int, int]]:
        """Trajectory and frame of each state, in the order of their numbers."""
        return list(self._places(range(self.size)))

    def labels(self, first: int, last: int) -> list[Label]:
        """Labels of the states from number `first` on, before `last`.

        Raises ValueError unless 0 <= first <= last <= size.
        """
        if not 0 <= first <= last <= self.size:
            raise ValueError(
                f"first and last are {first} and {last}, expected 0 <= first <= last <= {self.size}"
            )
        labels: list[Label] = []
        for t, frames in self._by_trajectory(range(first, last)):
            own = self.trajectories[t]
            captured = own.captured.tolist()
            some = [None] * len(own) if own.captured_any is None else own.captured_any.tolist()
            ends = (bool(own.success), None if own.success_any is None else bool(own.success_any))
            labels += [(t, k, captured[k], ends[0], some[k], ends[1]) for k in frames]
        return labels

    def problems(
        self, numbers: Sequence[int] | None = None, *, future: Future | None = None
    ) -> list[Problem]:
        """The problems of the states of these numbers, which rise; by default of all.

        Each has the friction and the contact forces recorded there; with a `future` it asks about
        the frames to come. Raises ValueError on numbers
        that do not rise from 0 to below `size`, and StateError with the trajectory and frame of a
        state that makes no problem.
        """
        return [make() for _, make in self._asked(numbers, future)]

    def possible_problems(
        self, numbers: Sequence[int] | None = None, *, future: Future | None = None
    ) -> tuple[dict[int, Problem], dict[int, str]]:
        """The problems of those states that make one, by number, and of each other state the
        reason, with its trajectory and frame: it cannot be simulated.

        Arguments and errors as of `problems`, but for StateError.
        """
        problems: dict[int, Problem] = {}
        reasons: dict[int, str] = {}
        for number, make in self._asked(numbers, future):
            try:
                problems[number] = make()
            except StateError as error:
                reasons[number] = str(error)
        return problems, reasons

    @property
    def has_clock(self) -> bool:
        """Whether its problems have a horizon; those of one dataset are alike in that."""
        found = (self.possible_problems([number])[0] for number in range(self.size))
        horizons = (problem.horizon for problems in found for problem in problems.values())
        return next(horizons, None) is not None

    def belief(self, number: int, uncertainty: Uncertainty, future: Future | None = None) -> Belief:
        """The belief about the state of a number whose model is known with an error.

        Its capture set is that of each particle's own state. Measured contacts do not count.
        Raises ValueError on a number that is none of a state, and StateError as `problems`.
        """
        number = whole_number("number", number, 0, self.size - 1)
        ((t, k),) = self._places([number])
        trajectory = self.trajectories[t]

        def question(state: Floats) -> Problem:
            states = np.array(trajectory.states)
            states[k] = state
            return self._problem(replace(trajectory, states=states), t, k, future).with_state(state)

        believed = self._problem(trajectory, t, k, future)
        return Belief(believed, uncertainty=uncertainty, question=question)

    def in_engine(self, engine: str) -> Dataset:
        """The same trajectories, with problems that "native" or "bullet" steps; itself if that is
        what it has."""
        if engine_of(self._made) == engine:
            return self
        return replace(self, parameters={**self.parameters, "engine": engine})

    def digest(self) -> str:
        """SHA-256 of all that can change a score or a label, whatever the file."""
        return _digest(self.task, self.parameters, self._blocks())

    def save(self, path: AnyPath) -> None:
        """Writes the file in one go: it is there whole, or as it was.

        The same dataset makes the same bytes. Raises OSError if it cannot be written.
        """
        files.write(Path(path), self.task, self.parameters, self.seed, self.trajectories)

    def close(self) -> None:
        """Closes the file; does nothing for a dataset in memory."""
        if isinstance(self.trajectories, files.Recorded):
            self.trajectories.close()

    @cached_property
    def _ends(self) -> Ints:
        """Number of the first state of each trajectory, and of all; shape (T + 1,)."""
        return np.concatenate([[0], np.cumsum(self.lengths)])

    @cached_property
    def _rows(self) -> NDArray[np.void]:
        """A row for each trajectory, shape (T,), type ROW."""
        if isinstance(self.trajectories, files.Recorded):
            return self.trajectories.rows
        return np.concatenate([np.zeros(0, ROW), *(block.rows for block in self._blocks())])

    @cached_property
    def _made(self) -> Task:
        return tasks.make(self.task, **self.parameters)

    def _blocks(self) -> Iterator[Block]:
        if isinstance(self.trajectories, files.Recorded):
            return self.trajectories.blocks()
        return as_blocks(self.trajectories)

    def _places(self, numbers: Sequence[int] | Ints) -> Iterable[tuple[int, int]]:
        """Trajectory and frame of these states."""
        wanted = np.asarray(numbers, dtype=np.int64)
        trajectory = np.searchsorted(self._ends, wanted, side="right") - 1
        return zip(trajectory.tolist(), (wanted - self._ends[trajectory]).tolist(), strict=True)

    def _by_trajectory(self, numbers: Sequence[int] | Ints) -> Iterator[tuple[int, list[int]]]:
        """The trajectories of these states, which rise, and their frames."""
        for t, places in groupby(self._places(numbers), key=itemgetter(0)):
            yield t, [k for _, k in places]

    def _rising(self, numbers: Sequence[int]) -> Ints:
        found = np.asarray(numbers)
        if found.size and found.dtype.kind not in "iu":
            raise ValueError(f"numbers are {shown(numbers)}, expected whole numbers of states")
        wanted = found.astype(np.int64)
        bad = (wanted < 0) | (wanted >= self.size)
        if bad.any() or (np.diff(wanted) <= 0).any():
            what = f"{wanted[bad][0]} among them" if bad.any() else "some that do not rise"
            text = f"numbers has {what}, expected numbers of states that rise, below {self.size}"
            raise ValueError(text)
        return wanted

    def _asked(
        self, numbers: Sequence[int] | None, future: Future | None
    ) -> Iterator[tuple[int, Callable[[], Problem]]]:
        """Yields the number of each of these states, and what makes its problem."""
        check_type("future", future, Future | None, "an em.datasets.Future, or None")
        wanted = range(self.size) if numbers is None else self._rising(numbers)
        for t, frames in self._by_trajectory(wanted):
            trajectory = self.trajectories[t]
            for k in frames:
                yield int(self._ends[t]) + k, partial(self._problem, trajectory, t, k, future)

    def _problem(self, trajectory: Trajectory, t: int, k: int, future: Future | None) -> Problem:
        try:
            if future is not None:
                return future.problem(self._made, trajectory, k)
            recorded = trajectory.states[k], trajectory.params, trajectory.contacts[k]
            return self._made.problem(*recorded)
        except ValueError as error:
            raise StateError(f"trajectory {t}, frame {k}: {error}") from error


def load(path: AnyPath) -> Dataset:
    """The dataset in a file, all of it in memory.

    Raises FileNotFoundError if there is none, and ValueError if it is not an HDF5 file, or a
    truncated one, or holds something else than a dataset, or is of another version.
    """
    with open(path) as dataset:
        return Dataset(dataset.task, dataset.parameters, dataset.seed, list(dataset.trajectories))


def open(path: AnyPath) -> Dataset:
    """The dataset in a file, whose trajectories are read in blocks when they are asked for.

    Memory stays flat however many there are. Close it, or use it in a `with` statement. Raises: as
    `load`, of what is damaged when that is read.
    """
    recorded = files.Recorded(Path(path))
    return Dataset(recorded.task, recorded.parameters, recorded.seed, recorded)


def _digest(task: str, parameters: dict[str, Any], blocks: Iterable[Block]) -> str:
    """Digest of trajectories in any blocks: each column is a stream of bytes of its own."""
    streams = {name: hashlib.sha256() for name in _HASHED}
    bodies = BodyNumbers()
    for block in blocks:
        columns = {**block.columns, "contacts": bodies.renumbered(block)}
        for name, stream in streams.items():
            column = columns[name] if name in columns else block.rows[name]
            stream.update(np.ascontiguousarray(column).data.cast("B"))
    parts = {name: stream.hexdigest() for name, stream in streams.items()}
    text = json.dumps([task, parameters, list(bodies), parts], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def usual_future(dataset: Dataset, frames: int | None = None) -> Future:
    """What `energymargin score` asks of a dataset's states by default: whether each stays captured
    over the next frames of what its robot does.

    Five frames, or as many as half a second has where they are closer together, but no more than
    the longest trajectory has, if `frames` does not say how many; the plan is the task's script, or
    "hold" where there is none. Raises ValueError if each trajectory has one frame alone, or no plan
    can be asked.
    """
    if frames is None:
        times = np.asarray(dataset.trajectories[int(np.argmax(dataset.lengths))].times)
        last = len(times) - 1
        if last == 0:
            raise ValueError("each trajectory has one frame alone, expected two or more")
        frames = min(max(FRAMES, round(SECONDS * last / float(times[-1] - times[0]))), last)
    numbers = spread(dataset.size, SAMPLE)
    for future in (Future(frames, plan) for plan in PLANS):
        problems, reasons = dataset.possible_problems(numbers, future=future)
        if problems:
            return future
    raise ValueError(reasons[min(reasons)])


def spread(states: int, most: int) -> list[int]:
    """Numbers of at most so many states, evenly spaced."""
    return sorted({*np.linspace(0, states - 1, most, dtype=int).tolist()})
