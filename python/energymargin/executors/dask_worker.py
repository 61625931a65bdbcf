"""What a worker of a Dask cluster does for a DaskPool.

Everything goes to and fro as pickled bytes, so that Dask's scheduler needs no energymargin, and a
worker without it fails in the task, where the driver hears of it.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from typing import Any, Literal

from energymargin.executors.jobs import Job
from energymargin.executors.worker import sendable

__all__ = ["Answer", "Task", "installed_release", "stop_pool", "work"]

Answer = tuple[Literal["value", "error", "stopped", "skipped", "refused"], bytes]
"""What became of a task, and the pickled value, error or words; `stopped` goes with a value of a
job that was told that nobody waits for it, `skipped` with none.
"""

# A task that is still wanted: Dask gives it other states when its key is cancelled or released.
_WANTED = ("executing", "long-running")
_ENDING = ("closing", "closed", "failed")
_stopped_pools: set[str] = set()


@cache
def installed_release() -> str:
    """The version of energymargin that is installed here."""
    return version("energymargin")


def stop_pool(pool: str) -> None:
    """Tells the jobs of a pool that run on this worker, and those that come, to return."""
    _stopped_pools.add(pool)


class Task:
    """Pickles into a call of `work`: `pickle.loads` of it runs it, and gives the Answer."""

    def __init__(self, pool: str, release: str, release_of: Callable[[], str], job: bytes) -> None:
        """`release` is what `release_of` must say on the worker; `job` as in `work`."""
        self._arguments = (pool, release, release_of, job)

    def __reduce__(self) -> tuple[Callable[..., Answer], tuple[Any, ...]]:
        """What to call where it is unpickled."""
        return work, self._arguments


def work(pool: str, release: str, release_of: Callable[[], str], job: bytes) -> Answer:
    """Runs a job, in a task of a Dask worker; `job` is a pickled pair of function and payload."""
    from distributed import get_worker

    worker = get_worker()
    if release_of() != release:
        words = f"the worker {worker.address} has release {release_of()}, and this is {release}"
        return "refused", pickle.dumps(words)
    if pool in _stopped_pools:
        return "skipped", b""
    stopped = _Stopped(pool, worker)
    try:
        function: Job
        function, payload = pickle.loads(job)
        value = pickle.dumps(function(payload, stopped))
    except Exception as error:
        return "error", pickle.dumps(sendable(error))
    return "stopped" if stopped.seen else "value", value


class _Stopped:
    """Whether nobody waits for the task that runs in this thread: a Stopped."""

    def __init__(self, pool: str, worker: Any) -> None:
        self.seen = False
        self._pool = pool
        self._worker = worker
        self._task = worker.state.tasks[worker.get_current_task()]

    def __call__(self) -> bool:
        self.seen = self.seen or (
            self._pool in _stopped_pools
            or self._task.state not in _WANTED
            or self._worker.status.name in _ENDING
        )
        return self.seen
