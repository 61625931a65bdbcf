"""Several quantities of one problem: how much of each can it take, which is tightest?"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, overload

import numpy as np

from energymargin._core import Cancel, Cancelled, Problem
from energymargin.act.critical import CriticalValue, Progress, critical_value, going_on
from energymargin.act.quantities import Quantity, quantity_of
from energymargin.base.checks import check_type, shown
from energymargin.base.limits import Limit
from energymargin.base.summary import Summarized
from energymargin.evaluate.searches import algorithm


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
    if not isinstance(vary, Mapping) or not vary:
        raise ValueError(f"vary is {shown(vary)}, expected ranges by name, {{'push': (0.1, 20)}}")
    limit = Limit(timeout, cancel)
    quantities = {q if isinstance(q, Quantity) else quantity_of(problem, q): vary[q] for q in vary}
    found: list[CriticalValue] = []
    for one, ends in quantities.items():
        given: dict[str, Any] = {**asked, **limit.rest(), "unit": one.unit}
        given["progress"] = going_on(progress, found)
        try:
            found.append(critical_value(one.problem, one.name, ends, **given))
        except (Cancelled, TimeoutError):
            if not found:
                raise
            found.append(CriticalValue.unknown(one.name, one.unit, ends, like=found[0]))
    first, engine = found[0], problem.scene.engine
    question = (
        f"Asked: captured for {problem.horizon:g} s with probability {first.probability:g}; "
        f"intervals of {first.confidence:g}; engine {getattr(engine, 'name', engine)}; seed "
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
