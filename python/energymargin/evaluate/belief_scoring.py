"""The scoring of beliefs: particles go out to workers, and the rows of a belief are gathered.

A belief costs as many simulation steps as a problem: the nodes of a tree are shared out among the
particles, and each rollout of a probability has a particle of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count, islice, takewhile
from typing import TYPE_CHECKING

import numpy as np

from energymargin._core import Cancel, Problem, stream
from energymargin.base.checks import whole_number
from energymargin.base.errors import DivergedError
from energymargin.base.limits import Limit
from energymargin.base.metrics import TIMED
from energymargin.evaluate.belief_scores import BeliefScore, BeliefScores
from energymargin.evaluate.divergence import ANY, too_many_diverged
from energymargin.evaluate.executors import Executor, Row
from energymargin.evaluate.executors.choice import chosen_executor
from energymargin.evaluate.executors.rows import Work, score_chunk
from energymargin.evaluate.parallel import run
from energymargin.evaluate.scoring import ScoreError
from energymargin.evaluate.searches import (
    LooseSettings,
    SearchSettings,
    chosen_metrics,
    chosen_settings,
)
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
    sources: list[Source]
    sharing: Sharing
    count: int
    """How many particles it will have."""
    draws: list[Drawn | None] = field(default_factory=list)
    rows: dict[int, Row] = field(default_factory=dict)
    """By the number of the particle."""

    @property
    def complete(self) -> bool:
        """Whether every particle has its scores."""
        return len(self.rows) == self.count

    def scores(self) -> BeliefScores:
        """Those of the particles up to the first one that is missing."""
        there = [self.rows[number] for number in takewhile(self.rows.__contains__, count())]
        if not there:
            return BeliefScores({}, complete=False)
        particles = Particles.of(self.draws, self.sources)
        found = {m: self._score(m, there, particles) for m in self.asked.metrics}
        return BeliefScores(found, self.complete)

    def _score(self, metric: str, there: Sequence[Row], particles: Particles) -> BeliefScore:
        rows = there[: self.sharing.count(metric)]
        values = np.array([row.scores.get(metric, np.nan) for row in rows])
        kept = [row for row, value in zip(rows, values, strict=True) if not np.isnan(value)]
        curves = [row.curves[metric] for row in kept if metric in row.curves]
        return BeliefScore(
            metric,
            values,
            particles.first(len(rows)),
            sum(row.times.get(metric, 0.0) for row in rows),
            (curves[0][0], np.mean([curve for _, curve in curves], axis=0)) if curves else None,
        )

    def row(self) -> Row:
        """All of them as one row, or the error of a particle."""
        index, rows = self.asked.index, [self.rows[number] for number in sorted(self.rows)]
        for number, row in enumerate(rows):
            if row.error:
                return Row(index, error=f"particle {number}: {row.error}")
        scores = self.scores()
        return Row(
            index,
            error=_too_many_diverged(scores),
            scores={metric: score.mean for metric, score in scores.items()},
            particles={metric: score.values for metric, score in scores.items()},
            times={metric: score.seconds for metric, score in scores.items()},
            curves={metric: s.curve for metric, s in scores.items() if s.curve is not None},
            steps=sum(row.steps for row in rows),
            unconverged=sum(row.unconverged for row in rows),
            lost_time=sum(row.lost_time for row in rows),
            diverged=sum(row.diverged for row in rows),
            warnings=tuple(dict.fromkeys(text for row in rows for text in row.warnings)),
        )


def _too_many_diverged(scores: BeliefScores) -> str | None:
    """What is wrong if so many rollouts diverged that a probability says nothing."""
    for metric, score in scores.items():
        if too_many_diverged(score.diverged, len(score.values)):
            return str(DivergedError(f"the belief's {metric}", score.diverged, len(score.values)))
    return None


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
        """The particles of one belief after the other, a few at a time."""
        for batch in self._batches:
            if not batch:
                yield []
            for asked in batch:
                try:
                    yield from self._drawn(asked)
                except ValueError as error:
                    self._failed.append(Row(asked.index, error=str(error)))

    def gathered(self, rows: Sequence[Row]) -> list[Row]:
        """The rows of beliefs that are complete by these rows of particles, or failed."""
        done, self._failed = self._failed, []
        for row in rows:
            index, number = row.index % PARTICLE, row.index // PARTICLE
            belief = self._beliefs[index]
            belief.rows[number] = row
            if belief.complete:
                done.append(belief.row())
                if not self._keep:
                    del self._beliefs[index]
        return done

    def found(self) -> dict[int, BeliefScores]:
        """By index, the scores of each belief with a particle."""
        every = {index: belief.scores() for index, belief in self._beliefs.items()}
        return {index: scores for index, scores in every.items() if scores}

    def _drawn(self, asked: Work) -> Iterator[list[Work]]:
        whole_number("index", asked.index, 0, PARTICLE - 1)
        most = max(map(self._sharing.count, asked.metrics))
        belief = self._belief(asked.index)
        draws = belief.draws(most, seed=stream(self._sharing.whole.seed, asked.index))
        gathered = _Gathered(asked, belief.sources, self._sharing, most)
        self._beliefs[asked.index], numbers = gathered, count()
        while piece := list(islice(draws, PIECE)):
            gathered.draws += piece
            yield [self._work(asked, next(numbers), one.problem) for one in piece if one]

    def _work(self, asked: Work, number: int, problem: Problem) -> Work:
        metrics = tuple(m for m in asked.metrics if number < self._sharing.count(m))
        return Work(asked.index + number * PARTICLE, problem, metrics)


particle_chunk = partial(score_chunk, most_diverged=ANY)
"""As score_chunk; a rollout that diverged has NaN."""


def score_belief(
    belief: Belief,
    metrics: Sequence[str] | None = None,
    *,
    particles: int = PARTICLES,
    settings: SearchSettings | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    **loose: Unpack[LooseSettings],
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
    chosen = chosen_settings(settings, **loose)
    on = chosen_executor(executor, threads)
    found = score_beliefs(
        {0: belief}, metrics, particles, chosen, executor=on, limit=limit, progress=progress
    )
    if not found:
        limit.require("a particle has all its scores")
    return found[0]


def score_beliefs(
    beliefs: Mapping[int, Belief],
    metrics: Sequence[str] | None,
    particles: int,
    settings: SearchSettings,
    *,
    executor: Executor,
    limit: Limit,
    progress: Callable[[int, int], None] | None = None,
) -> dict[int, BeliefScores]:
    """The scores of many, by index; those are left out that have no particle before the limit.

    `beliefs`: by index, as of `em.score`, each below 2^32. All else, and errors: as `score_belief`.
    """
    strange = [belief for belief in beliefs.values() if not isinstance(belief, Belief)]
    if strange:
        raise ValueError(f"beliefs has {strange[0]!r}, expected em.Beliefs alone")
    problems = [belief.problem for belief in beliefs.values()]
    metrics = chosen_metrics(problems, metrics, settings)
    sharing = Sharing(particles, settings)
    sharing.require(metrics)
    asked = [Work(index, belief.problem, tuple(metrics)) for index, belief in beliefs.items()]
    source = ParticleSource([asked], beliefs.__getitem__, sharing)
    total, done = len(beliefs) * max(map(sharing.count, metrics)), 0
    errors: dict[int, str] = {}

    def deliver(rows: Sequence[Row]) -> None:
        nonlocal done
        done += len(rows)
        errors.update({row.index: row.error for row in source.gathered(rows) if row.error})
        if progress is not None and rows:
            progress(done, total)

    chunk = partial(particle_chunk, sharing.settings)
    with executor.workers() as workers:
        run(workers, chunk, source, deliver, limit)
    found = source.found()
    errors.update({index: text for index, s in found.items() if (text := _too_many_diverged(s))})
    if errors:
        raise ScoreError(errors, len(beliefs))
    return found
