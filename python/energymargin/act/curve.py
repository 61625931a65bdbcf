"""The line between held and lost: how much it can take of a quantity, along another one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Cancelled, Problem
from energymargin.act.critical import CriticalValue, Progress, critical_value, going_on
from energymargin.act.scale import Scale
from energymargin.base.checks import function_of, share, shown, whole_number
from energymargin.base.limits import Limit
from energymargin.base.reprs import Record
from energymargin.base.summary import Summarized

POINTS = 9

Axis = tuple[str, tuple[float, float]] | tuple[str, tuple[float, float], str]
"""A quantity's name, its range, and its unit if it has one."""


@dataclass(frozen=True, eq=False, repr=False)
class CriticalCurve(Record, Summarized):
    """Critical values of one quantity along another."""

    quantity: str
    """The one along which it goes."""
    unit: str
    values: NDArray[np.float64]
    """Of that, rising, shape (N,)."""
    found: tuple[CriticalValue, ...]
    """How much of the other one it can take at each."""
    confidence: float
    """With which all N intervals together cover the curve."""

    @property
    def curve(self) -> NDArray[np.float64]:
        """Critical values, shape (N,); NaN where there is none in the range."""
        return np.array([one.value for one in self.found])

    @property
    def band(self) -> NDArray[np.float64]:
        """(low, high) at each value, shape (N, 2); NaN where it holds everywhere or nowhere."""
        return np.array([one.interval() for one in self.found])

    @property
    def complete(self) -> bool:
        """Whether every search came to its end."""
        return all(one.complete for one in self.found)


def critical_curve(
    problem_of: Callable[[float, float], Problem],
    along: Axis,
    of: Axis,
    *,
    points: int = POINTS,
    confidence: float = 0.95,
    progress: Progress | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    **asked: Any,
) -> CriticalCurve:
    """The line between held and lost in the plane of two quantities, with its band.

    Args:
        problem_of: problem_of(a, b) makes the Problem of a value of each, with a horizon.
        along: name and range of the first quantity, and its unit: ("mass", (0.05, 2), "kg").
        of: likewise of the second one, whose critical value is searched for.
        points: values of the first; evenly apart, or by ratio if the range's ends are.
        confidence: with which the band covers the curve at all points together.
        progress: progress(done, total) counts rollouts; the total grows with each search.
        timeout: after so many seconds [s] the last points have what is known by then.
        cancel: the same once it is set.
        asked: as of `em.critical_value`, which says what each point is, and its errors.
    """
    function_of("problem_of", problem_of, "a", "b")
    (name, ends, unit), (other, range_, other_unit) = _axis("along", along), _axis("of", of)
    count, scale = whole_number("points", points, 2), Scale.of(ends)
    if share("confidence", confidence) == 0.0:
        raise ValueError(f"confidence is {confidence:g}, expected a number between 0 and 1")
    limit = Limit(timeout, cancel)
    found: list[CriticalValue] = []
    values = [scale.value(u) for u in np.linspace(0.0, 1.0, count)]
    for value in values:
        given: dict[str, Any] = {**asked, **limit.rest(), "unit": other_unit}
        given["progress"] = going_on(progress, found)
        given["confidence"] = 1.0 - (1.0 - confidence) / count
        try:
            one = critical_value(partial(problem_of, value), other, range_, **given)
        except (Cancelled, TimeoutError):
            if not found:
                raise
            one = CriticalValue.unknown(other, other_unit, range_, like=found[0])
        found.append(one)
    return CriticalCurve(name, unit, np.array(values), tuple(found), confidence)


def _axis(name: str, given: Axis) -> tuple[str, tuple[float, float], str]:
    if not isinstance(given, tuple) or len(given) not in (2, 3) or not isinstance(given[0], str):
        raise ValueError(
            f"{name} is {shown(given)}, expected a name, a range and perhaps a unit: "
            "('mass', (0.05, 2), 'kg')"
        )
    return given if len(given) == 3 else (*given, "")
