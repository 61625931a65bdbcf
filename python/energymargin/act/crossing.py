"""The search behind a critical value: a quantile of the values at which draws are lost.

Draw number j is the same for every value (common random numbers). So each draw has a critical value
of its own, on one side of which it is lost, and what is asked for is a quantile of those. The
interval is one of order statistics, which holds whatever their law is: of N draws the number that
is lost at the critical value is binomial. Only draws near it are asked again and again; the
outcomes of the others follow.

That needs draws each of which is lost on one side alone. So some outcomes that follow are asked
too. If one is another, both ends are tested on draws that were not used before, and moved until
they hold. Then the probability alone has to be monotone. Where the first values show that it is
not, all draws are asked where it seems to turn, and each part between two such values is searched.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import groupby, pairwise
from math import isnan, log, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from energymargin.act.scale import Scale
from energymargin.base.errors import DivergedError
from energymargin.base.limits import Limit
from energymargin.evaluate.divergence import too_many_diverged

DRAWS, MOST = 120, 5000  # of a value, and where a probability near 0 or 1 needs more
SPARE = 4.0  # an end is proved with errors of so much less, so that it can be tested again
PILOT = 16  # draws that are asked at each of the first values
GRID = 5  # first values
BETWEEN, FEW = 4, 2  # steps from one to the next, and draws that are asked at those
COARSE = 0.2  # apart; so near are the first draws bracketed
SURPRISES = 16  # outcomes that follow, and are asked all the same
STEP = 0.01  # of the range; by so much at least an end is moved
ALMOST = 1e-12  # of the scale
FIRST = tuple(np.linspace(0.0, 1.0, BETWEEN * (GRID - 1) + 1).tolist())


class Outcomes(NamedTuple):
    """What became of some draws at a value."""

    draws: Sequence[int]
    values: NDArray[np.float64]
    """1 if it holds, 0 if it is lost, NaN if it diverged; one a draw."""
    steps: int
    """Simulation steps."""


Run = Callable[[float, Sequence[int]], Iterable[Outcomes | None]]
"""Outcomes of draws, which rise, at a value, in parts; None of a part that a limit stopped."""


@dataclass(frozen=True)
class Rule:
    """How many of the draws may be lost where the probability is the one that is asked for."""

    draws: int
    lost: float  # the share that is lost there
    alpha: float  # of each end
    ranks: tuple[int, int, int]  # of the draws whose critical values are the ends and the value

    @classmethod
    def of(cls, probability: float, confidence: float, draws: int | None) -> Rule:
        """By what is asked; None: as many draws as both ends of the interval need."""
        lost, alpha = 1.0 - probability, (1.0 - confidence) / 2.0
        if draws is None:
            enough = log(alpha / SPARE) / log(max(lost, probability))
            draws = int(min(max(DRAWS, np.ceil(enough)), MOST))
        law = stats.binom(draws, lost)
        counts = np.arange(draws + 1)
        plausible = counts[(law.cdf(counts) > alpha) & (law.sf(counts - 1) > alpha)]
        middle = int(np.floor(lost * draws)) + 1
        return cls(draws, lost, alpha, (int(plausible[0]), middle, int(plausible[-1]) + 1))

    def is_few(self, lost: int, draws: int, alpha: float) -> bool:
        """Whether so few of new draws are lost that the probability is larger."""
        return bool(stats.binom.cdf(lost, draws, self.lost) <= alpha)

    def is_many(self, lost: int, draws: int, alpha: float) -> bool:
        """Whether so many of new draws are lost that the probability is less."""
        return bool(stats.binom.sf(lost - 1, draws, self.lost) <= alpha)


@dataclass(eq=False)
class Asking:
    """The draws that were asked, by the number of the value on the scale."""

    quantity: str
    run: Run
    scale: Scale
    rule: Rule
    progress: Callable[[int, int], None] | None
    known: dict[float, dict[int, float]] = field(default_factory=dict)
    """1 if a draw holds, else 0, by value and draw."""
    rollouts: int = 0
    steps: int = 0
    stopped: bool = False

    def __post_init__(self) -> None:
        """None has diverged."""
        self.diverged: NDArray[np.bool_] = np.zeros(self.rule.draws, bool)

    def outcomes(self, u: float, draws: NDArray[np.int64]) -> NDArray[np.float64] | None:
        """Those of some draws at a value, 1 or 0, or NaN; None if the limit came first."""
        known = self.known.setdefault(float(u), {})
        new = [int(j) for j in draws if int(j) not in known]
        if new and not self._run(float(u), new):
            return None
        return np.array([known[int(j)] for j in draws])

    def turns(self) -> bool:
        """Whether some draw is lost and holds at a larger value, and some the other way round."""
        last: dict[int, float] = {}
        changes: set[tuple[float, float]] = set()
        for u in sorted(self.known):
            changes |= {(last.get(j, x), x) for j, x in self.known[u].items()}
            last |= self.known[u]
        return (0.0, 1.0) in changes and (1.0, 0.0) in changes

    def side(self, u: float, alpha: float) -> int:
        """1 where the probability of all draws is larger for sure, -1 where it is less, else 0."""
        found = self.outcomes(u, np.arange(self.rule.draws))
        if found is None:
            return 0
        lost, kept = int((found == 0.0).sum()), int((~np.isnan(found)).sum())
        few, many = (test(lost, kept, alpha) for test in (self.rule.is_few, self.rule.is_many))
        return int(few) - int(many)

    def _run(self, u: float, draws: Sequence[int]) -> bool:
        for found in self.run(self.scale.value(u), draws):
            if found is None:
                self.stopped = True
            else:
                self._note(u, found)
        if self.progress is not None:
            self.progress(self.rollouts, max(self.rollouts, 4 * self.rule.draws))
        return not self.stopped

    def _note(self, u: float, found: Outcomes) -> None:
        self.known[u] |= dict(zip(found.draws, found.values.tolist(), strict=True))
        self.rollouts, self.steps = self.rollouts + len(found.draws), self.steps + found.steps
        lost = [j for j in found.draws if j < len(self.diverged) and isnan(self.known[u][j])]
        self.diverged[lost] = True
        count = int(self.diverged.sum())
        if too_many_diverged(count, self.rule.draws):
            raise DivergedError(self.quantity, count, self.rule.draws)


def crossings(asking: Asking, tolerance: float, limit: Limit) -> list[Part]:
    """The parts of the range, each searched for where it crosses; raises TimeoutError or Cancelled
    if not even the first values were tried."""
    for k, u in enumerate(FIRST):
        if asking.outcomes(u, np.arange(FEW if k % BETWEEN else PILOT)) is None:
            limit.require("the first values were tried")
    return [Part(asking, tolerance, *ends) for ends in _segments(asking)]


def _segments(asking: Asking) -> list[tuple[float, float]]:
    """From a number on the scale where enough holds to one where too much is lost, of each change
    in the first values; one of the whole range if there is at most one."""
    shares = {u: float(np.nanmean(list(asking.known[u].values()))) for u in FIRST}
    if asking.turns():
        runs = _runs({u: share < 1.0 - asking.rule.lost for u, share in shares.items()})
        alpha = asking.rule.alpha / (2.0 * len(runs))
        sides = {u: asking.side(u, alpha) for u in (_clearest(*run, shares) for run in runs)}
        runs = _runs({u: side < 0 for u, side in sides.items() if side})
        if len(runs) > 1:
            ends = [(one[-1], other[0], lost) for (lost, one), (_, other) in pairwise(runs)]
            return [(b, a) if lost else (a, b) for a, b, lost in ends]
    return [(0.0, 1.0)] if shares[0.0] >= shares[1.0] else [(1.0, 0.0)]


def _runs(marks: dict[float, bool]) -> list[tuple[bool, list[float]]]:
    """Numbers that follow each other with the same mark."""
    return [(mark, list(run)) for mark, run in groupby(marks, key=marks.__getitem__)]


def _clearest(lost: bool, run: list[float], shares: dict[float, float]) -> float:
    """The first value at which most holds, or is lost: the farthest from others among alike."""
    best = (min if lost else max)(shares[u] for u in run)
    alike = [u for u in run if shares[u] == best]
    place = 0 if run[0] == 0.0 else -1 if run[-1] == 1.0 else len(alike) // 2
    return alike[place]


@dataclass(frozen=True)
class Crossing:
    """Where a part of the range crosses; as the fields of CriticalValue."""

    value: float
    low: float
    high: float
    side: str
    monotone: bool | None


class Part:
    """A part of the range: from where it is easy, 0, to where it is hard, 1."""

    def __init__(self, asking: Asking, tolerance: float, easy: float, hard: float) -> None:
        """Searches it; both ends are numbers of the scale."""
        self._asking, self._rule, self._tolerance = asking, asking.rule, tolerance
        self._easy, self._hard = easy, hard
        self._held, self._lost = self._none(-np.inf), self._none(np.inf)
        self._lost_at: dict[float, int] = {}  # of all draws
        for u, outcomes in asking.known.items():
            if min(easy, hard) <= u <= max(easy, hard):
                self._see((u - easy) / (hard - easy), outcomes)
        # A draw that is lost and holds at a harder value: then no outcome follows from another one.
        self._follow = not bool((self._held > self._lost).any())
        self.crossing = self._found()

    def _none(self, value: float) -> NDArray[np.float64]:
        """Of each draw, before anything is known."""
        return np.full(self._rule.draws, value)

    def _found(self) -> Crossing:
        """Where the probability is the one that is asked for."""
        if self._follow:
            self._narrow()
        ends = [self._bracket(rank) for rank in self._rule.ranks]
        low, value, high = ends[0][0], sum(ends[1]) / 2.0, ends[2][1]
        low, high = min(low, value), max(high, value)
        monotone: bool | None = self._follow and not self._surprised(low, high)
        if self._asking.stopped:
            monotone = None if self._follow else False
        elif not monotone:
            low = self._moved(low, -max(STEP, value - low), self._rule.is_few)
            high = self._moved(high, max(STEP, high - value), self._rule.is_many)
            if abs(self._hard - self._easy) == 1.0 and not np.isfinite([low, high]).all():
                value = nan  # nothing says that it crosses
        return self._told(low, value, high, monotone)

    def table(self) -> list[tuple[float, float, float]]:
        """As the rows of CriticalValue.outcomes."""
        rows: list[tuple[float, float, float]] = []
        for number, asked in self._asking.known.items():
            u = (number - self._easy) / (self._hard - self._easy)
            least, most = self._held >= u - ALMOST, self._lost > u + ALMOST
            if not self._follow:
                asked_now = np.array([asked.get(j, nan) for j in range(self._rule.draws)])
                least, most = asked_now == 1.0, asked_now != 0.0
            if 0.0 <= u <= 1.0:
                value = self._asking.scale.value(number)
                rows.append((value, float(least.mean()), float(most.mean())))
        return rows

    def _told(self, low: float, value: float, high: float, monotone: bool | None) -> Crossing:
        """With the ends in the range, and what is true of all of it."""
        few, _, many = self._rule.ranks
        everywhere = self._lost_at.get(1.0, self._rule.draws) < few
        nowhere = self._lost_at.get(0.0, 0) >= many
        if not self._follow and (everywhere or nowhere):
            each = [self._count(u) or 0 for u in np.linspace(0.0, 1.0, GRID).tolist()]
            everywhere, nowhere = everywhere and max(each) < few, nowhere and min(each) >= many
        side = "below" if self._easy < self._hard else "above"
        if not np.isfinite(value):
            value, side = nan, "unknown"
        side = "everywhere" if everywhere else "nowhere" if nowhere else side
        told = [self._value(min(max(u, 0.0), 1.0)) for u in (low, high)]
        if everywhere or nowhere:
            value, told = nan, [nan, nan]
        return Crossing(self._value(value), min(told), max(told), side, monotone)

    def _value(self, u: float) -> float:
        return u if isnan(u) else self._asking.scale.value(float(self._number(u)))

    def _number(self, u: float) -> float:
        return self._easy + u * (self._hard - self._easy)

    def _see(self, u: float, outcomes: dict[int, float]) -> None:
        for j, holds in outcomes.items():
            if j >= len(self._held):
                continue
            if holds == 1.0:
                self._held[j] = max(self._held[j], u)
            elif holds == 0.0:
                self._lost[j] = min(self._lost[j], u)

    def _ask(self, u: float, draws: NDArray[np.int64]) -> bool:
        """Asks those draws whose outcome does not follow; False if the limit came."""
        is_open = (self._held[draws] < u) & (self._lost[draws] > u)
        open_ = draws[is_open] if self._follow else draws
        open_ = open_[~self._asking.diverged[open_]]
        if not len(open_):
            return True
        done = self._asking.outcomes(self._number(u), open_) is not None
        self._see(u, self._asking.known[float(self._number(u))])
        return done

    def _narrow(self) -> None:
        """Brackets where the first draws are lost: all of those, if they are alike, else the
        quarter that is lost first."""
        while True:
            pilot = np.flatnonzero(~self._asking.diverged[:PILOT])
            held, lost = self._held[pilot], self._lost[pilot]
            low, high, enough = float(held.max()), float(lost.min()), self._tolerance
            if low >= high:  # they differ
                first = np.argsort(lost, kind="stable")[: PILOT // 4]
                wide = np.where(np.isfinite(lost[first]), (lost - held)[first], 0.0)
                j = first[np.argmax(wide)]
                low, high, enough = float(held[j]), float(lost[j]), COARSE
            if not np.isfinite([low, high]).all() or self._width(low, high) <= enough:
                break
            if not self._ask((low + high) / 2.0, pilot):
                break

    def _width(self, u: float, other: float) -> float:
        if abs(u - other) <= ALMOST:
            return 0.0
        return self._asking.scale.apart(self._number(u), self._number(other))

    def _count(self, u: float) -> int | None:
        """How many of all draws are lost at a value; None if the limit came."""
        every = np.arange(self._rule.draws)
        if not self._ask(u, every):
            return None
        asked = self._asking.known.get(float(self._number(u)), {})
        follows, lost = self._lost <= u, sum(asked.get(j) == 0.0 for j in range(len(every)))
        self._lost_at[u] = int(follows.sum()) if self._follow else lost
        return self._lost_at[u]

    def _bracket(self, rank: int) -> tuple[float, float]:
        """Values on both sides of the critical value of the draw of a rank, from the first to be
        lost; infinite where it lies beyond the range."""
        if rank == 0:
            return -np.inf, -np.inf
        high = min((u for u, lost in self._lost_at.items() if lost >= rank), default=np.inf)
        few = (u for u, lost in self._lost_at.items() if lost < rank and u < high)
        low = max(few, default=-np.inf)
        while low < 1.0 and high > 0.0 and self._width(low, high) > self._tolerance:
            lost = self._count(u := self._between(low, high, rank))
            if lost is None:
                return low, high
            low, high = (u, high) if lost < rank else (low, u)
        if high == 0.0:
            return -np.inf, -np.inf
        return (np.inf, np.inf) if low == 1.0 else (low, high)

    def _between(self, low: float, high: float, rank: int) -> float:
        """The next value: one at which the first draws say on which side it is, or the middle."""
        seen = (*self._held[:PILOT], *self._lost[:PILOT]) if self._follow else ()
        tried: set[float] = {u for u in seen if low < u < high}
        share, pilot = rank / self._rule.draws, self._lost[:PILOT]
        if high == np.inf:
            many = [u for u in tried if float((pilot <= u).mean()) > share]
            return min(many) if many else 1.0
        if tried:
            few = [u for u in tried if float((pilot <= u).mean()) < share]
            return max(few) if few else min(tried)
        if low == -np.inf and self._width(0.0, high) <= self._tolerance:
            return 0.0
        return float((max(low, 0.0) + high) / 2.0)

    def _surprised(self, low: float, high: float) -> bool:
        """Whether an outcome that follows is another one."""
        every = np.arange(self._rule.draws)
        most = SURPRISES // 2 * (4 if self._asking.turns() else 1)
        for u, follows, expected in (
            (min(max(low, 0.0), 1.0), self._held > low, 1.0),
            (min(max(high, 0.0), 1.0), self._lost < high, 0.0),
        ):
            asked = self._asking.known.get(float(self._number(u)), {})
            left = [j for j in every[follows] if int(j) not in asked][:most]
            found = self._asking.outcomes(self._number(u), np.array(left, int)) if left else None
            if found is not None and bool((found == 1.0 - expected).any()):
                return True
        return False

    def _moved(self, u: float, by: float, holds: Callable[[int, int, float], bool]) -> float:
        """An end of the interval that draws which were not used before say is one."""
        new = np.arange(self._rule.draws, 2 * self._rule.draws)
        alpha = self._rule.alpha if self._follow else self._rule.alpha / 2.0  # half is for `side`
        while 0.0 <= u <= 1.0:
            alpha /= 2.0
            found = self._asking.outcomes(self._number(u), new)
            if found is None:
                break
            kept = found[~np.isnan(found)]
            if holds(int((kept == 0.0).sum()), len(kept), alpha):
                return u
            u, by, new = u + by, 2.0 * by, new + self._rule.draws
        return -np.inf if by < 0 else np.inf
