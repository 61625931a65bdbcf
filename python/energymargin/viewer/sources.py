"""What can be looked at: a problem, a margin along a plan, or trajectories of a dataset or a task,
with their scores."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from energymargin import datasets
from energymargin import tasks as registry
from energymargin._core import Problem
from energymargin.actions import Along
from energymargin.actions.trials import Disturbance
from energymargin.datasets import Dataset, Future
from energymargin.metrics import is_likelihood
from energymargin.reprs import short_repr
from energymargin.searches import SETTINGS
from energymargin.store import ScoreStore
from energymargin.store.run import why_not_of

__all__ = [
    "EFFORT",
    "AlongPlan",
    "AlongScores",
    "FrameScores",
    "Frames",
    "OneProblem",
    "StateSource",
    "StoredScores",
    "Trajectories",
    "first_frame",
    "source_of",
]

PROBLEM, DATASET, STORE = ".json", ".h5", ".db"
BODIES = (".urdf", ".stl", ".obj", ".dae")
Progress = Callable[[int, int], None]

EFFORT = "effort/est"
# Share of a trajectory's frames before its loss. In the frames just before it the object leaves by
# itself, and long before it all is well: here the tasks have capture scores of 0.2 to 0.6.
BEFORE = 0.25
MOST = 100  # trajectories that are searched for a loss
LOW = 0.1  # quantile of the particles of a belief that is shown beside their mean


@dataclass(frozen=True, eq=False)
class Frames:
    """The frames of one trajectory."""

    __repr__ = short_repr

    times: NDArray[np.float64]
    """Time of each [s], shape (K,)."""
    states: NDArray[np.float64]
    """Shape (K, n)."""
    problem: Callable[[int], Problem]
    """The problem of a frame; raises ValueError if its state makes none."""
    first: int | None = None
    """The first frame's number among all states of a dataset; None: it is of none."""
    captured: NDArray[np.bool_] | None = None
    """Whether each state lies in its capture set, shape (K,); None if it is not known."""
    success: bool | None = None
    captured_any: NDArray[np.bool_] | None = None
    """Whether at least one of several objects is captured, shape (K,)."""
    disturbance: Disturbance | None = None
    """Of their probabilities; None: that of the settings."""
    same_stream: bool = False
    """Whether all frames are searched as number 0 of a batch, and so meet the same draws."""

    def search_number(self, frame: int) -> int | None:
        """As of `metric_search`: with it the scores are those that `energymargin score` gives the
        dataset, or `capture_score` the problem."""
        if self.first is None:
            return None
        return 0 if self.same_stream else self.first + frame


class StateSource(Protocol):
    """What is looked at."""

    @property
    def title(self) -> str:
        """What it is, in a few words."""

    @property
    def trajectories(self) -> int:
        """How many there are."""

    def frames(self, trajectory: int) -> Frames:
        """Of one of them; raises ValueError unless 0 <= trajectory < trajectories."""

    def close(self) -> None:
        """Lets go of the file that was opened for it, if there is one."""


@dataclass(frozen=True)
class OneProblem:
    """A problem alone: one trajectory of one frame."""

    question: Problem
    title: str = "a problem"
    trajectories: int = 1

    def frames(self, trajectory: int) -> Frames:
        """As StateSource.frames."""
        _require_below("trajectory", trajectory, self.trajectories)
        states = np.asarray(self.question.state)[None]
        return Frames(np.zeros(1), states, lambda _: self.question)

    def close(self) -> None:
        """As StateSource.close."""


@dataclass(frozen=True)
class AlongPlan:
    """The nominal motion of a plan: one trajectory, with a frame for each moment."""

    along: Along
    title: str = "along a plan"
    trajectories: int = 1

    def frames(self, trajectory: int) -> Frames:
        """As StateSource.frames."""
        _require_below("trajectory", trajectory, self.trajectories)
        one = self.along
        return Frames(
            one.times,
            one.states,
            lambda frame: one.problems[frame],
            first=0,
            captured=one.captured,
            disturbance=one.disturbance,
            same_stream=True,
        )

    def close(self) -> None:
        """As StateSource.close."""


