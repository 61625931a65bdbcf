"""Results of workers as they come, until all are there, a limit is reached, or Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from energymargin.interrupts import held_interrupts
from energymargin.limits import Limit

__all__ = ["Workers", "collect"]

Result = TypeVar("Result")
Result_co = TypeVar("Result_co", covariant=True)


class Workers(Protocol[Result_co]):
    """Threads, processes or a cluster, and the work that they do."""

    @property
    def busy(self) -> bool:
        """Whether there is work to hand out, or a result to come."""
        ...

    def step(self) -> Sequence[Result_co]:
        """Hands out work as far as there is room; returns results that came, after a short wait."""
        ...

    def stop(self) -> Sequence[Result_co]:
        """Ends what runs; returns the results that are finished."""
        ...


def collect(
    workers: Workers[Result], deliver: Callable[[Sequence[Result]], None], limit: Limit
) -> bool:
    """Delivers results as they come, in this thread; returns whether that was all, False if the
    limit came first.

    On Ctrl-C the results that are finished are delivered, and KeyboardInterrupt is raised; so with
    any other error, which is then raised.
    """
    with held_interrupts() as interrupted:
        try:
            while workers.busy and not (interrupted.is_set() or limit.reached):
                deliver(workers.step())
        finally:
            deliver(workers.stop())
    if interrupted.is_set():
        raise KeyboardInterrupt
    return not workers.busy
