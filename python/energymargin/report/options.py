"""What a report shows of its scores, and how they are judged."""

from __future__ import annotations

from dataclasses import dataclass

from energymargin.evaluation import DRAWS, HORIZON, LAST_FRAMES
from energymargin.tasks.base import whole_number

__all__ = ["Options"]

_LEAST = {
    **{"trajectories": 1, "pictures": 0},
    **{"horizon": 0, "last": 1, "draws": 1, "seed": 0},
}


@dataclass(frozen=True)
class Options:
    """The choices of who writes a report. Raises ValueError on what cannot be."""

    trajectories: int = 30
    """At most so many are shown, half of them those that the scores get most wrong."""
    pictures: int = 2
    """So many states of each score and label, whose searches are grown again."""
    horizon: int = HORIZON
    """Frames that the label "captured" of curves, histograms and pictures looks ahead."""
    last: int = LAST_FRAMES
    """As of `evaluate`; so are the next two."""
    draws: int = DRAWS
    seed: int = 0

    def __post_init__(self) -> None:
        """Checks each of them."""
        for name, least in _LEAST.items():
            whole_number(name, getattr(self, name), least)
