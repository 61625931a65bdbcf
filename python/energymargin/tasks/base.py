"""What a manipulation task is: it makes trajectories, and it turns a state into a problem.

A task is found by its name: a package registers its class under the entry point group
`energymargin.tasks`, and the class says what it is in the first line of its docstring.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Contact, Problem

__all__ = ["Task", "Trajectory", "whole_number"]


@dataclass(frozen=True)
class Trajectory:
    """K recorded frames of one manipulation, with the labels of Section VI-D."""

    times: NDArray[np.float64]
    """Time of each frame [s], shape (K,)."""
    states: NDArray[np.float64]
    """State vector of each frame, shape (K, n)."""
    contacts: list[list[Contact]]
    """Contacts and their forces in each frame, K lists."""
    captured: NDArray[np.bool_]
    """Whether each state lies in its own capture set, shape (K,)."""
    success: bool
    """Whether the last state lies in the success set."""
    params: dict[str, float]
    """What was drawn for this trajectory alone, such as the friction: a problem needs it again."""
    seed: int
    """`task.rollout(seed)` gives this trajectory again."""

    def __len__(self) -> int:
        """K, the number of frames."""
        return len(self.times)


class Task(Protocol):
    """A manipulation task; its constructor's keywords are its parameters."""

    name: str

    @property
    def parameters(self) -> dict[str, Any]:
        """The keywords that make this task again; numbers, strings and None."""
        ...

    def rollout(self, seed: int, frames: int = 10) -> Trajectory:
        """One random trajectory, the same for the same seed."""
        ...

    def problem(
        self,
        state: NDArray[np.float64],
        params: Mapping[str, float] | None = None,
        contacts: Sequence[Contact] | None = None,
    ) -> Problem:
        """How robust is the manipulation at this state, shape (n,)?

        `params` and `contacts` are those that the trajectory recorded.
        """
        ...


def whole_number(name: str, value: int, least: int, most: int | None = None) -> int:
    """`value`, if it is a whole number from `least` to `most`; else a ValueError with `name`."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if whole and value >= least and (most is None or value <= most):
        return int(value)
    expected = f"of at least {least}" if most is None else f"from {least} to {most}"
    raise ValueError(f"{name} is {value!r}, expected a whole number {expected}")
