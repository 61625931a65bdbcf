"""How many rollouts a score may take, so that it is there before the next state comes."""

from __future__ import annotations

from energymargin.checks import whole_number

__all__ = ["Pace", "checked_rollouts"]

SHARE = 0.7  # of a period that a score takes; the rest is for what else the machine does
MEMORY = 0.8  # of the mean cost, from one score to the next
FASTEST = 2.0  # times as many rollouts as before, at most


class Pace:
    """The number of rollouts of the next score: fixed, or as many as fit into a period.

    It is chosen before a score begins, from what those before it took. A score that was cut short
    in its course would count too few of the rollouts that last long, those that stay captured.
    """

    def __init__(self, rollouts: int | tuple[int, int], period: float) -> None:
        """`rollouts`: a number, or the least and the most; `period` [s].

        Raises ValueError on others.
        """
        self._least, self._most = checked_rollouts(rollouts)
        self._budget = SHARE * period
        self._cost: float | None = None  # s, of a rollout, a running mean
        self.rollouts = self._least
        """Of the next score."""

    def note(self, rollouts: int, asking: float, scoring: float) -> None:
        """What a score took [s]: `asking` for the problem, and `scoring` its `rollouts`."""
        cost = scoring / max(rollouts, 1)
        mean = cost if self._cost is None else MEMORY * self._cost + (1 - MEMORY) * cost
        self._cost = mean
        fitting = int(max(self._budget - asking, 0.0) / max(mean, cost, 1e-9))
        growing = int(FASTEST * self.rollouts)
        self.rollouts = min(max(min(fitting, growing), self._least), self._most)


def checked_rollouts(rollouts: int | tuple[int, int]) -> tuple[int, int]:
    """(least, most) of a number of rollouts, or of these two; ValueError on others."""
    if not isinstance(rollouts, tuple):
        count = whole_number("rollouts", rollouts, 1)
        return count, count
    if len(rollouts) != 2:
        raise ValueError(f"rollouts is {rollouts!r}, expected a number, or (least, most)")
    least = whole_number("rollouts", rollouts[0], 1)
    return least, whole_number("rollouts", rollouts[1], least)
