"""Candidates as problems, with the particles that they meet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from energymargin._core import Problem
from energymargin.actions.trials import Trial
from energymargin.beliefs import Belief, Uncertainty

__all__ = ["Candidates", "check_uncertainty"]


def check_uncertainty(uncertainty: Uncertainty | None) -> None:
    """Raises ValueError on another thing."""
    if not (uncertainty is None or isinstance(uncertainty, Uncertainty)):
        raise ValueError(
            f"uncertainty is {uncertainty!r}, expected an em.beliefs.Uncertainty or None"
        )


class Candidates:
    """Problems that are compared; with an uncertainty draw j of each has particle j of it."""

    def __init__(
        self, problems: Sequence[Problem], uncertainty: Uncertainty | None, seed: int
    ) -> None:
        """`seed`: of the particles, so that all candidates have the same. Raises ValueError on an
        uncertainty that names what a problem does not have."""
        check_uncertainty(uncertainty)
        self._problems, self._seed = list(problems), seed
        self._beliefs: list[Belief] | None = None
        if uncertainty is not None:
            self._beliefs = [Belief(problem, uncertainty=uncertainty) for problem in problems]

    def __len__(self) -> int:
        """How many."""
        return len(self._problems)

    def __iter__(self) -> Iterator[Problem]:
        """The problems."""
        return iter(self._problems)

    def trial(self, candidate: int, first: int, count: int) -> Trial:
        """So many draws of a candidate from number `first` on."""
        if self._beliefs is None:
            return Trial(candidate, (self._problems[candidate],), first, count)
        particles = self._beliefs[candidate].particles(first + count, seed=self._seed)
        return Trial(candidate, tuple(particles.problems[first:]), first, count)
