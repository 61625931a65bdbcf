"""One grasp, a hand on its way to it, and what became of its trials."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin.grasps.hands import Fitted

ENDINGS = ("held", "slipped", "turned", "not gripped", "collided", "diverged")
NO_GRIP = {
    "collided": "is in the object or the table",
    "not gripped": "does not close on the object",
    "diverged": "diverges as it closes",
}

Pose = NDArray[np.float64]
State = NDArray[np.float64]


class Grasp(NamedTuple):
    """One grasp."""

    number: int
    pose: Pose
    """The grasp frame in the object's frame, (4, 4)."""
    opening: float
    """Of the hand before it closes [m]; NaN: as wide as it opens."""
    placed: Pose
    """The object's frame in the world's, (4, 4)."""


class Outcome(NamedTuple):
    """What became of one trial."""

    ending: str
    """One of ENDINGS."""
    time: float = np.nan
    """When it was lost, after the hand had closed [s]; inf: it was held, NaN: it did not grip."""
    redrawn: int = 0
    """Poses that were drawn again, since the hand was inside the object or the table."""
    back: float = 0.0
    """How far the hand was moved back along its approach, out of what it was in [m]."""
    steps: int = 0
    """Of the simulation, while the hand closes and later."""
    unconverged: int = 0
    """Of these, steps whose contact solver did not converge."""
    lost_time: float = 0.0
    """In which nothing moved, as bodies would have passed through each other [s]."""


class Closed(NamedTuple):
    """A hand that has closed, or why it could not."""

    hand: Fitted
    state: State
    """Where the hand closed; if it had no place, or diverged, where it began, open."""
    base: Pose
    """The frame of the hand's base, (4, 4)."""
    thing: Pose
    """The object's axes about its centre of mass in the frame of the hand's base, (4, 4)."""
    outcome: Outcome
    """Of the trial so far; `ending` is "" if all of its fingers press on the object."""

    @property
    def ending(self) -> str:
        """That of the outcome."""
        return self.outcome.ending


class HandStart(NamedTuple):
    """A hand where it begins to close."""

    state: State | None
    """None: the hand was inside the object or the table, and found no place."""
    redrawn: int = 0
    back: float = 0.0
