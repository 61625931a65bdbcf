"""Scores of many problems, wherever they are computed. What is done when it stops is not lost."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Problem
from energymargin.arguments import shown
from energymargin.checks import whole_number
from energymargin.deprecations import once_positional
from energymargin.errors import EnergyMarginError
from energymargin.executors import Executor, Row
from energymargin.executors.chunks import POLL
from energymargin.executors.session import Session, Work
from energymargin.executors.threads import chosen_executor
from energymargin.limits import Limit
from energymargin.metrics import ANY, CLOCKLESS, METRICS, TIMED, check_metrics
from energymargin.notebook import shown_by
from energymargin.reprs import short_repr
from energymargin.results import collect
from energymargin.settings import LooseSettings, SearchSettings, chosen_settings

if TYPE_CHECKING:
    from typing_extensions import Unpack

__all__ = [
    "ProblemSource",
    "ScoreError",
    "ScoreTable",
    "chosen_metrics",
    "metrics_of",
    "require_objects",
    "run_all",
    "score",
]


MOST_INDEX = 2**63 - 1  # of a problem's stream, as a table and a store hold it


@dataclass(frozen=True)
class ScoreTable:
    """One row a problem: `table["capture"]` is the capture score of each, shape (N,)."""

    _repr_html_ = shown_by("data.score_table")
    __repr__ = short_repr

    index: NDArray[np.int64]
    """Which problem, shape (N,), rising."""
    seconds: NDArray[np.float64]
    """Computing time of each, that of its searches on their threads added up [s], shape (N,)."""
    scores: dict[str, NDArray[np.float64]]
    """By metric, (N,): capture, success in 0..1; effort [J], inf if there is no escape; force."""
    complete: bool = True
    """Whether every problem is there: False if the timeout or the cancel came first."""

    def __len__(self) -> int:
        """How many problems."""
        return len(self.index)

    def __getitem__(self, metric: str) -> NDArray[np.float64]:
        """The scores of one metric, shape (N,); KeyError if it was not computed."""
        if metric not in self.scores:
            raise KeyError(f"{metric!r} was not computed; there are: {', '.join(self.scores)}")
        return self.scores[metric]

    def to_rows(self) -> list[dict[str, float]]:
        """One dictionary a problem: index, seconds, and each metric."""
        columns = {"index": self.index, "seconds": self.seconds, **self.scores}
        names = list(columns)
        return [
            dict(zip(names, row, strict=True))
            for row in zip(*(c.tolist() for c in columns.values()), strict=True)
        ]


class ScoreError(EnergyMarginError, ValueError):
    """Some problems could not be scored."""

    def __init__(self, errors: dict[int, str], problems: int, table: ScoreTable | None = None):
        """`errors`: what went wrong, by the problem's index; `table`: those that could, if there
        is no store that has them."""
        first = min(errors)
        many = f"{len(errors)} of {problems} problems could not be scored"
        super().__init__(f"{many}; problem {first}: {errors[first]}")
        self.errors = errors
        self.table = table


class ProblemSource(Protocol):
    """Problems that are to be scored."""

    def take(self, most: int) -> Sequence[Work]:
        """Some of those that come next, at most so many; after a short wait none, if there are none
        right now."""
        ...

    @property
    def empty(self) -> bool:
        """Whether there will be no more."""
        ...


class _GivenProblems:
    """A ProblemSource of problems that are all there."""

    def __init__(
        self, problems: Sequence[Problem], indices: Sequence[int], metrics: Sequence[str]
    ) -> None:
        self._problems, self._indices, self._metrics = problems, indices, tuple(metrics)
        self._next = 0

    def take(self, most: int) -> Sequence[Work]:
        """As ProblemSource.take."""
        first, self._next = self._next, min(self._next + most, len(self._problems))
        return [
            Work(self._indices[i], self._problems[i], self._metrics)
            for i in range(first, self._next)
        ]

    @property
    def empty(self) -> bool:
        """As ProblemSource.empty."""
        return self._next == len(self._problems)


def run_all(
    source: ProblemSource,
    executor: Executor,
    settings: SearchSettings,
    deliver: Callable[[Sequence[Row]], None],
    limit: Limit,
) -> bool:
    """Scores all that a source has; returns whether that was all, False if the limit came first.

    `deliver` gets rows as they come, in this thread. On Ctrl-C it gets those that are finished, and
    KeyboardInterrupt is raised; so with any other error, which is then raised.
    """
    with executor.session(settings) as session:
        return collect(_Scorers(session, source), deliver, limit)


class _Scorers:
    """The Workers of a session, with the problems of a source."""

    def __init__(self, session: Session, source: ProblemSource) -> None:
        self._session, self._source = session, source

    @property
    def busy(self) -> bool:
        """As Workers.busy."""
        return not self._source.empty or self._session.pending > 0

    def step(self) -> Sequence[Row]:
        """As Workers.step. Without room, as on a cluster that has no workers yet, it waits."""
        room = self._session.room()
        if room and not self._source.empty:
            self._session.add(self._source.take(room))
        return self._session.take(POLL if self._session.pending or not room else 0)

    def stop(self) -> Sequence[Row]:
        """As Workers.stop."""
        return self._session.stop()


@once_positional("nodes", "seed", "threads", after=2)
def score(
    problems: Sequence[Problem],
    metrics: Sequence[str] | None = None,
    *,
    settings: SearchSettings | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    on_rows: Callable[[list[Row]], None] | None = None,
    indices: Sequence[int] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    **loose: Unpack[LooseSettings],
) -> ScoreTable:
    """Scores of every problem: the same bits for any number of threads, and on any executor.

    Args:
        problems: those that are scored.
        metrics: of METRICS; None takes all that every problem has.
        settings: of the searches and probabilities; None is SearchSettings().
        threads: None takes all cores that this process may use.
        executor: in place of threads, of `em.executors`: Processes, or Dask.
        progress: progress(done, total) is called as scores come in.
        on_rows: on_rows(rows) likewise; `row.curves` has the curves of the probabilities.
        indices: the problems' stream indices, by default 0 to N-1: a part of the problems with
            their own indices gets the scores it has in the whole. Each index has a stream of its
            own: `capture_score(problem, seed=stream(seed, index))` grows the tree of that problem.
        timeout: after so many seconds the table has the rows that are finished, each with the
            scores that it has in the whole; the others are missing.
        cancel: the same once it is set.
        loose: the fields of SearchSettings by name, as nodes=100, in place of `settings`.

    Ctrl-C stops within 0.2 s: `on_rows` has then got everything that was finished, and
    KeyboardInterrupt is raised. Raises ValueError on a bad problem or argument before anything is
    computed, and ScoreError at the end if the simulation of a problem failed.
    """
    limit = Limit(timeout, cancel)
    if isinstance(problems, (Problem, Mapping)) or not hasattr(problems, "__getitem__"):
        raise TypeError(f"problems is {shown(problems)}, expected a list of Problems")
    metrics = chosen_metrics(problems, metrics)
    check_metrics(metrics)
    settings = chosen_settings(settings, **loose)
    require_objects(problems, metrics, settings)
    if executor is not None and threads is not None:
        raise ValueError(f"threads is {threads}, expected None with an executor")
    executor = chosen_executor(executor, threads)
    done: list[Row] = []
    errors: dict[int, str] = {}

    def deliver(rows: Sequence[Row]) -> None:
        errors.update({row.index: row.error for row in rows if row.error})
        good = [row for row in rows if not row.error]
        done.extend(good)
        if on_rows is not None and good:
            on_rows(good)
        if progress is not None and rows:
            progress(len(done) + len(errors), len(problems))

    source = _GivenProblems(problems, _indices(indices, len(problems)), metrics)
    complete = run_all(source, executor, settings, deliver, limit)
    table = _table(done, metrics, complete)
    if errors:
        raise ScoreError(errors, len(problems), table)
    return table


def _indices(indices: Sequence[int] | None, problems: int) -> Sequence[int]:
    if indices is not None and len(indices) != problems:
        raise ValueError(f"indices has {len(indices)} numbers, expected one for each problem")
    if indices is None:
        return range(problems)
    return [whole_number("indices", index, 0, MOST_INDEX) for index in indices]


def metrics_of(problems: Sequence[Problem]) -> tuple[str, ...]:
    """The metrics that every one of the problems has, in the order of METRICS."""
    there = set(METRICS)
    for problem in problems:
        there -= set(TIMED if problem.horizon is None else CLOCKLESS)
        if problem.succeeded is None:
            there -= {"success", "probability/success"}
        if problem.succeeded_any is None:
            there.discard("success" + ANY)
        if problem.captured_any is None:
            there -= {metric for metric in METRICS if metric.endswith(ANY)} - {"success" + ANY}
    return tuple(metric for metric in METRICS if metric in there)


def chosen_metrics(problems: Sequence[Problem], metrics: Sequence[str] | None) -> Sequence[str]:
    """`metrics`, or for None all that the problems have; ValueError on one that they lack."""
    strange = [problem for problem in problems if not isinstance(problem, Problem)]
    if strange:
        raise ValueError(f"problems has {strange[0]!r}, expected Problems alone")
    there = metrics_of(problems)
    lacking = [metric for metric in metrics or () if metric in METRICS and metric not in there]
    if lacking:
        timed = lacking[0] in TIMED
        if lacking[0] in (*TIMED, *CLOCKLESS) and any(
            (problem.horizon is None) == timed for problem in problems
        ):
            has = "has a" if timed else "is without"
            way = "horizon=..." if timed else "horizon=None, plan=None"
            raise ValueError(
                f"metrics has {lacking[0]!r}, but not every problem {has} horizon: "
                f"problem.replace({way})"
            )
        of_each = " for each object" if lacking[0].endswith(ANY) else ""
        kind = "success" if lacking[0].startswith("success") else "capture"
        raise ValueError(
            f"metrics has {lacking[0]!r}, but not every problem has a {kind} set{of_each}"
        )
    return there if metrics is None else metrics


def require_objects(
    problems: Iterable[Problem], metrics: Sequence[str], settings: SearchSettings
) -> None:
    """Raises ValueError if a disturbance is to meet more objects than a problem has."""
    if settings.objects is None or not set(metrics) & set(TIMED):
        return
    for problem in problems:
        there = sum(body.role == "object" for body in problem.scene.bodies)
        if settings.objects > there:
            raise ValueError(
                f"objects is {settings.objects}, expected from 1 to the scene's {there}"
            )


def _table(rows: list[Row], metrics: Sequence[str], complete: bool) -> ScoreTable:
    rows = sorted(rows, key=lambda row: row.index)
    return ScoreTable(
        index=np.array([row.index for row in rows], dtype=np.int64),
        seconds=np.array([row.seconds for row in rows], dtype=float),
        scores={m: np.array([row.scores[m] for row in rows], dtype=float) for m in metrics},
        complete=complete,
    )
