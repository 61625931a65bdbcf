"""When a long computation ends: after a time, or once another thread sets a Cancel."""

from __future__ import annotations

import time
from typing import TypedDict

from energymargin._core import Cancel, Cancelled
from energymargin.base.checks import check_type, positive_number

SOON = 1e-6  # s; the shortest time that is left


class Rest(TypedDict):
    """The time that is left and the cancel, as keywords of an inner call."""

    timeout: float | None
    cancel: Cancel | None


class Limit:
    """The limit of a call that begins now, and of its inner calls. Once reached it stays so."""

    def __init__(self, timeout: float | None = None, cancel: Cancel | None = None) -> None:
        """`timeout` [s]; None is never. Raises ValueError unless it is finite and above 0, and on
        another cancel than a Cancel."""
        if timeout is not None:
            positive_number("timeout", timeout)
        check_type("cancel", cancel, Cancel | None, "an em.Cancel or None")
        self._end = None if timeout is None else time.monotonic() + timeout
        self._cancel = cancel

    @property
    def cancelled(self) -> bool:
        """Whether its cancel is set."""
        return self._cancel is not None and self._cancel.is_set

    @property
    def reached(self) -> bool:
        """Whether its time is over, or its cancel is set."""
        return self.cancelled or (self._end is not None and time.monotonic() >= self._end)

    def require(self, what: str) -> None:
        """Raises Cancelled or TimeoutError if it is reached before `what` is done."""
        if self.cancelled:
            raise Cancelled(f"cancelled before {what}")
        if self.reached:
            raise TimeoutError(f"the time was over before {what}")

    def rest(self) -> Rest:
        """The time that is left [s], and the cancel."""
        left = None if self._end is None else max(self._end - time.monotonic(), SOON)
        return Rest(timeout=left, cancel=self._cancel)
