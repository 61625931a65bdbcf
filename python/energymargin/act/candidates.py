"""Candidates that are compared: their names, what they have in common, where each stands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Problem
from energymargin.base.checks import shown
from energymargin.base.reprs import Record


@dataclass(frozen=True, eq=False, repr=False)
class Standing(Record):
    """Where one candidate stands."""

    name: str
    values: NDArray[np.float64]
    """Values of its draws, shape (N,): 1 or 0 of a probability, or efforts [J]; NaN of a rollout
    that diverged, which does not count."""
    mean_survival: float
    """Mean time that it stays captured, as a share of the horizon; of efforts the share of the
    searches that found no escape."""
    score: float
    """The probability, or the median of the efforts [J]."""
    low: float
    """Lower end of a 95 % interval of the score."""
    high: float
    """Upper end of the interval."""
    steps: int
    """Simulation steps that it took."""
    racing: bool
    """Whether it ran to the end. The others left: another one is better, or they can hardly be
    better than the one that led."""

    @property
    def value(self) -> float:
        """As `score`."""
        return self.score

    @property
    def draws(self) -> int:
        """N."""
        return len(self.values)

    @property
    def diverged(self) -> int:
        """Rollouts that diverged: they are among the draws, and do not count."""
        return int(np.isnan(self.values).sum())


def named(problems: object, plans: object = None) -> dict[str, Problem]:
    """Problems by name, or one with each of several plans; those of a list by their numbers. Raises
    ValueError on none."""
    if plans is not None and not isinstance(problems, Problem):
        expected = "expected one Problem, which gets each of them"
        way = "problems that have plans of their own come without plans="
        raise ValueError(f"problems is {shown(problems)} beside plans, {expected}; {way}")
    argument, several = ("problems", problems) if plans is None else ("plans", plans)
    if not isinstance(several, (Mapping, Sequence)) or isinstance(several, str):
        way = "; for plans of one problem: em.rank(problem, {'left': plan, 'right': other})"
        expected = f"several, as a list or a dict{way * isinstance(several, Problem)}"
        raise ValueError(f"{argument} is {shown(several)}, expected {expected}")
    if not several:
        raise ValueError(f"{argument} is empty, expected one at least")
    field: dict[str, Problem] = {}
    for name, one in several.items() if isinstance(several, Mapping) else enumerate(several):
        if str(name) in field:
            twice = f"has the name {str(name)!r} twice, expected different names"
            raise ValueError(f"{argument} {twice}")
        field[str(name)] = problems.replace(plan=one) if isinstance(problems, Problem) else one
    return field


def check_alike(metric: str, field: Mapping[str, Problem]) -> None:
    """Raises ValueError on a candidate that would not meet the disturbances of the first one, or
    not for as long. `field`: the candidates, by what a message calls them."""
    first, *others = field
    expected = _met(metric, field[first])
    for name in others:
        for what, theirs in _met(metric, field[name]).items():
            if theirs != expected[what]:
                known = f"{first} {shown(expected[what])}"
                why = "expected the same: candidates meet the same disturbances"
                raise ValueError(f"{name} has {what} {shown(theirs)}, {known}, {why}")


def _met(metric: str, problem: Problem) -> dict[str, object]:
    """What the disturbances of a problem depend on."""
    return {
        "the step": problem.scene.step,
        "the objects": [body.name for body in problem.scene.bodies if body.role == "object"],
        "the force bounds": np.asarray(problem.force).tolist(),
        "the torque bounds": np.asarray(problem.torque).tolist(),
        "the duration": problem.duration,
        "the horizon": None if metric == "probability/success" else problem.horizon,
    }
