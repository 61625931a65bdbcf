"""The trees that are kept in memory, by trajectory and frame."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from energymargin.viewer.search import Scored

__all__ = ["Kept"]

MOST = 2_000_000  # nodes: half a gigabyte of states of one object and effector

Place = tuple[int, int]  # trajectory, frame


class Kept:
    """Scored states; once there are too many nodes the oldest go."""

    def __init__(self) -> None:
        """None yet."""
        self._scored: OrderedDict[Place, Scored] = OrderedDict()
        self._nodes = 0

    def put(self, place: Place, scored: Scored, shown: Place | None = None) -> None:
        """Keeps it, instead of what was there; `shown` is not among those that go for it."""
        if place in self._scored:
            self._nodes -= self._scored.pop(place).size
        self._scored[place] = scored
        self._nodes += scored.size
        while self._nodes > MOST:
            oldest = next((one for one in self._scored if one not in (place, shown)), None)
            if oldest is None:
                return
            self._nodes -= self._scored.pop(oldest).size

    def at(self, trajectory: int, frame: int) -> Scored | None:
        """None if it is not there."""
        return self._scored.get((trajectory, frame))

    def along(
        self, trajectory: int, frames: int, names: Iterable[str], nodes: int, rate: float
    ) -> dict[str, NDArray[np.float64]]:
        """Scores of so many frames by name, shape (frames,), of the first `nodes` nodes at that
        lambda [1/J]; NaN where there is no tree."""
        values = {name: np.full(frames, np.nan) for name in names}
        for (which, frame), scored in self._scored.items():
            if which == trajectory:
                scores = scored.values(nodes, rate)
                for name, row in values.items():
                    row[frame] = scores.get(name, np.nan)
        return values
