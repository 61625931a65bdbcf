"""Scores in processes of this machine."""

from __future__ import annotations

from dataclasses import dataclass

from energymargin.executors.chunks import PoolSession
from energymargin.executors.process_pool import ProcessPool
from energymargin.executors.threads import core_count
from energymargin.settings import SearchSettings

__all__ = ["Processes"]


@dataclass(frozen=True)
class Processes:
    """Processes of this machine: one that crashes costs no more than a second of its work.

    Problems are sent to them as JSON, so regions made of a Python predicate need threads.
    """

    count: int | None = None
    """How many; None is one for each core that this process may use."""

    def __post_init__(self) -> None:
        """Raises ValueError if `count` is below 1."""
        core_count("processes", self.count)

    def session(self, settings: SearchSettings) -> PoolSession:
        """As Executor.session."""
        return PoolSession(ProcessPool(core_count("processes", self.count)), settings)
