"""Particles of several beliefs with common draws: particle j is the same one for each of them.

The draws are independent, where those of a single belief are quasi-random: a test that may end at
any draw asks for that. A draw that cannot be for one of the beliefs is made again for all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from energymargin._core import Problem
from energymargin.beliefs.belief import OPEN, TRIES, Belief

__all__ = ["CommonParticle", "common_particles"]

AT_FIRST = 10  # particles whose tries are granted before the first one is there


class CommonParticle(NamedTuple):
    """One draw of what is not known."""

    number: int
    """Of the draw, those among them that cannot be."""
    problems: tuple[Problem, ...]
    """With it, one of each belief."""


def common_particles(beliefs: Sequence[Belief], seed: int) -> Iterator[CommonParticle]:
    """Particles of beliefs in which the same is uncertain, without end.

    Raises ValueError on beliefs in which something else is uncertain, and if hardly any draw can be
    for all of them.
    """
    _check_alike(beliefs)
    random, refused = np.random.default_rng(seed), np.zeros(len(beliefs), dtype=int)
    number = made = 0
    while number - made < TRIES * (made + AT_FIRST):
        point = np.clip(random.random(beliefs[0].dimension), *OPEN)
        found = [belief.particle(point) for belief in beliefs]
        problems = tuple(one[0] for one in found if one is not None)
        if len(problems) == len(beliefs):
            made += 1
            yield CommonParticle(number, problems)
        refused += [one is None for one in found]
        number += 1
    raise ValueError(
        f"{refused.max()} of {number} draws of the uncertainty have no place or a friction or mass "
        f"below 0 in problem number {refused.argmax()}, expected smaller errors"
    )


def _check_alike(beliefs: Sequence[Belief]) -> None:
    first, *others = ([(s.name, s.inputs) for s in belief.sources] for belief in beliefs)
    for number, other in enumerate(others, 1):
        if other != first:
            raise ValueError(
                f"uncertainty is of {_said(first)} in problem number 0, of {_said(other)} in "
                f"number {number}, expected the same bodies in the same order"
            )


def _said(sources: Sequence[tuple[str, tuple[str, ...]]]) -> str:
    return ", ".join(f"{name} ({', '.join(inputs)})" for name, inputs in sources) or "nothing"
