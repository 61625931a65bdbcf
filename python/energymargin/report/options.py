"""What a report shows of its scores, and how they are judged."""

from __future__ import annotations

from dataclasses import dataclass

from energymargin.evaluation.bootstrap import DRAWS
from energymargin.evaluation.labelled import HORIZON, LAST_FRAMES
from energymargin.tasks.base import whole_number

__all__ = ["Options"]

_LEAST = {"trajectories": 1, "pictures": 0, "last": 1, "draws": 1, "seed": 0}


@dataclass(frozen=True)
class Options:
    """The choices of who writes a report. Raises ValueError on what cannot be."""

    trajectories: int = 30
    """At most so many are shown, half of them those that the scores get most wrong."""
    pictures: int = 2
    """So many states of each score and label, whose searches are grown again."""
    horizon: int | None = None
    """Frames that the label "captured" of curves, histograms and pictures looks ahead; None looks
    as far as the scores do, which is HORIZON for those without one of their own, or as far as the
    longest trajectory goes."""
    last: int = LAST_FRAMES
    """As of `evaluate`; so are the next two."""
    draws: int = DRAWS
    seed: int = 0

    def __post_init__(self) -> None:
        """Checks each of them."""
        for name, least in _LEAST.items():
            whole_number(name, getattr(self, name), least)
        if self.horizon is not None:
            whole_number("horizon", self.horizon, 0)

    def horizon_of(self, ahead: int, scored: int | None = None) -> int:
        """The horizon, where no state has more than `ahead` frames after its own, of scores that
        look `scored` frames ahead. Raises ValueError if it is longer than that."""
        if self.horizon is None:
            return min(HORIZON if scored is None else scored, ahead)
        if self.horizon > ahead:
            raise ValueError(
                f"horizon is {self.horizon}, expected 0 to {ahead}: the longest trajectory has "
                f"{ahead + 1} frames"
            )
        return self.horizon
