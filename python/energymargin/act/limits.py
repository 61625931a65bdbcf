"""Several critical values: of a problem's quantities by name, and of one quantity along another."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from numbers import Real
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Problem
from energymargin.act.critical import CriticalValue, Progress, one_after_the_other
from energymargin.act.quantities import Quantity, Scale, quantity_of
from energymargin.base.checks import check_type, function_of, open_share, require, whole_number
from energymargin.base.limits import Limit
from energymargin.base.summary import Summarized
from energymargin.evaluate.searches import algorithm
from energymargin.model.beliefs.uncertainty import Uncertainty

LASTING = ("horizon", "speed")  # quantities that change the horizon
Axis = tuple[str, tuple[float, float]] | tuple[str, tuple[float, float], str]
"""A quantity's name, its range, and its unit if it has one."""


@dataclass(frozen=True, eq=False)
class CriticalValues(Sequence[CriticalValue], Summarized):
    """Critical values of several quantities, in the order in which they were named."""

    found: tuple[CriticalValue, ...]
    nominals: tuple[float, ...]
    """What the problem has of each."""
    question: str
    """What was asked, in words."""

    @overload
    def __getitem__(self, place: int) -> CriticalValue: ...
    @overload
    def __getitem__(self, place: slice) -> Sequence[CriticalValue]: ...
    def __getitem__(self, place: int | slice) -> CriticalValue | Sequence[CriticalValue]:
        """One, or some."""
        return self.found[place]

    def __len__(self) -> int:
        """How many."""
        return len(self.found)

    @property
    def complete(self) -> bool:
        """Whether every search came to its end."""
        return all(one.complete for one in self.found)

    @property
    def margins(self) -> tuple[float, ...]:
        """How far each nominal value is from the nearest critical one, as a share of the nominal
        value, or of the range where that is 0: below 0 if it does not hold; infinite if it holds
        in the whole range, -infinite if nowhere; NaN if nothing can be said."""
        return tuple(map(_margin, self.found, self.nominals))

    @property
    def tightest(self) -> CriticalValue | None:
        """The one of the least margin; None if none has any."""
        known = [(m, k) for k, m in enumerate(self.margins) if not np.isnan(m)]
        return self.found[min(known)[1]] if known else None

    def to_json(self) -> str:
        """All of it: what was asked, and each quantity with its values."""
        each = []
        for one, nominal, margin in zip(self.found, self.nominals, self.margins, strict=True):
            row: dict[str, Any] = dict(vars(one))
            rest = {"nominal": nominal, "margin": margin, "outcomes": row.pop("outcomes").tolist()}
            each.append(row | rest)
        whole = {"question": self.question, "algorithm": algorithm(), "quantities": each}
        # JSON has no NaN and no infinity: they are null.
        return json.dumps(json.loads(json.dumps(whole), parse_constant=lambda _: None), indent=1)


@dataclass(frozen=True, eq=False, repr=False)
class CriticalCurve(Summarized):
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


