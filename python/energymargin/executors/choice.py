"""What an executor is, and which one is chosen."""

from __future__ import annotations

import concurrent.futures
import os
from typing import Protocol

from energymargin.executors.threads import Threads
from energymargin.parallel import RemoteWorkers, Workers


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
        slots = getattr(executor, "_max_workers", None) or os.cpu_count() or 1
        return _Given(lambda: executor, int(slots))
    if isinstance(executor, type) or not callable(getattr(executor, "workers", None)):
        raise ValueError(
            f"executor is {executor!r}, expected Threads(), Processes(), Dask(...) or an Executor "
            "of concurrent.futures"
        )
    return executor


class _Given(RemoteWorkers):
    """The workers of somebody else's Executor, as mpi4py's MPIPoolExecutor: they stay when the work
    is done."""

    def workers(self) -> Workers:
        """As Executor.workers."""
        return self

    def stop(self) -> None:
        """As Workers.stop."""
