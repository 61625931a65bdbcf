"""The scoring of beliefs: a belief is a question that is split into particles.

A belief costs as many simulation steps as a problem: the nodes of a tree are shared out among the
particles, and each rollout of a probability has a particle of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count, islice
from typing import TYPE_CHECKING

import numpy as np

from energymargin._core import Cancel, Problem, stream
from energymargin.base.checks import whole_number
from energymargin.base.errors import DivergedError
from energymargin.base.limits import Limit
from energymargin.base.metrics import TIMED
from energymargin.evaluate import searches
from energymargin.evaluate.asking import ask
from energymargin.evaluate.belief_scores import BeliefScore, BeliefScores
from energymargin.evaluate.divergence import ANY, too_many_diverged
from energymargin.evaluate.executors.choice import Executor
from energymargin.evaluate.executors.rows import Row, Work, counts, score_chunk
from energymargin.evaluate.scoring import ScoreError
from energymargin.model.beliefs.belief import Belief, Drawn, Particles
from energymargin.model.beliefs.sampling import MOST_PARTICLES, PARTICLES
from energymargin.model.beliefs.uncertainty import Source

if TYPE_CHECKING:
    from typing_extensions import Unpack

# Particle j of problem i has the stream of index i + j * 2^32: the first has that of the problem.
PARTICLE = 2**32
PIECE = 16  # draws between two looks at the clock


class Sharing:
    """How the steps of one problem are shared out among the particles of a belief."""

    def __init__(self, particles: int, settings: searches.SearchSettings) -> None:
        """`settings`: of the problem. Raises ValueError on particles below 1."""
        self.particles = whole_number("particles", particles, 1, MOST_PARTICLES)
        self.whole = settings
        nodes = max(1, settings.nodes // self.particles)
        self.settings = replace(settings, nodes=nodes, rollouts=1)
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
            text = "common_random_numbers is True, expected False with a belief"
            raise ValueError(f"{text}: all of its particles would meet one disturbance")


@dataclass(eq=False)
class BeliefWork:
    """What is asked of a belief about a problem: a question that is split into particles."""

    asked: Work
    """The problem, and the metrics."""
    belief: Callable[[int], Belief]
    """The belief about the problem of an index; it may raise ValueError."""
    sharing: Sharing
    sources: list[Source] = field(default_factory=list)
    draws: list[Drawn | None] = field(default_factory=list)
    error: str | None = None
    """Why it has no more particles."""

    def __len__(self) -> int:
        """How many particles it is to have, or has if there can be no more."""
        most = max(map(self.sharing.count, self.asked.metrics))
        return most if self.error is None else sum(one is not None for one in self.draws)

    def particles(self) -> Iterator[list[Work]]:
        """Its particles, a few at a time."""
        index, numbers = self.asked.index, count()
        try:
            whole_number("index", index, 0, PARTICLE - 1)
            belief = self.belief(index)
            self.sources = belief.sources
            draws = belief.draws(len(self), seed=stream(self.sharing.whole.seed, index))
            while piece := list(islice(draws, PIECE)):
                self.draws += piece
                yield [self._work(next(numbers), one.problem) for one in piece if one]
        except ValueError as error:
            self.error = str(error)

    def _work(self, number: int, problem: Problem) -> Work:
        metrics = tuple(m for m in self.asked.metrics if number < self.sharing.count(m))
        return Work(self.asked.index + number * PARTICLE, problem, metrics)

    def scores(self, there: Sequence[Row]) -> BeliefScores:
        """Those of the first particles."""
        particles = Particles.of(self.draws, self.sources)
        found = {m: self._score(m, there, particles) for m in self.asked.metrics}
        return BeliefScores(found, complete=len(there) == len(self))

    def _score(self, metric: str, there: Sequence[Row], particles: Particles) -> BeliefScore:
        rows = there[: self.sharing.count(metric)]
        values = np.array([row.scores.get(metric, np.nan) for row in rows])
        kept = [row for row, value in zip(rows, values, strict=True) if not np.isnan(value)]
        curves = [row.curves[metric] for row in kept if metric in row.curves]
        seconds = sum(row.times.get(metric, 0.0) for row in rows)
        mean = (curves[0][0], np.mean([own for _, own in curves], axis=0)) if curves else None
        return BeliefScore(metric, values, particles.first(len(rows)), seconds, mean)

    def row(self, rows: Sequence[Row]) -> Row:
        """Particles as one row, or what went wrong."""
        index = self.asked.index
        if self.error is not None:
            return Row(index, error=self.error)
        for number, row in enumerate(rows):
            if row.error:
                return Row(index, error=f"particle {number}: {row.error}")
        found, error = self.scores(rows), None
        for metric, one in found.items():
            if too_many_diverged(one.diverged, len(one.values)):
                which = f"the belief's {metric}"
                error = error or str(DivergedError(which, one.diverged, len(one.values)))
        return Row(
            index,
            error=error,
            scores={metric: one.mean for metric, one in found.items()},
            particles={metric: one.values for metric, one in found.items()},
            times={metric: one.seconds for metric, one in found.items()},
            curves={metric: one.curve for metric, one in found.items() if one.curve is not None},
            **counts(rows),
        )


particle_chunk = partial(score_chunk, most_diverged=ANY)
"""As score_chunk; a rollout that diverged has NaN."""


def score_belief(
    belief: Belief,
    metrics: Sequence[str] | None = None,
    *,
    particles: int = PARTICLES,
    settings: searches.SearchSettings | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    **loose: Unpack[searches.LooseSettings],
) -> BeliefScores:
    """Scores of a belief, at as many simulation steps as those of its problem.

    Args:
        belief: what is scored.
        metrics: of METRICS; None takes all that its problem has.
        particles: draws of the belief. Each has a tree of nodes / particles nodes, rounded down.
        settings: of the searches and probabilities. Each of the `rollouts` of a probability has a
            particle of its own.
        threads: None takes all cores that this process may use. Scores do not depend on them.
        executor: in place of threads, as of `em.score`.
        progress: progress(done, total) counts particles.
        timeout: after so many seconds the particles count that are finished, up to the first that
            is not, and `complete` is False. TimeoutError is raised if a metric has none.
        cancel: the same once it is set, with Cancelled.
        loose: the fields of SearchSettings by name, as nodes=100, in place of `settings`.

    Rollouts that diverge do not count: `diverged` of each score says how many. Raises ValueError on
    bad arguments, fewer nodes than particles, and common random numbers, which would be one number
    for all particles; ScoreError if the simulation of a particle failed, or more than one rollout
    and more than 1 % of them diverged.
    """
    limit = Limit(timeout, cancel)
    chosen = searches.chosen_settings(settings, **loose)
    metrics = searches.chosen_metrics([belief.problem], metrics, chosen)
    sharing = Sharing(particles, chosen)
    sharing.require(metrics)
    asked = BeliefWork(Work(0, belief.problem, tuple(metrics)), lambda _: belief, sharing)
    rows: list[Row] = []
    ask(
        *([[asked]], partial(particle_chunk, sharing.settings)),
        on_answers=lambda answers: rows.extend(answers[0][1]),
        split=BeliefWork.particles,
        join=lambda _, there: there,
        partly=True,
        total=len(asked),
        progress=progress,
        threads=threads,
        executor=executor,
        **limit.rest(),
    )
    if not rows:
        limit.require("a particle has all its scores")
    if error := asked.row(rows).error:
        raise ScoreError({0: error}, 1)
    return asked.scores(rows)