def critical_values(
    problem: Problem,
    vary: Mapping[Any, tuple[float, float]],
    *,
    progress: Progress | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    **asked: Any,
) -> CriticalValues:
    """How much of each of several quantities a problem can take, one varied at a time.

    Args:
        problem: the one that is varied.
        vary: ranges by the quantities' names, as of `quantity_of`: "push" [N], "horizon" [s],
            "speed", "delay" [s], "gain", "friction.BODY", "friction.BODY,BODY", "mass.BODY" [kg],
            "force.JOINT", "x.BODY" to "z.BODY" [m], "rx.BODY" to "rz.BODY" [rad]; or a Quantity of
            your own.
        progress: progress(done, total) counts rollouts; the total grows with each search.
        timeout: after so many seconds [s] the quantities have what is known by then.
        cancel: the same once it is set.
        asked: as of `em.critical_value`, which says what comes out, and its errors.
    """
    check_type("problem", problem, Problem, "a Problem")
    require(isinstance(vary, Mapping) and vary, "vary", vary, "ranges by name, {'push': (0.1, 20)}")
    for name in vary:
        if not isinstance(name, str | Quantity):
            raise TypeError(f"vary has the name {name!r}, expected a str or a Quantity")
    limit = Limit(timeout, cancel)
    varied = {q if isinstance(q, Quantity) else quantity_of(problem, q): vary[q] for q in vary}
    if isinstance(known := asked.get("uncertainty"), Uncertainty):
        for one in varied:
            _require_not_drawn(problem, one.name, known)
    searches = [(one.problem, one.name, ends, one.unit) for one, ends in varied.items()]
    found = one_after_the_other(searches, progress, limit, asked)
    first, engine = found[0], problem.scene.engine
    what = f"{_asked_for(problem, varied, asked)} with probability {first.probability:g}"
    engine = f"engine {getattr(engine, 'name', engine)}; seed {asked.get('seed', 0)}"
    sure = f"intervals of {first.confidence:g}; {engine}; algorithm {algorithm()}"
    return CriticalValues(found, tuple(one.nominal for one in varied), f"Asked: {what}; {sure}.")


def critical_curve(
    problem_of: Callable[[float, float], Problem],
    along: Axis,
    of: Axis,
    *,
    points: int = 9,
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
    (name, ends, unit), (other, asked_range, other_unit) = _axis("along", along), _axis("of", of)
    count, scale, limit = whole_number("points", points, 2), Scale.of(ends), Limit(timeout, cancel)
    asked["confidence"] = 1.0 - (1.0 - open_share("confidence", confidence)) / count
    values = [scale.value(u) for u in np.linspace(0.0, 1.0, count)]
    searches = [(partial(problem_of, value), other, asked_range, other_unit) for value in values]
    found = one_after_the_other(searches, progress, limit, asked)
    return CriticalCurve(name, unit, np.array(values), found, confidence)


def _asked_for(problem: Problem, varied: Iterable[Quantity], asked: Mapping[str, Any]) -> str:
    success = asked.get("metric") == "probability/success"
    lasting = problem.horizon is None or any(one.name in LASTING for one in varied)
    time = "its horizon" if lasting else f"{problem.horizon:g} s"
    return f"{'success within' if success else 'captured for'} {time}"


def _require_not_drawn(problem: Problem, name: str, known: Uncertainty) -> None:
    """Raises ValueError if an uncertainty has the distribution of a quantity itself: its draws
    would be the same at each value."""
    kind, _, of = name.partition(".")
    objects = [body.name for body in problem.scene.bodies if body.role == "object"]
    drawn = (known.engine or {}).get(name)
    if drawn is None and kind in ("friction", "mass"):
        drawn = getattr(known, kind)
        if not isinstance(drawn, Mapping):
            drawn = drawn if of in objects else None
    for part in of.split(","):
        drawn = drawn.get(part) if isinstance(drawn, Mapping) else drawn
    if not isinstance(drawn, Real | Mapping | None):
        why = "whose distribution uncertainty gives whatever the value is"
        raise ValueError(f"vary is {name!r}, {why}, expected a standard deviation there")


def _margin(one: CriticalValue, nominal: float) -> float:
    if one.side in ("everywhere", "nowhere"):
        return np.inf if one.side == "everywhere" else -np.inf
    size = abs(nominal) or one.range[1] - one.range[0]
    signs = {"below": 1.0, "above": -1.0}
    away = [signs[side] * (value - nominal) / size for value, _, _, side in one.crossings]
    return min(away, key=abs, default=np.nan)


def _axis(name: str, given: Axis) -> tuple[str, tuple[float, float], str]:
    right = isinstance(given, tuple) and len(given) in (2, 3) and isinstance(given[0], str)
    require(right, name, given, "a name, a range and perhaps a unit: ('mass', (0.05, 2), 'kg')")
    return given if len(given) == 3 else (*given, "")
