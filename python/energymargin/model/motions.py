"""Motions of a kinematic body, as rows of a plan: lift, turn, shake, hold.

Each is an array (K, 6), a row for each step: velocity [m/s] and angular velocity [rad/s] along the
world's axes. Motions follow each other by `np.concatenate`, and the body stands at both ends.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from energymargin.base.aliases import Floats
from energymargin.base.checks import numbers_of, positive_number
from energymargin.base.doors import check_doors

__all__ = ["STEP", "hold", "lift", "shake", "turn"]

STEP = 1 / 240
"""Default duration of a row [s], the default step of a scene."""


def hold(duration: float, *, step: float = STEP) -> Floats:
    """Stands still for a duration [s]."""
    return np.zeros((len(_times(duration, step)) - 1, 6))


def lift(
    height: float, duration: float, *, direction: ArrayLike = (0.0, 0.0, 1.0), step: float = STEP
) -> Floats:
    """Moves by a height [m] along a direction, shape (3,), in a duration [s], with the least jerk.

    Raises ValueError on a duration that is not above 0 and a direction of no length.
    """
    way = _least_jerk(_times(duration, step) / duration) * float(height)
    return _rows(way, _unit("direction", direction), np.zeros(3), step)


def turn(axis: ArrayLike, angle: float, duration: float, *, step: float = STEP) -> Floats:
    """Turns by an angle [rad] about an axis, shape (3,), through the origin of the body's frame, in
    a duration [s], with the least jerk.

    Raises ValueError on a duration that is not above 0 and an axis of no length.
    """
    way = _least_jerk(_times(duration, step) / duration) * float(angle)
    return _rows(way, np.zeros(3), _unit("axis", axis), step)


def shake(
    axis: ArrayLike,
    amplitude: float,
    frequency: float,
    duration: float,
    *,
    about: bool = False,
    step: float = STEP,
) -> Floats:
    """Swings to and fro along an axis, shape (3,), or about it.

    Args:
        axis: along which or about which it swings.
        amplitude: [m], or [rad] about the axis.
        frequency: [Hz]
        duration: of all swings [s]. The first period swells, the last one dies away.
        about: about the axis rather than along it.
        step: duration of a row [s].

    Raises ValueError on a duration shorter than two periods, and bad numbers.
    """
    positive_number("frequency", frequency)
    if duration * frequency < 2:
        expected = f"expected at least two periods, {2 / frequency:g} s"
        raise ValueError(f"duration is {duration:g} s, {expected}")
    times = _times(duration, step)
    swell = np.clip(np.minimum(times, duration - times) * frequency, 0, 1)
    way = float(amplitude) * _least_jerk(swell) * np.sin(2 * np.pi * frequency * times)
    unit, none = _unit("axis", axis), np.zeros(3)
    return _rows(way, none, unit, step) if about else _rows(way, unit, none, step)


def _times(duration: float, step: float) -> Floats:
    """Ends of the rows, from 0 to about the duration."""
    positive_number("duration", duration)
    positive_number("step", step)
    return np.linspace(0, duration, max(1, round(duration / step)) + 1)


def _least_jerk(share: Floats) -> Floats:
    """From 0 to 1 with velocity and acceleration 0 at both ends."""
    return np.asarray(share**3 * (10 - 15 * share + 6 * share**2))


def _rows(way: Floats, along: Floats, about: Floats, step: float) -> Floats:
    return np.outer(np.diff(way) / step, np.concatenate([along, about]))


def _unit(name: str, axis: ArrayLike) -> Floats:
    vector = numbers_of(name, axis, "three finite numbers", (3,))
    length = float(np.linalg.norm(vector))
    if length == 0:
        raise ValueError(f"{name} is {vector.tolist()}, expected one of some length")
    return np.asarray(vector / length)


check_doors(globals(), __all__)
