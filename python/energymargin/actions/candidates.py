"""Candidates as problems, with the particles that they meet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice

from energymargin._core import Problem
from energymargin.actions.trials import Trial
from energymargin.beliefs import Belief, Uncertainty
from energymargin.beliefs.belief import CommonParticle, common_particles

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
        """`seed`: of the particles. Raises ValueError on an uncertainty that names what a problem
        does not have, or that is of other bodies in each."""
        check_uncertainty(uncertainty)
        self._problems = list(problems)
        self._particles: list[CommonParticle] = []
        self._more: Iterator[CommonParticle] | None = None
        if uncertainty is not None and problems:
            beliefs = [Belief(problem, uncertainty=uncertainty) for problem in problems]
            self._more = common_particles(beliefs, seed)

    def __len__(self) -> int:
        """How many."""
        return len(self._problems)

    def __iter__(self) -> Iterator[Problem]:
        """The problems."""
        return iter(self._problems)

    def trial(self, candidate: int, first: int, count: int) -> Trial:
        """So many draws of a candidate from number `first` on."""
        if self._more is None:
            return Trial(candidate, (self._problems[candidate],), first, count)
        self._particles += islice(self._more, max(first + count - len(self._particles), 0))
        own = self._particles[first : first + count]
        problems = tuple(particle.problems[candidate] for particle in own)
        particles = tuple(particle.number for particle in own)
        return Trial(candidate, problems, first, count, particles)
