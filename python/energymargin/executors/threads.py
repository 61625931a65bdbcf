"""Scores on the threads of this process."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from energymargin._core import ScoreRun
from energymargin.checks import whole_number
from energymargin.closing import Closing
from energymargin.executors.session import Executor, Pace, Row, Work
from energymargin.executors.thread_pool import ThreadPool
from energymargin.metrics import METRICS
from energymargin.searches import SearchSettings

__all__ = ["Threads", "add_to_run", "chosen_executor", "core_count", "thread_count"]

# What lies ready for each thread: so much work [s], but so many problems at least and at most.
AHEAD = 0.5
FEWEST, MOST = 2, 2000


@dataclass(frozen=True)
class Threads:
    """Threads of this process: nothing to set up, the default. Scores do not depend on them."""

    count: int | None = None
    """How many; None takes all cores that this process may use."""

    def __post_init__(self) -> None:
        """Raises ValueError if `count` is below 1."""
        thread_count(self.count)

    def pool(self) -> ThreadPool:
        """As Executor.pool."""
        return ThreadPool(thread_count(self.count))

    def session(self, settings: SearchSettings) -> ThreadSession:
        """As Executor.session."""
        return ThreadSession(settings, thread_count(self.count))


class ThreadSession(Closing):
    """A Session on threads: a ScoreRun that gets more problems before it runs out of them."""

    def __init__(self, settings: SearchSettings, threads: int) -> None:
        """Threads start with the first problem."""
        self._run = ScoreRun(list(METRICS), threads=threads, **settings.all())
        self._threads = threads
        self._pace = Pace()

    @property
    def pending(self) -> int:
        """As Session.pending."""
        return self._run.pending

    def room(self) -> int:
        """As Session.room; in steps of half of what lies ready."""
        ahead = self._threads * max(FEWEST, self._pace.problems(AHEAD, MOST))
        missing = ahead - self.pending
        return missing if 2 * missing >= ahead else 0

    def add(self, work: Sequence[Work]) -> None:
        """As Session.add."""
        add_to_run(self._run, work)

    def take(self, timeout: float) -> Sequence[Row]:
        """As Session.take."""
        rows = self._run.take(timeout)
        self._pace.saw(len(rows), sum(row.seconds for row in rows))
        return rows

    def stop(self) -> Sequence[Row]:
        """As Session.stop."""
        self._run.cancel()
        return self._run.take(0)

    def close(self) -> None:
        """Joins the threads."""
        self._run.cancel()


def chosen_executor(executor: Executor | None, threads: int | None = None) -> Executor:
    """`executor`, or for None so many threads; ValueError if it is none."""
    if executor is None:
        return Threads(threads)
    if isinstance(executor, type) or not callable(getattr(executor, "session", None)):
        raise ValueError(f"executor is {executor!r}, expected Threads(), Processes() or Dask(...)")
    return executor


def add_to_run(run: ScoreRun, work: Sequence[Work]) -> None:
    """Problems in a row that are asked for the same metrics go in together."""
    for metrics, group in groupby(work, key=lambda one: one.metrics):
        same = list(group)
        run.add([one.problem for one in same], [one.index for one in same], list(metrics))


def core_count(name: str, count: int | None) -> int:
    """`count`, or for None all cores that this process may use; ValueError if below 1."""
    return len(os.sched_getaffinity(0)) if count is None else whole_number(name, count, 1)


def thread_count(threads: int | None) -> int:
    """`threads`, or for None all cores that this process may use; ValueError if below 1."""
    return core_count("threads", threads)
