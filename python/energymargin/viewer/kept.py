"""The trees that are kept in memory, by trajectory and frame."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from cachetools import LRUCache
from numpy.typing import NDArray

from energymargin.viewer.search import Scored

__all__ = ["Kept"]

MOST = 2_000_000  # nodes: half a gigabyte of states of one object and effector

Place = tuple[int, int]  # trajectory, frame


class Kept:
    """Scored states; once there are too many nodes, those go that were not looked at for longest.

    One with more nodes than there may be is kept alone.
    """

    def __init__(self) -> None:
        """None yet."""
        self._scored: LRUCache[Place, Scored] = LRUCache(MOST, lambda one: min(one.size, MOST))

    def put(self, place: Place, scored: Scored) -> None:
        """Keeps it, instead of what was there."""
        self._scored[place] = scored

    def at(self, trajectory: int, frame: int) -> Scored | None:
        """None if it is not there."""
        return self._scored.get((trajectory, frame))

    def along(
        self, trajectory: int, frames: int, names: Iterable[str], nodes: int, rate: float
    ) -> dict[str, NDArray[np.float64]]:
        """Scores of so many frames by name, shape (frames,), of the first `nodes` nodes at that
        lambda [1/J]; NaN where there is no tree."""
        values = {name: np.full(frames, np.nan) for name in names}
        for frame in range(frames):
            scored = self.at(trajectory, frame)
            if scored is not None:
                scores = scored.values(nodes, rate)
                for name, row in values.items():
                    row[frame] = scores.get(name, np.nan)
        return values
