"""Work on the threads of this process."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

from energymargin._core import Cancel
from energymargin.base.checks import core_count
from energymargin.evaluate.parallel import Done, Function, Workers, work


@dataclass(frozen=True)
class Threads:
    """Threads of this process: nothing to set up, the default. Scores do not depend on them."""

    count: int | None = None
    """How many; None takes all cores that this process may use."""

    def __post_init__(self) -> None:
        """Raises ValueError if `count` is below 1."""
        core_count("threads", self.count)

    def workers(self) -> Workers:
        """As Executor.workers."""
        return _ThreadWorkers(core_count("threads", self.count))


class _ThreadWorkers(Workers):
    """Threads, none of which dies."""

    chunk: ClassVar[float] = 0.2

    def __init__(self, threads: int) -> None:
        super().__init__(partial(ThreadPoolExecutor, threads), threads)
        self._cancel = Cancel()

    def submit(
        self, function: Function[Any, Any], items: Sequence[Any], left: float | None
    ) -> Future[Done]:
        """As Workers.submit; `stop` ends what runs, whatever is `left`."""
        done: Future[Done] = Future()
        job = partial(_work_once, done, iter([True]), function, items, self._cancel)
        try:
            queued = self.executor().submit(job)
            queued.add_done_callback(lambda left: done.cancel() if left.cancelled() else None)
        except RuntimeError:  # no thread can start, but the pool may have one already
            job()
        return done

    def stop(self) -> None:
        """As Workers.stop."""
        self._cancel.set()
        super().stop()
        self._cancel = Cancel()


def _work_once(
    done: Future[Done],
    turns: Iterator[bool],
    function: Function[Any, Any],
    items: Sequence[Any],
    cancel: Cancel,
) -> None:
    """Does the work for whoever comes first."""
    if not next(turns, False) or not done.set_running_or_notify_cancel():
        return
    try:
        done.set_result(work(function, items, cancel))
    except BaseException as error:
        done.set_exception(error)
