"""Work on the threads of this process."""

from __future__ import annotations

from collections.abc import Collection
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import ClassVar

from energymargin._core import Cancel
from energymargin.base.checks import core_count
from energymargin.evaluate.parallel import Chunk, Done, Workers


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
    seconds: ClassVar[float] = 0.2

    def __init__(self, threads: int) -> None:
        super().__init__(threads)
        self._executor, self._cancel = ThreadPoolExecutor(threads), Cancel()

    def submit(self, chunk: Chunk) -> Future[Done]:
        """As Workers.submit; `stop` ends what runs, whatever is left of the time."""
        try:
            return self._executor.submit(chunk.work, self._cancel)
        except RuntimeError:  # no thread can start
            done: Future[Done] = Future()
            done.set_result(chunk.work(self._cancel))
            return done

    def stop(self, chunks: Collection[Future[Done]]) -> None:
        """As Workers.stop."""
        self._cancel.set()
        for chunk in chunks:
            chunk.cancel()
        self.close()
        self._executor, self._cancel = ThreadPoolExecutor(self.slots), Cancel()

    def close(self) -> None:
        """Ends them."""
        self._executor.shutdown()
