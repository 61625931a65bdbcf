"""Pools of workers that run jobs: threads, processes, or a cluster's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

__all__ = ["POLL", "STOP", "Job", "Outcome", "Pool", "Stopped"]

POLL = 0.05  # s; how long a stop may stay unnoticed

STOP = -1
"""To a worker process, in place of a job's number."""

Stopped = Callable[[], bool]
"""A job calls it now and then: True once nobody waits for its result, so that it returns early."""

Job = Callable[[Any, Stopped], Any]
"""What a worker runs: a function of a module that it can import, of a payload that can be pickled.
"""


@dataclass(frozen=True)
class Outcome:
    """How one job ended."""

    job: int
    """The number under which it was submitted."""
    value: Any = None
    """What the function returned."""
    error: Exception | None = None
    """What the function raised."""
    died: str = ""
    """How its worker died; empty if it did not."""


class Pool(Protocol):
    """Workers that run jobs; close it, or use it in a `with` statement.

    If a worker dies, its job comes back with `died`, and another worker takes its place. The jobs
    that waited behind that job run elsewhere.
    """

    @property
    def slots(self) -> int:
        """How many jobs can run at once; of a cluster, right now."""
        ...

    def submit(self, job: int, function: Job, payload: Any) -> None:
        """Puts a job at the end of the queue; `job` is a number of the caller's."""
        ...

    def take(self, timeout: float) -> list[Outcome]:
        """Jobs that ended since the last call; waits up to `timeout` [s] for the first."""
        ...

    def stop(self, timeout: float) -> list[Outcome]:
        """Tells every job to return, and takes what comes within `timeout` [s]."""
        ...

    def close(self) -> None:
        """Ends the workers that the pool has started, whatever they do."""
        ...
