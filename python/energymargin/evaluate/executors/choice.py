"""What an executor is, and which one is chosen."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future
from functools import cached_property
from typing import Any, ClassVar, Protocol
from weakref import WeakSet

from energymargin.base.checks import usable_cores
from energymargin.base.errors import ExecutorError
from energymargin.evaluate.executors.threads import Threads
from energymargin.evaluate.parallel import Done, Function, RemoteWorkers, Workers


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
        slots = getattr(executor, "_max_workers", None) or usable_cores()
        return _Given(lambda: executor, int(slots))
    if isinstance(executor, type) or not callable(getattr(executor, "workers", None)):
        raise ValueError(
            f"executor is {executor!r}, expected Threads(), Processes(), Dask(...) or an Executor "
            "of concurrent.futures"
        )
    return executor


class _Given(RemoteWorkers):
    """The workers of somebody else's Executor, as mpi4py's MPIPoolExecutor: they stay when the work
    is done, and are not replaced if they die. None of their work waits in the executor's queue, as
    what is there cannot always be cancelled."""

    ahead: ClassVar[int] = 1
    deaths = ()

    def workers(self) -> Workers:
        """As Executor.workers."""
        return self

    def submit(
        self, function: Function[Any, Any], items: Sequence[Any], left: float | None
    ) -> Future[Done]:
        """As Workers.submit. Raises ExecutorError if the executor is broken, or shut down."""
        try:
            future = super().submit(function, items, left)
        except RuntimeError as error:
            raise ExecutorError(_text(error)) from error
        self._submitted.add(future)
        return future

    @cached_property
    def _submitted(self) -> WeakSet[Future[Done]]:
        return WeakSet()

    def stop(self) -> None:
        """As Workers.stop; a chunk that is at work runs to its end, or the limit of the call."""
        for future in self._submitted:
            future.cancel()

    def explained(self, error: Exception) -> Exception:
        """As Workers.explained."""
        lost = isinstance(error, (BrokenExecutor, CancelledError))
        return ExecutorError(_text(error)) if lost else error


def _text(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
