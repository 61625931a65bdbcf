"""What `em.improve` finds: the plan, how sure it is to be better, and how it came about."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Plan, Problem
from energymargin.actions.racing import Duel, duel
from energymargin.actions.ranking import Ranking, Standing
from energymargin.metrics import value_text
from energymargin.notebook import shown_by
from energymargin.reprs import short_repr
from energymargin.table_text import csv_text, markdown_table

__all__ = ["Generation", "Improvement"]

START = "start"


@dataclass(frozen=True, eq=False)
class Generation:
    """Plans that were compared on the same draws."""

    __repr__ = short_repr

    points: NDArray[np.float64]
    """Their parameters in the unit cube, shape (P, D)."""
    scores: NDArray[np.float64]
    """Shape (P,): a probability, or the median effort [J]; NaN of those that cannot be."""
    best: int
    """Number of the best."""
    factor: float
    """How many times as strong as stated the disturbance was."""
    favourite: NDArray[np.float64]
    """What the strategy would bet on after it, shape (D,)."""


@dataclass(frozen=True, eq=False)
class Improvement:
    """The best plan that was found."""

    _repr_html_ = shown_by("improvement")

    values: dict[str, float]
    """Its parameters."""
    start: dict[str, float]
    """Those that it began with."""
    problem: Problem
    """The question with this plan."""
    ranking: Ranking
    """The last comparison, on new draws: the strategy's favourite, the best of the last
    generations, and the start. Its best is the result."""
    generations: tuple[Generation, ...]
    ranges: dict[str, tuple[float, float]]
    """Lowest and highest value of each parameter, in the order of the columns of their points."""
    steps: int
    """Simulation steps."""
    complete: bool
    """Whether the search came to its end: False if the timeout or the cancel came first."""

    def __repr__(self) -> str:
        """Scores before and after."""
        return f"Improvement({self.decision})"

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the columns of the points."""
        return tuple(self.ranges)

    @property
    def plan(self) -> Plan | None:
        """Of the problem."""
        return self.problem.plan

    @property
    def before(self) -> Standing:
        """The start, in the last comparison."""
        return self.ranking[START]

    @property
    def after(self) -> Standing:
        """The result, in the last comparison."""
        return self.ranking.standings[0]

    @property
    def sure(self) -> float:
        """Confidence that the result is better than the start."""
        return self._duel.better

    @property
    def decision(self) -> str:
        """One sentence for people."""
        metric = self.ranking.metric
        before, after = (value_text(metric, s.score) for s in (self.before, self.after))
        if self.ranking.best == START:
            return f"the start is the best that was found: {metric} {before}"
        return (
            f"{metric} {before} at the start, {after} with the plan that was found; of "
            f"{self._duel.draws} draws it gains {self._duel.wins} and loses {self._duel.losses}"
        )

    def to_markdown(self) -> str:
        """Parameters and scores before and after, and the last comparison."""
        rows = [
            [name, f"{self.start[name]:.4g}", f"{self.values[name]:.4g}"] for name in self.values
        ]
        table = markdown_table(["parameter", "start", "found"], rows)
        decision = f"{self.decision[0].upper()}{self.decision[1:]}."
        return f"{table}\n\n{decision}\n\n{self.ranking.to_markdown()}"

    def to_csv(self) -> str:
        """A line for each plan that was tried, in full precision: generation, the factor of the
        disturbance, the score, the values of the parameters."""
        low, high = np.array(list(self.ranges.values())).T
        rows = [
            (number, one.factor, score, *values)
            for number, one in enumerate(self.generations, 1)
            for score, values in zip(
                one.scores.tolist(), (low + one.points * (high - low)).tolist(), strict=True
            )
        ]
        return csv_text(("generation", "factor", "score", *self.parameters), rows)

    @cached_property
    def _duel(self) -> Duel:
        return duel(self.after.values, self.before.values)
