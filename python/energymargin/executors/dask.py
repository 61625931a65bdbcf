"""Scores on the workers of a Dask cluster."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from energymargin.executors.pool_session import PoolSession
from energymargin.searches import SearchSettings, algorithm

if TYPE_CHECKING:
    from distributed import Client

    from energymargin.executors.dask_pool import DaskPool

__all__ = ["Dask"]


@dataclass(frozen=True)
class Dask:
    """The workers of a Dask cluster; each of their threads scores a problem at a time.

    Needs the extra [cluster], here and on the workers. Problems are sent to them as JSON, so
    regions made of a Python predicate need threads.
    """

    scheduler: str | Client
    """Its address, such as tcp://127.0.0.1:8786, or a Client."""
    notice: Callable[[str], None] | None = None
    """Called with a line of text if there are no workers, one died, or the scheduler is away."""

    def __post_init__(self) -> None:
        """Raises ValueError on a string that is no address."""
        if isinstance(self.scheduler, str) and not re.search(r"[\w\]]:\d+$", self.scheduler):
            raise ValueError(
                f"scheduler is {self.scheduler!r}, expected an address such as tcp://127.0.0.1:8786"
            )

    def pool(self) -> DaskPool:
        """As Executor.pool. Raises ConnectionError if there is no scheduler."""
        from energymargin.executors.dask_pool import DaskPool

        return DaskPool(self.scheduler, release_of=algorithm, notice=self.notice)

    def session(self, settings: SearchSettings) -> PoolSession:
        """As Executor.session. Raises ConnectionError if there is no scheduler."""
        return PoolSession(self.pool(), settings)
