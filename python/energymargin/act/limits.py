"""Several quantities of one problem, by name: how much of each can it take, which is tightest?"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, overload

import numpy as np

from energymargin._core import Problem
from energymargin.act.critical import CriticalValue, critical_value
from energymargin.base.checks import check_type, one_of, shown
from energymargin.base.summary import Summarized
from energymargin.evaluate.searches import algorithm

KINDS = ("push", "horizon", "friction.BODY", "mass.BODY", "x.BODY", "y.BODY", "z.BODY")
AXES = "xyz"


@dataclass(frozen=True)
class Quantity:
    """One of a problem that can be varied."""

    name: str
    unit: str
    nominal: float
    """What the problem has."""
    problem: Callable[[float], Problem]
    """The problem with another value."""


def quantity_of(problem: Problem, name: str) -> Quantity:
    """A quantity by its name.

    "push" is the largest force of a disturbance [N], of which its forces and torques are scaled;
    "horizon" [s], in whole steps; "friction.BODY"; "mass.BODY" [kg]; "x.BODY", "y.BODY" and
    "z.BODY" move a free body along an axis of the world by so much [m]. Raises ValueError on
    another name, and a body that has no such quantity.
    """
    kind, _, body = name.partition(".")
    one_of("vary", f"{kind}.BODY" if body else kind, KINDS)
    if kind == "horizon":
        if problem.horizon is None:
            raise ValueError("vary is 'horizon', and the problem has none: replace(horizon=1.0)")
        step = problem.scene.step

        def over(value: float) -> Problem:
            return problem.replace(horizon=max(1, round(value / step)) * step)

        return Quantity(name, "s", problem.horizon, over)
    if kind == "push":
        force, torque = np.array(problem.force), np.array(problem.torque)
        most = float(force.max())
        if most == 0.0:
            raise ValueError("vary is 'push', and the problem has no force")

        def pushed(value: float) -> Problem:
            return problem.replace(force=force * (value / most), torque=torque * (value / most))

        return Quantity(name, "N", most, pushed)
    bodies = {one.name: one for one in problem.scene.bodies}
    one_of("vary", body, tuple(bodies))
    if kind in AXES:
        return Quantity(name, "m", 0.0, _moved(problem, body, AXES.index(kind)))

    def changed(value: float) -> Problem:
        return problem.replace(scene=problem.scene.with_body(body, **{kind: value}))

    unit = "kg" if kind == "mass" else ""
    return Quantity(name, unit, float(getattr(bodies[body], kind)), changed)


def _moved(problem: Problem, body: str, axis: int) -> Callable[[float], Problem]:
    scene = problem.scene
    there = scene.unpack(problem.state).get(body, {})
    if len(there.get("position", ())) <= axis:
        raise ValueError(
            f"vary is '{AXES[axis]}.{body}', along which that body does not move freely"
        )

    def moved(value: float) -> Problem:
        position = np.array(there["position"], dtype=float)
        before = scene.pack(**{body: {"position": position}})
        position[axis] += value
        return problem.with_state(
            problem.state + scene.pack(**{body: {"position": position}}) - before
        )

    return moved


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

    def __iter__(self) -> Iterator[CriticalValue]:
        """Each."""
        return iter(self.found)

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
        each = [
            {
                **{f.name: getattr(one, f.name) for f in fields(one) if f.name != "outcomes"},
                "nominal": nominal,
                "margin": margin,
                "outcomes": one.outcomes.tolist(),
            }
            for one, nominal, margin in zip(self.found, self.nominals, self.margins, strict=True)
        ]
        whole = {"question": self.question, "algorithm": algorithm(), "quantities": each}
        return json.dumps(_finite(whole), indent=1)


def critical_values(
    problem: Problem, vary: Mapping[str, tuple[float, float]], **asked: Any
) -> CriticalValues:
    """How much of each of several quantities a problem can take, one varied at a time.

    `vary`: ranges by the quantities' names: "push" [N], "horizon" [s], "friction.BODY", "mass.BODY"
    [kg], "x.BODY", "y.BODY" and "z.BODY" [m]. `asked`: as of `em.critical_value`, which says what
    comes out, and its errors; `timeout` is of each.
    """
    check_type("problem", problem, Problem, "a Problem")
    if not isinstance(vary, Mapping) or not vary:
        raise ValueError(f"vary is {shown(vary)}, expected ranges by name, {{'push': (0.1, 20)}}")
    quantities = [quantity_of(problem, name) for name in vary]
    found = [
        critical_value(one.problem, one.name, vary[one.name], unit=one.unit, **asked)
        for one in quantities
    ]
    first = found[0]
    question = (
        f"Asked: captured for {problem.horizon:g} s with probability {first.probability:g}; "
        f"intervals of {first.confidence:g}; engine {problem.scene.engine}; seed "
        f"{asked.get('seed', 0)}; algorithm {algorithm()}."
    )
    return CriticalValues(tuple(found), tuple(one.nominal for one in quantities), question)


def _margin(one: CriticalValue, nominal: float) -> float:
    if one.side in ("everywhere", "nowhere"):
        return np.inf if one.side == "everywhere" else -np.inf
    size = abs(nominal) or one.range[1] - one.range[0]
    away = [
        (value - nominal if side == "below" else nominal - value) / size
        for value, _, _, side in one.crossings
    ]
    return min(away, key=abs, default=np.nan)


def _finite(value: Any) -> Any:
    """The same with null in place of numbers that JSON does not have."""
    if isinstance(value, dict):
        return {name: _finite(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
