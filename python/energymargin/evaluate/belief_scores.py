"""Scores of a belief: those of its particles, and what they say together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from energymargin.base.aliases import Floats, Mask
from energymargin.base.checks import open_share
from energymargin.base.metrics import TIMED
from energymargin.base.reprs import Record
from energymargin.evaluate.executors.rows import Curve
from energymargin.model.beliefs.belief import Particles

PARTICLES_A_TERM = 4  # below, a regression says more of the particles than of the score


@dataclass(frozen=True)
class Share:
    """The share of one source in a score's variance."""

    value: float
    """Adjusted for the number of terms; of a source that does not matter it may be below 0. NaN of
    too few particles."""
    stderr: float
    """By the jackknife."""


@dataclass(frozen=True, eq=False, repr=False)
class BeliefScore(Record):
    """One metric of a belief. What is uncertain and what is random both spread the values."""

    metric: str
    values: Floats
    """Score of each particle, shape (N,); a probability's are 1 or 0, from one rollout each, and
    NaN of a rollout that diverged, which does not count."""
    particles: Particles
    """Those N."""
    seconds: float
    """Computing time of all of them [s]."""
    curve: Curve | None = None
    """Times [s] and the probability until each, (T,); None for other scores."""

    @property
    def diverged(self) -> int:
        """Rollouts of a probability that diverged."""
        return len(self.values) - int(self._counts.sum())

    @property
    def _counts(self) -> Mask:
        """Which particles count, shape (N,)."""
        return ~np.isnan(self.values) | (self.metric not in TIMED)

    @property
    def kept(self) -> Floats:
        """The values that count, shape (N - diverged,)."""
        return self.values[self._counts]

    @property
    def mean(self) -> float:
        """Over the belief: the probability itself; inf if a particle has no escape."""
        return float(self.kept.mean())

    @property
    def value(self) -> float:
        """As `mean`."""
        return self.mean

    @property
    def stderr(self) -> float | None:
        """Standard error of the mean, as of independent draws: quasi-random ones are at least as
        good as a rule. None of a single particle or an infinite mean."""
        if len(self.kept) < 2 or not np.isfinite(self.kept).all():
            return None
        return float(self.kept.std(ddof=1) / np.sqrt(len(self.kept)))

    @property
    def has_quantiles(self) -> bool:
        """Whether the values are scores of particles: those of a probability are 1 or 0."""
        return self.metric not in TIMED

    @property
    def worst(self) -> float:
        """The least of all particles' scores. It falls with more of them. Raises ValueError of a
        probability."""
        self._require_quantiles("worst")
        return float(self.values.min())

    def quantile(self, share: float) -> float:
        """The score which this share (0..1) of the belief is at most at: quantile(0.1) is exceeded
        nine times of ten. Raises ValueError on another share, and of a probability."""
        if not 0 <= share <= 1:
            raise ValueError(f"share is {share!r}, expected a number from 0 to 1")
        self._require_quantiles("quantile")
        return float(np.quantile(self.values, share, method="inverted_cdf"))

    def _require_quantiles(self, name: str) -> None:
        if not self.has_quantiles:
            raise ValueError(
                f"{name} is asked of {self.metric!r}, whose particles have one rollout each, 1 or "
                "0: expected that of scores, such as "
                "[em.capture_probability(p).captured for p in belief.particles(16).problems]"
            )

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """(low, high) of the mean: Clopper and Pearson's of a probability, else Student's.

        Raises ValueError on a confidence that is not between 0 and 1, and where there is no
        standard error: of one particle, and of efforts of which some are inf; those have quantiles.
        """
        open_share("confidence", confidence)
        from scipy import stats

        if self.metric in TIMED:
            inside = round(float(self.kept.sum()))
            found = stats.binomtest(inside, len(self.kept)).proportion_ci(confidence)
            return float(found.low), float(found.high)
        if self.stderr is None:
            infinite = int((~np.isfinite(self.values)).sum())
            raise ValueError(
                f"values are inf in {infinite} of {len(self.values)} particles, expected several "
                "finite ones for an interval of the mean: quantile(0.5) is the median"
            )
        half = self.stderr * float(stats.t.ppf((1 + confidence) / 2, len(self.values) - 1))
        return self.mean - half, self.mean + half

    @cached_property
    def shares(self) -> dict[str, Share]:
        """First-order share of each source, as "friction of object", in the variance of the values:
        the largest is the one that is most worth measuring."""
        sources = self.particles.sources
        inputs = [len(source.inputs) for source in sources]
        found = shares(self.particles.points[self._counts], inputs, self.kept)
        return {source.name: share for source, share in zip(sources, found, strict=True)}


def shares(points: Floats, inputs: Sequence[int], scores: Floats) -> list[Share]:
    """First-order (Sobol) share of each source in the variance of scores, shape (N,).

    It is read off a regression on Legendre polynomials of the first and second degree of the
    source's columns of `points`, shape (N, D), `inputs` of them. The shares add up to at most 1;
    what is left are interactions, what two degrees do not follow, and the searches' randomness.
    NaN with fewer than four particles for each term, and of scores that are not finite or do not
    differ.
    """
    differ = bool(np.isfinite(scores).all()) and np.ptp(scores) > 0
    ends = np.cumsum(inputs, dtype=int)
    if not differ:
        return [Share(np.nan, np.nan)] * len(inputs)
    spans = zip(ends - inputs, ends, strict=True)
    return [_share_of(points[:, begin:end], scores) for begin, end in spans]


def _share_of(columns: Floats, scores: Floats) -> Share:
    count, x = len(scores), 2 * columns - 1
    terms = np.column_stack([np.ones(count), x, (3 * x**2 - 1) / 2])
    if count < PARTICLES_A_TERM * terms.shape[1]:
        return Share(np.nan, np.nan)
    less_one = ((np.delete(terms, k, axis=0), np.delete(scores, k)) for k in range(count))
    without = np.array([_r_squared(*each) for each in less_one])
    spread = np.sqrt((count - 1) / count * ((without - without.mean()) ** 2).sum())
    return Share(_r_squared(terms, scores), float(spread))


def _r_squared(terms: Floats, scores: Floats) -> float:
    """Adjusted (Wherry) for the number of terms."""
    total = float(((scores - scores.mean()) ** 2).sum())
    if total == 0:
        return 0.0
    left = float(((scores - terms @ np.linalg.lstsq(terms, scores, rcond=None)[0]) ** 2).sum())
    count, size = terms.shape
    return float(1 - (left / (count - size)) / (total / (count - 1)))


@dataclass(frozen=True, eq=False)
class BeliefScores(Mapping[str, BeliefScore]):
    """The scores of a belief, by metric."""

    scores: dict[str, BeliefScore]
    complete: bool = True
    """Whether every particle is there: False if the timeout or the cancel came first."""

    __eq__ = object.__eq__  # a Mapping's would compare arrays
    __hash__ = object.__hash__

    def __getitem__(self, metric: str) -> BeliefScore:
        """The score of one metric; KeyError if it was not computed."""
        if metric not in self.scores:
            raise KeyError(f"{metric!r} was not computed; there are: {', '.join(self.scores)}")
        return self.scores[metric]

    def __iter__(self) -> Iterator[str]:
        """The metrics."""
        return iter(self.scores)

    def __len__(self) -> int:
        """How many metrics."""
        return len(self.scores)