@dataclass(frozen=True)
class Trajectories:
    """A dataset, in memory or in an open file."""

    dataset: Dataset
    title: str
    opened: bool = False
    """Whether the dataset's file was opened for this alone."""
    future: Future | None = None
    """What is asked of each state's future; None: it is asked about as it is."""

    @property
    def trajectories(self) -> int:
        """As StateSource.trajectories."""
        return len(self.dataset.trajectories)

    def frames(self, trajectory: int) -> Frames:
        """As StateSource.frames."""
        _require_below("trajectory", trajectory, self.trajectories)
        recorded = self.dataset.trajectories[trajectory]
        first = int(self.dataset.lengths[:trajectory].sum())
        return Frames(
            recorded.times,
            recorded.states,
            lambda frame: self.dataset.problems([first + frame], future=self.future)[0],
            first,
            recorded.captured,
            recorded.success,
            recorded.captured_any,
        )

    def close(self) -> None:
        """As StateSource.close."""
        if self.opened:
            self.dataset.close()


def source_of(
    what: Problem | Dataset | Along | str | os.PathLike[str],
    parameters: Mapping[str, Any] | None = None,
    *,
    trajectories: int = 6,
    frames: int = 30,
    seed: int = 0,
    future: Future | None = None,
    progress: Progress | None = None,
) -> StateSource:
    """A problem, a dataset, the file of one, a margin along a plan, or a task's name.

    Of a task so many trajectories of so many frames are generated, with this seed. `future`: of a
    dataset or a task, what is asked of each state. Raises ValueError on anything else, and OSError
    on a file that cannot be read.
    """
    if not isinstance(what, (Problem, Dataset, Along, str, os.PathLike)):
        raise ValueError(
            f"what is a {type(what).__name__}, expected a Problem, a Dataset, the file of one, an "
            "Along, or the name of a task"
        )
    if isinstance(what, Along):
        if future is not None:
            raise ValueError("future is given with an Along, which says how far it looks itself")
        return AlongPlan(what)
    if isinstance(what, Problem):
        return _alone(what, "a problem", future)
    if isinstance(what, Dataset):
        return Trajectories(what, what.task, future=future)
    path = Path(what)
    if parameters and path.suffix in (PROBLEM, DATASET):
        raise ValueError(f"parameters are given with {path}, expected a task's name with them")
    if path.suffix == PROBLEM:
        return _alone(Problem.load(path), path.name, future)
    if path.suffix == DATASET:
        return Trajectories(datasets.open(path), path.name, opened=True, future=future)
    if path.suffix == STORE:
        raise ValueError(f"{path} holds scores: view the dataset, with --scores {path}")
    if path.suffix.lower() in BODIES:
        raise ValueError(
            f"{path} is a body, and a view is of a problem: put it into a scene with an object and "
            "a capture set, and view what problem.save() writes"
        )
    if str(what) not in registry.names():
        raise ValueError(
            f"{str(what)!r} is neither a problem file ({PROBLEM}), nor a dataset ({DATASET}), "
            f"nor a task: {', '.join(registry.names())}"
        )
    task = registry.make(str(what), **(parameters or {}))
    made = datasets.generate(
        task, trajectories=trajectories, frames=frames, seed=seed, progress=progress
    )
    return Trajectories(made, f"{task.name}, seed {seed}", future=future)


def _alone(question: Problem, title: str, future: Future | None) -> StateSource:
    if future is not None:
        raise ValueError(
            f"horizon is {future.horizon} frames, but {title} is a problem, and has no "
            "frames: give it one in seconds, problem.replace(horizon=...)"
        )
    return OneProblem(question, title)


def _require_below(name: str, number: int, count: int) -> None:
    if not 0 <= number < count:
        raise ValueError(f"{name} is {number}, expected 0 to {count - 1}")


def first_frame(source: StateSource, trajectory: int | None, frame: int | None) -> tuple[int, int]:
    """The trajectory and its frame, where they are not given.

    The trajectory is the first one that ends outside of its capture set, or else the first. The
    frame is a quarter of all before its last loss or, without one, in its middle; of a margin along
    a plan it is the weakest moment. It is the first frame if the state of that one makes no
    problem. A frame that is given without a trajectory is the first one's.
    """
    if trajectory is None:
        searched = range(min(source.trajectories, MOST)) if frame is None else ()
        trajectory = _first_lost(source, searched)
    if frame is not None:
        return trajectory, frame
    if isinstance(source, AlongPlan):
        return trajectory, source.along.weakest.number
    return trajectory, _frame_of(source.frames(trajectory))


def _first_lost(source: StateSource, trajectories: Iterable[int]) -> int:
    for trajectory in trajectories:
        captured = source.frames(trajectory).captured
        if captured is not None and captured[0] and not captured[-1]:
            return trajectory
    return 0


