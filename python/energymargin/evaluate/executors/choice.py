"""What an executor is, and which one is chosen."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Collection
from concurrent.futures import Future
from typing import ClassVar, Protocol

from energymargin.base.checks import usable_cores
from energymargin.evaluate.executors.threads import Threads
from energymargin.evaluate.parallel import Done, RemoteWorkers, Workers


class Executor(Protocol):
    """Where work is done: `Threads`, `Processes` or `Dask`."""

    def workers(self) -> Workers:
        """Its workers, which start with their first work."""
        ...


def chosen_executor(
    executor: Executor | concurrent.futures.Executor | None, threads: int | None = None
) -> Executor:
    """`executor`, or for None so many threads; ValueError if it is none, or both are given."""
    if executor is None:
        return Threads(threads)
    if threads is not None:
        raise ValueError(f"threads is {threads}, expected None with an executor")
    if isinstance(executor, concurrent.futures.Executor):
        return _Given(executor)
    if isinstance(executor, type) or not callable(getattr(executor, "workers", None)):
        raise ValueError(
            f"executor is {executor!r}, expected Threads(), Processes(), Dask(...) or an Executor "
            "of concurrent.futures"
        )
    return executor


class _Given(RemoteWorkers):
    """The workers of somebody else's Executor, as mpi4py's MPIPoolExecutor: they stay when the work
    is done. None of their work waits in the executor's queue, as what is there cannot always be
    cancelled."""

    ahead: ClassVar[int] = 1

    def __init__(self, executor: concurrent.futures.Executor) -> None:
        super().__init__(int(getattr(executor, "_max_workers", None) or usable_cores()))
        self._executor = executor

    def workers(self) -> Workers:
        """As Executor.workers."""
        return self

    def stop(self, chunks: Collection[Future[Done]]) -> None:
        """As Workers.stop; a chunk that is at work runs to its end, or the limit of the call."""
        for chunk in chunks:
            chunk.cancel()

    def close(self) -> None:
        """Leaves them as they are."""
