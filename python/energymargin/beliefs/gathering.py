"""Beliefs as work for an executor: particles go out, and the rows of a belief are gathered.

A belief costs as many simulation steps as a problem: the nodes of a tree are shared out among the
particles, and each rollout of a probability has a particle of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from energymargin._core import stream
from energymargin.beliefs.belief import Belief, Particles
from energymargin.beliefs.uncertainty import MOST_PARTICLES
from energymargin.checks import whole_number
from energymargin.executors import Row
from energymargin.executors.rows import Curve, Work
from energymargin.metrics import TIMED
from energymargin.searches import SearchSettings

# Particle j of problem i has the stream of index i + j * 2^32: the first has that of the problem.
PARTICLE = 2**32

Part = tuple[NDArray[np.float64], Particles, float, Curve | None]
"""A metric's scores of the particles (N,), the particles, computing time [s], the mean curve."""


class Sharing:
    """How the steps of one problem are shared out among the particles of a belief."""

    def __init__(self, particles: int, settings: SearchSettings) -> None:
        """`settings`: of the problem. Raises ValueError on particles below 1."""
        self.particles = whole_number("particles", particles, 1, MOST_PARTICLES)
        self.whole = settings
        self.settings = replace(
            settings, nodes=max(1, settings.nodes // self.particles), rollouts=1
        )
        """Settings of a particle."""

    def count(self, metric: str) -> int:
        """Particles of a metric."""
        return self.whole.rollouts if metric in TIMED else self.particles

    def require(self, metrics: Sequence[str]) -> None:
        """Raises ValueError on metrics that cannot be shared out with these settings."""
        searched = set(metrics) - {*TIMED, "force"}
        if searched and self.whole.nodes < self.particles:
            raise ValueError(
                f"nodes is {self.whole.nodes}, expected one at least for each of "
                f"{self.particles} particles"
            )
        if self.whole.common_random_numbers and set(metrics) & set(TIMED):
            raise ValueError(
                "common_random_numbers is True, expected False with a belief: all of its particles "
                "would meet one disturbance"
            )


@dataclass(eq=False)
class _Gathered:
    """A belief whose particles are scored."""

    asked: Work
    """Its problem, and what is asked of it."""
    particles: Particles
    rows: dict[int, Row] = field(default_factory=dict)
    """By the number of the particle."""


class ParticleSource:
    """Batches of work: the particles of beliefs, drawn when they are needed."""

    def __init__(
        self,
        batches: Iterable[Sequence[Work]],
        belief: Callable[[int], Belief],
        sharing: Sharing,
        *,
        keep: bool = True,
    ) -> None:
        """The beliefs about the problems of some batches, by their indices; `keep` what is gathered
        of them, for `found`."""
        self._batches, self._belief, self._sharing = batches, belief, sharing
        self._keep = keep
        self._failed: list[Row] = []
        self._beliefs: dict[int, _Gathered] = {}

    def __iter__(self) -> Iterator[list[Work]]:
        """The particles of one belief after the other."""
        for batch in self._batches:
            if not batch:
                yield []
            for asked in batch:
                yield list(self._work(asked))

    def gathered(self, rows: Sequence[Row]) -> list[Row]:
        """The rows of beliefs that are complete by these rows of particles, or failed."""
        done, self._failed = self._failed, []
        for row in rows:
            index, number = row.index % PARTICLE, row.index // PARTICLE
            belief = self._beliefs[index]
            belief.rows[number] = row
            if len(belief.rows) == len(belief.particles):
                done.append(self._row(belief))
                if not self._keep:
                    del self._beliefs[index]
        return done

    def found(self) -> dict[int, tuple[dict[str, Part], bool]]:
        """By index, of each belief with a particle: its parts by metric, up to the first particle
        that is missing, and whether none is."""
        parts = {index: self._parts(belief) for index, belief in self._beliefs.items()}
        return {
            index: (own, len(self._beliefs[index].rows) == len(self._beliefs[index].particles))
            for index, own in parts.items()
            if own
        }

    def _work(self, asked: Work) -> Iterator[Work]:
        whole_number("index", asked.index, 0, PARTICLE - 1)
        count = max(map(self._sharing.count, asked.metrics))
        try:
            seed = stream(self._sharing.whole.seed, asked.index)
            particles = self._belief(asked.index).particles(count, seed=seed)
        except ValueError as error:
            self._failed.append(Row(asked.index, error=str(error)))
            return
        self._beliefs[asked.index] = _Gathered(asked, particles)
        for number, problem in enumerate(particles.problems):
            metrics = tuple(m for m in asked.metrics if number < self._sharing.count(m))
            yield Work(asked.index + number * PARTICLE, problem, metrics)

    def _row(self, belief: _Gathered) -> Row:
        index = belief.asked.index
        rows = [belief.rows[number] for number in sorted(belief.rows)]
        for number, row in enumerate(rows):
            if row.error:
                return Row(index, error=f"particle {number}: {row.error}")
        parts = self._parts(belief)
        return Row(
            index,
            scores={metric: float(values.mean()) for metric, (values, *_) in parts.items()},
            particles={metric: values for metric, (values, *_) in parts.items()},
            times={metric: seconds for metric, (_, _, seconds, _) in parts.items()},
            curves={metric: curve for metric, (*_, curve) in parts.items() if curve is not None},
            steps=sum(row.steps for row in rows),
            unconverged=sum(row.unconverged for row in rows),
            lost_time=sum(row.lost_time for row in rows),
            warnings=tuple(dict.fromkeys(text for row in rows for text in row.warnings)),
        )

    def _parts(self, belief: _Gathered) -> dict[str, Part]:
        there: list[Row] = []
        while len(there) in belief.rows:
            there.append(belief.rows[len(there)])
        if not there:
            return {}
        return {
            metric: _part(metric, belief.particles, there[: self._sharing.count(metric)])
            for metric in belief.asked.metrics
        }


def _part(metric: str, particles: Particles, rows: Sequence[Row]) -> Part:
    curves = [row.curves[metric] for row in rows if metric in row.curves]
    return (
        np.array([row.scores.get(metric, np.nan) for row in rows]),
        particles.first(len(rows)),
        sum(row.times.get(metric, 0.0) for row in rows),
        (curves[0][0], np.mean([of_one for _, of_one in curves], axis=0)) if curves else None,
    )