def _frame_of(frames: Frames) -> int:
    count, captured = len(frames.times), frames.captured
    lost = np.zeros(0, int) if captured is None else np.flatnonzero(captured[:-1] & ~captured[1:])
    frame = count // 2
    if len(lost):
        frame = max(0, int(lost[-1]) + 1 - max(1, round(BEFORE * count)))
    try:
        frames.problem(frame)
    except ValueError:
        return 0
    return frame


class FrameScores(Protocol):
    """Scores of all states that were computed before."""

    @property
    def curves(self) -> Collection[str]:
        """Names of what is drawn along a trajectory: metrics, and "low" and "high" for the ends of
        an interval of the first."""

    def columns(self, number: int) -> list[tuple[str, dict[str, float]]]:
        """The scores of the state of that number, by metric, with a title; NaN is one that is
        missing."""

    def along(self, metric: str, first: int, frames: int) -> NDArray[np.float64]:
        """The scores of so many states from number `first` on, NaN where there is none."""


class AlongScores:
    """The scores of a margin along a plan, at each of its moments."""

    def __init__(self, along: Along) -> None:
        """Those that there are."""
        self._scores = {"probability": along.probabilities, EFFORT: along.efforts}
        self._ends = {"low": along.low, "high": along.high}

    @property
    def curves(self) -> Collection[str]:
        """As FrameScores.curves."""
        return [name for name in self._curves if not np.isnan(self._curves[name]).all()]

    @property
    def _curves(self) -> dict[str, NDArray[np.float64]]:
        """An effort without a bound has no place in a curve."""
        efforts = self._scores[EFFORT]
        finite = np.where(np.isfinite(efforts), efforts, np.nan)
        return self._scores | self._ends | {EFFORT: finite}

    def columns(self, number: int) -> list[tuple[str, dict[str, float]]]:
        """As FrameScores.columns."""
        scores = {metric: float(values[number]) for metric, values in self._scores.items()}
        return [("along the plan", scores)]

    def along(self, metric: str, first: int, frames: int) -> NDArray[np.float64]:
        """As FrameScores.along."""
        values = self._curves.get(metric)
        return np.full(frames, np.nan) if values is None else values[first : first + frames].copy()


class StoredScores:
    """The scores of a dataset's states in a file."""

    def __init__(
        self,
        path: str | os.PathLike[str],
        dataset: Dataset,
        run: int | None = None,
        name: str = "DATASET",
    ) -> None:
        """Reads them all. `name` is the dataset's, in errors.

        Raises ValueError if the file holds no scores, if they are another dataset's, or if there
        are several runs and none is chosen; OSError if it cannot be read.
        """
        with ScoreStore(path) as store:
            chosen = store.run(run)
            lacking = why_not_of(dataset, name, chosen.digest, str(path), chosen.number)
            if lacking:
                raise ValueError(lacking)
            self.search: dict[str, Any] = {
                name: chosen.settings[name] for name in SETTINGS if name in chosen.settings
            }
            """Settings with which a search gives the same scores."""
            self.future = chosen.future
            """Horizon and plan of each state; None: the scores have no clock."""
            nodes = f", {self.search['nodes']:,} nodes" if "nodes" in self.search else ""
            ahead = "" if chosen.future is None else f", {chosen.future}"
            self.title = f"{chosen.settings.get('source', 'stored')}{nodes}{ahead}"
            """What the column of them is called."""
            self._scores = chosen.labelled_scores().scores
            if chosen.sampling is not None:
                self.title += f", mean of {chosen.sampling.particles} particles"
            self._low = {m: chosen.quantiles(m, [LOW])[:, 0] for m in chosen.with_quantiles}

    @property
    def curves(self) -> Collection[str]:
        """As FrameScores.curves."""
        return [metric for metric in self._scores if is_likelihood(metric)]

    def columns(self, number: int) -> list[tuple[str, dict[str, float]]]:
        """The scores of the state of that number, by metric, with a title; NaN is one that is
        missing. Of a belief also what one particle in ten is below."""
        columns = [(self.title, self._scores)]
        if self._low:
            columns.append((f"{LOW:g} quantile", self._low))
        return [(title, {m: float(v[number]) for m, v in of.items()}) for title, of in columns]

    def along(self, metric: str, first: int, frames: int) -> NDArray[np.float64]:
        """The scores of so many states from number `first` on, NaN where there is none."""
        values = self._scores.get(metric)
        return np.full(frames, np.nan) if values is None else values[first : first + frames].copy()
