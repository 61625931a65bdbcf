"""What a pool of workers is: it runs jobs elsewhere, and says of each what became of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

__all__ = ["STOP", "Job", "Outcome", "Pool", "Stopped"]

STOP = -1
"""To a worker, in place of a job's number: what runs is to return early."""

Stopped = Callable[[], bool]
"""Asked by a job now and then: whether nobody waits for more of it, so that it returns early."""

Job = Callable[[Any, Stopped], Any]
"""What a worker runs: a function of a module that it can import, of a payload that can be pickled.
"""


@dataclass(frozen=True)
class Outcome:
    """What became of one job."""

    job: int
    """The number under which it was submitted."""
    value: Any = None
    """What the function returned."""
    error: Exception | None = None
    """What the function raised."""
    died: str = ""
    """How the worker died that ran it; empty if it did not."""


class Pool(Protocol):
    """Workers that run jobs; close it, or use it in a `with` statement.

    A job whose worker dies is handed back, and the pool goes on with another worker. Jobs that
    waited behind it are run elsewhere, and nobody hears of it.
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
