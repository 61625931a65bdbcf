"""A trajectory of a manipulation, recorded in frames, with its labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Contact
from energymargin.base.checks import check_shape
from energymargin.base.reprs import Record
from energymargin.base.summary import Summarized


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Record, Summarized):
    """K recorded frames of one manipulation, with the labels of Section VI-D.

    Raises ValueError on arrays of other shapes.
    """

    times: NDArray[np.float64]
    """Time of each frame [s], shape (K,)."""
    states: NDArray[np.float64]
    """State vector of each frame, shape (K, n)."""
    contacts: Sequence[list[Contact]]
    """Contacts and their forces in each frame, K lists."""
    captured: NDArray[np.bool_]
    """Whether each state lies in its own capture set, shape (K,); all objects in theirs."""
    success: bool
    """Whether the last state lies in the success set; all objects in theirs."""
    params: dict[str, float]
    """Parameters that were drawn for this trajectory, such as the friction; problems need them."""
    seed: int
    """`task.rollout(seed)` gives this trajectory again."""
    captured_any: NDArray[np.bool_] | None = None
    """Whether at least one object is in its capture set, shape (K,); None: one set for all."""
    success_any: bool | None = None
    """Whether at least one object ends in its success set; None: one set for all."""

    def __post_init__(self) -> None:
        """Checks the shapes."""
        frames = len(self.times)
        check_shape("times", self.times, (frames,))
        check_shape("states", self.states, (frames, *np.shape(self.states)[1:2]))
        for name in ("captured", "captured_any"):
            labels = getattr(self, name)
            if labels is not None:
                check_shape(name, labels, (frames,), bool)
        if frames == 0 or np.ndim(self.states) != 2:
            raise ValueError(f"states has shape {np.shape(self.states)}, expected (K, n), K > 0")
        if len(self.contacts) != frames:
            raise ValueError(f"contacts has {len(self.contacts)} lists, expected one a frame")

    def __len__(self) -> int:
        """K, the number of frames."""
        return len(self.times)
