"""Scores of many problems on all cores; can be stopped without losing what is done."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Problem, ScoreRow, ScoreRun
from energymargin.limits import Limit
from energymargin.tasks.base import whole_number

__all__ = [
    "ANY",
    "METRICS",
    "POLL",
    "ScoreError",
    "ScoreTable",
    "check_settings",
    "chosen_metrics",
    "held_interrupts",
    "metrics_of",
    "score",
    "thread_count",
]

ANY = "/any"
"""Ends the name of a metric that asks for at least one of several objects, instead of all."""

METRICS = (
    *("capture", "success", "effort/est", "effort/rrt", "force"),
    *("capture/any", "success/any", "effort/est/any", "effort/rrt/any"),
)
MOST_NODES = 10**9

# How long an interrupt may stay unnoticed [s].
POLL = 0.05


@dataclass(frozen=True)
class ScoreTable:
    """One row a problem: `table["capture"]` is the capture score of each, shape (N,)."""

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


class ScoreError(ValueError):
    """Some problems could not be scored; `table` holds those that could."""

    def __init__(self, errors: dict[int, str], table: ScoreTable) -> None:
        """`errors`: what went wrong, by the problem's index."""
        first = min(errors)
        many = f"{len(errors)} of {len(errors) + len(table)} problems could not be scored"
        super().__init__(f"{many}; problem {first}: {errors[first]}")
        self.errors = errors
        self.table = table


def score(
    problems: Sequence[Problem],
    metrics: Sequence[str] | None = None,
    nodes: int = 1000,
    seed: int = 0,
    threads: int | None = None,
    *,
    nodes_per_edge: int = 1,
    least_likelihood: float = 0.0,
    stop_at_escape: bool = False,
    progress: Callable[[int, int], None] | None = None,
    on_rows: Callable[[list[ScoreRow]], None] | None = None,
    indices: Sequence[int] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> ScoreTable:
    """Scores of every problem: the same bits for any number of threads.

    `metrics` are of METRICS, None takes all that every problem has; `nodes` is the size of each
    search tree, `threads` None takes all cores this process may use. `nodes_per_edge` and
    `least_likelihood` go to `capture_score`, `stop_at_escape` to `escape_effort`.
    `progress(done, total)` and `on_rows(rows)` are called as scores come in. `indices` are the
    problems' stream indices, 0 to N-1 if not given: a part of the problems with their own indices
    gets the scores it has in the whole. Each index has a stream of its own:
    `capture_score(problem, seed=stream(seed, index))` grows the tree of that problem here.

    After `timeout` [s], or once `cancel` is set, the table has the rows that are finished, each
    with the scores that it has in the whole; the others are missing.

    Ctrl-C stops within 0.1 s: `on_rows` has then got everything that was finished, and
    KeyboardInterrupt is raised. Raises ValueError on a bad problem or argument before anything is
    computed, and ScoreError at the end if the simulation of a problem failed.
    """
    limit = Limit(timeout, cancel)
    metrics = chosen_metrics(problems, metrics)
    check_settings(
        metrics, nodes, seed, nodes_per_edge=nodes_per_edge, least_likelihood=least_likelihood
    )
    threads = thread_count(threads)
    done: list[ScoreRow] = []
    errors: dict[int, str] = {}

    def deliver(rows: list[ScoreRow]) -> None:
        errors.update({row.index: row.error for row in rows if row.error})
        good = [row for row in rows if not row.error]
        done.extend(good)
        if on_rows is not None and good:
            on_rows(good)
        if progress is not None and rows:
            progress(len(done) + len(errors), len(problems))

    with held_interrupts() as interrupted:
        run = ScoreRun(
            problems,
            list(metrics),
            nodes,
            seed,
            threads,
            indices,
            nodes_per_edge,
            least_likelihood,
            stop_at_escape,
        )
        try:
            while not (run.finished or interrupted.is_set() or limit.reached):
                deliver(run.take(POLL))
        finally:
            run.cancel()
            deliver(run.take(0))
    if interrupted.is_set():
        raise KeyboardInterrupt
    table = _table(done, metrics, complete=len(done) + len(errors) == len(problems))
    if errors:
        raise ScoreError(errors, table)
    return table


def metrics_of(problems: Sequence[Problem]) -> tuple[str, ...]:
    """The metrics that every one of the problems has, in the order of METRICS."""
    there = set(METRICS)
    for problem in problems:
        if problem.succeeded is None:
            there.discard("success")
        if problem.succeeded_any is None:
            there.discard("success" + ANY)
        if problem.captured_any is None:
            there -= {metric for metric in METRICS if metric.endswith(ANY)} - {"success" + ANY}
    return tuple(metric for metric in METRICS if metric in there)


def chosen_metrics(problems: Sequence[Problem], metrics: Sequence[str] | None) -> Sequence[str]:
    """`metrics`, or for None all that the problems have; ValueError on one that they lack."""
    there = metrics_of(problems)
    lacking = [metric for metric in metrics or () if metric in METRICS and metric not in there]
    if lacking:
        of_each = " for each object" if lacking[0].endswith(ANY) else ""
        kind = "success" if lacking[0].startswith("success") else "capture"
        raise ValueError(
            f"metrics has {lacking[0]!r}, but not every problem has a {kind} set{of_each}"
        )
    return there if metrics is None else metrics


def check_settings(
    metrics: Sequence[str],
    nodes: int,
    seed: int,
    *,
    nodes_per_edge: int = 1,
    least_likelihood: float = 0.0,
) -> None:
    """Raises ValueError on an unknown metric, or on nodes or a seed that cannot be."""
    unknown = [metric for metric in metrics if metric not in METRICS]
    if unknown or not metrics:
        what = repr(unknown[0]) if unknown else "empty"
        raise ValueError(f"metrics is {what}, expected some of {', '.join(METRICS)}")
    whole_number("nodes", nodes, 1, MOST_NODES)
    whole_number("seed", seed, 0, 2**64 - 1)
    whole_number("nodes_per_edge", nodes_per_edge, 1, MOST_NODES)
    if not 0 <= least_likelihood < 1:
        raise ValueError(f"least_likelihood is {least_likelihood}, expected at least 0 and below 1")


def thread_count(threads: int | None) -> int:
    """`threads`, or for None all cores that this process may use; ValueError if below 1."""
    return len(os.sched_getaffinity(0)) if threads is None else whole_number("threads", threads, 1)


@contextmanager
def held_interrupts() -> Iterator[threading.Event]:
    """Ctrl-C sets the event instead of raising, so that no row is lost between a pool of threads
    and the file.

    Only where Python's own handler is in place: a program that handles Ctrl-C itself goes on doing
    so.
    """
    interrupted = threading.Event()

    def hold(_signal: int, _frame: FrameType | None) -> None:
        interrupted.set()

    python_handles = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not python_handles or threading.current_thread() is not threading.main_thread():
        yield interrupted
        return
    signal.signal(signal.SIGINT, hold)
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _table(rows: list[ScoreRow], metrics: Sequence[str], complete: bool) -> ScoreTable:
    rows = sorted(rows, key=lambda row: row.index)
    return ScoreTable(
        index=np.array([row.index for row in rows], dtype=np.int64),
        seconds=np.array([row.seconds for row in rows], dtype=float),
        scores={m: np.array([row.scores[m] for row in rows], dtype=float) for m in metrics},
        complete=complete,
    )
