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

from collections.abc import Callable, Sequence
from dataclasses import InitVar, dataclass, field
from itertools import groupby, pairwise
from math import isnan, log, nan

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from energymargin.act.quantities import Scale
from energymargin.base.aliases import Floats
from energymargin.base.checks import function_or_none, open_share, require, whole_number
from energymargin.base.errors import DivergedError
from energymargin.base.limits import Limit
from energymargin.base.plausibility import Kept, kept_warnings, warn
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
NOT_ASKED = -1.0

Run = Callable[[float, Sequence[int]], tuple[Floats, int] | None]
"""Of draws, which rise, at a value: 1 of each that holds, 0 if it is lost, NaN if it diverged; and
the simulation steps. None if a limit came first."""


@dataclass(eq=False)
class Search:
    """What is asked, and the outcomes of the draws that were asked; ValueError on what cannot be.

    A value is known by its number on the scale, from 0 to 1.
    """

    quantity: str
    run: Run
    range: tuple[float, float]
    probability: float
    confidence: float
    asked: InitVar[int | None]
    """Draws of each value; None: as many as both ends of the interval need."""
    tolerance: float
    progress: Callable[[int, int], None] | None
    limit: Limit
    known: dict[float, dict[int, float]] = field(default_factory=dict)
    """By value and draw, as of `run`."""
    rollouts: int = 0
    steps: int = 0
    stopped: bool = False
    warned: set[str] = field(default_factory=set)

    def __post_init__(self, asked: int | None) -> None:
        """Checks it, and says how many draws may be lost where the probability is the one asked."""
        function_or_none("progress", self.progress, "done", "total")
        self.scale = Scale.of(self.range)
        self.lost = 1.0 - open_share("probability", self.probability)
        self.alpha = (1.0 - open_share("confidence", self.confidence)) / 2.0  # of each end
        small = open_share("tolerance", self.tolerance) < 0.5
        require(small, "tolerance", self.tolerance, "a share of the range, such as 0.01")
        usual = min(max(DRAWS, self._needed(self.alpha / SPARE)), MOST)
        self.draws = usual if asked is None else whole_number("draws", asked, PILOT)
        self.most = 2 * MOST if asked is None else self.draws  # of a test of an end
        law, counts = stats.binom(self.draws, self.lost), np.arange(self.draws + 1)
        likely = counts[(law.cdf(counts) > self.alpha) & (law.sf(counts - 1) > self.alpha)]
        middle = int(np.floor(self.lost * self.draws)) + 1
        # Of the draws whose critical values are the ends and the value.
        self.ranks = int(likely[0]), middle, int(likely[-1]) + 1
        self.diverged = np.zeros(self.draws, bool)
        if self.ranks[0] == 0 or self.ranks[2] > self.draws:
            way = f"Take {self._needed(self.alpha)} or more"
            few = "fewer than both ends of the interval need: one is that of the range"
            said = f"draws is {self.draws}, {few}. {way}"
            warn([(said, said)], said)

    def _needed(self, alpha: float) -> int:
        """Draws that may tell a side with an error of alpha at most."""
        return int(np.ceil(log(alpha) / log(max(self.lost, self.probability))))

    def outcomes(self, u: float, draws: NDArray[np.int64]) -> Floats | None:
        """Those of some draws at a value; None if the limit came first."""
        known = self.known.get(u, {})
        new = [j for j in draws.tolist() if j not in known]
        if new:
            self.known[u] = known
            with kept_warnings() as kept:
                found = None if self.limit.reached else self.run(self.scale.value(u), new)
            self._warn(kept)
            self.stopped |= found is None
            if found is not None:
                self._note(known, new, *found)
            if self.progress is not None:
                self.progress(self.rollouts, max(self.rollouts, 4 * self.draws))
        return None if self.stopped and new else np.array([known[j] for j in draws.tolist()])

    def _warn(self, kept: Kept) -> None:
        """Of each subject once: values are many, and a warning names one."""
        for (about, text), fingerprint in kept:
            if about not in self.warned:
                self.warned.add(about)
                warn([(about, text)], fingerprint)

    def _note(self, known: dict[int, float], new: list[int], values: Floats, steps: int) -> None:
        known |= dict(zip(new, values.tolist(), strict=True))
        self.rollouts, self.steps = self.rollouts + len(new), self.steps + steps
        self.diverged[[j for j in new if j < self.draws and isnan(known[j])]] = True
        count = int(self.diverged.sum())
        if too_many_diverged(count, self.draws):
            raise DivergedError(self.quantity, count, self.draws)

    def at(self, u: float) -> Floats:
        """Outcomes of all draws at a value, NOT_ASKED of some."""
        known = self.known.get(u, {})
        return np.array([known.get(j, NOT_ASKED) for j in range(self.draws)])

    def side(self, u: float, draws: NDArray[np.int64], alpha: float) -> int | None:
        """1 where so few of new draws are lost that the probability is larger for sure, -1 where so
        many are that it is less, else 0; None if the limit came first."""
        found = self.outcomes(u, draws)
        if found is None:
            return None
        lost, law = int((found == 0.0).sum()), stats.binom(int((~np.isnan(found)).sum()), self.lost)
        return int(law.cdf(lost) <= alpha) - int(law.sf(lost - 1) <= alpha)

    def turns(self) -> bool:
        """Whether some draw is lost and holds at a larger value, and some the other way round."""
        last: dict[int, float] = {}
        changes: set[tuple[float, float]] = set()
        for u in sorted(self.known):
            changes |= {(last.get(j, x), x) for j, x in self.known[u].items()}
            last |= self.known[u]
        return (0.0, 1.0) in changes and (1.0, 0.0) in changes

    def parts(self) -> list[Part]:
        """The parts of the range, each searched for where it crosses; raises TimeoutError or
        Cancelled if not even the first values were tried."""
        for k, u in enumerate(FIRST):
            if self.outcomes(u, np.arange(FEW if k % BETWEEN else PILOT)) is None:
                self.limit.require("the first values were tried")
        return [Part(self, *ends) for ends in self._segments()]

    def _segments(self) -> list[tuple[float, float]]:
        """From a number on the scale where enough holds to one where too much is lost, of each
        change in the first values; one of the whole range if there is at most one."""
        shares = {u: float(np.nanmean(list(self.known[u].values()))) for u in FIRST}
        if self.turns():
            runs = _runs({u: share < 1.0 - self.lost for u, share in shares.items()})
            alpha = self.alpha / (2.0 * len(runs))
            every = np.arange(min(max(self.draws, self._needed(alpha)), self.most))
            sides = {u: self.side(u, every, alpha) for u in (_clearest(*r, shares) for r in runs)}
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
    return alike[0 if run[0] == 0.0 else -1 if run[-1] == 1.0 else len(alike) // 2]


class Part:
    """A part of the range: from where it is easy, 0, to where it is hard, 1.

    `crossing`, value, low, high and side, and `monotone` are as of a CriticalValue.
    """

    def __init__(self, search: Search, easy: float, hard: float) -> None:
        """Searches it; both ends are numbers of the scale."""
        self._search, self._easy, self._hard = search, easy, hard
        self._held = np.full(search.draws, -np.inf)  # the hardest value at which each draw holds
        self._lost = np.full(search.draws, np.inf)  # the easiest one at which it is lost
        self._lost_at: dict[float, int] = {}  # of all draws
        for number in search.known:
            if min(easy, hard) <= number <= max(easy, hard):
                self._see((number - easy) / (hard - easy), number)
        # A draw that is lost and holds at a harder value: then no outcome follows from another one.
        self._follow = not bool((self._held > self._lost).any())
        self._find()

    def _find(self) -> None:
        """Where the probability is the one that is asked for."""
        if self._follow:
            self._narrow()
        ends = [self._bracket(rank) for rank in self._search.ranks]
        low, value, high = ends[0][0], sum(ends[1]) / 2.0, ends[2][1]
        low, high = min(low, value), max(high, value)
        self.monotone: bool | None = self._follow and not self._surprised(low, high)
        if self._search.stopped:
            self.monotone = None if self._follow else False
        elif not self.monotone:
            low = self._moved(low, -max(STEP, value - low))
            high = self._moved(high, max(STEP, high - value))
            if abs(self._hard - self._easy) == 1.0 and not np.isfinite([low, high]).all():
                value = nan  # nothing says that it crosses
        self._conclude(low, value, high)

    def _conclude(self, low: float, value: float, high: float) -> None:
        """With the ends in the range, and what is true of all of it."""
        few, _, many = self._search.ranks
        everywhere = self._lost_at.get(1.0, self._search.draws) < few
        nowhere = self._lost_at.get(0.0, 0) >= many
        if not self._follow and (everywhere or nowhere):
            each = [self._count(u) or 0 for u in np.linspace(0.0, 1.0, GRID).tolist()]
            everywhere, nowhere = everywhere and max(each) < few, nowhere and min(each) >= many
        side = "below" if self._easy < self._hard else "above"
        if everywhere or nowhere:
            low = value = high = nan
            side = "everywhere" if everywhere else "nowhere"
        elif not np.isfinite(value):
            value, side = nan, "unknown"
        low, high = sorted(self._value(u) for u in (low, high))
        self.crossing = (self._value(value), low, high, side)

    def table(self) -> list[tuple[float, float, float]]:
        """As the rows of CriticalValue.outcomes."""
        rows: list[tuple[float, float, float]] = []
        for number in self._search.known:
            u = (number - self._easy) / (self._hard - self._easy)
            least, most = self._held >= u - ALMOST, self._lost > u + ALMOST
            if not self._follow:
                least, most = self._search.at(number) == 1.0, self._search.at(number) != 0.0
            if 0.0 <= u <= 1.0:
                value = self._search.scale.value(number)
                rows.append((value, float(least.mean()), float(most.mean())))
        return rows

    def _value(self, u: float) -> float:
        """The value at a number of the part, within it; NaN is none."""
        return u if isnan(u) else self._search.scale.value(self._number(min(max(u, 0.0), 1.0)))

    def _number(self, u: float) -> float:
        return float(self._easy + u * (self._hard - self._easy))

    def _see(self, u: float, number: float) -> None:
        """Notes the outcomes that are known at a value."""
        found = self._search.at(number)
        self._held = np.where(found == 1.0, np.maximum(self._held, u), self._held)
        self._lost = np.where(found == 0.0, np.minimum(self._lost, u), self._lost)

    def _ask(self, u: float, draws: NDArray[np.int64]) -> bool:
        """Asks those draws whose outcome does not follow; False if the limit came."""
        is_open = (self._held[draws] < u) & (self._lost[draws] > u) | (not self._follow)
        asked = draws[is_open & ~self._search.diverged[draws]]
        done = self._search.outcomes(self._number(u), asked) is not None
        self._see(u, self._number(u))
        return done

    def _narrow(self) -> None:
        """Brackets where the first draws are lost: all of those, if they are alike, else the
        quarter that is lost first."""
        while True:
            pilot = np.flatnonzero(~self._search.diverged[:PILOT])
            held, lost = self._held[pilot], self._lost[pilot]
            low, high, enough = float(held.max()), float(lost.min()), self._search.tolerance
            if low >= high:  # they differ
                first = np.argsort(lost, kind="stable")[: PILOT // 4]
                widths = np.where(np.isfinite(lost[first]), (lost - held)[first], 0.0)
                j = first[np.argmax(widths)]
                low, high, enough = float(held[j]), float(lost[j]), COARSE
            wide = np.isfinite([low, high]).all() and self._width(low, high) > enough
            if not (wide and self._ask((low + high) / 2.0, pilot)):
                break

    def _width(self, u: float, other: float) -> float:
        if abs(u - other) <= ALMOST:
            return 0.0
        return self._search.scale.apart(self._number(u), self._number(other))

    def _count(self, u: float) -> int | None:
        """How many of all draws are lost at a value; None if the limit came."""
        if not self._ask(u, np.arange(self._search.draws)):
            return None
        lost = self._lost <= u if self._follow else self._search.at(self._number(u)) == 0.0
        self._lost_at[u] = int(lost.sum())
        return self._lost_at[u]

    def _bracket(self, rank: int) -> tuple[float, float]:
        """Values on both sides of the critical value of the draw of a rank, from the first to be
        lost; infinite where it lies beyond the range."""
        if rank == 0:
            return -np.inf, -np.inf
        high = min((u for u, lost in self._lost_at.items() if lost >= rank), default=np.inf)
        few = (u for u, lost in self._lost_at.items() if lost < rank and u < high)
        low = max(few, default=-np.inf)
        while low < 1.0 and high > 0.0 and self._width(low, high) > self._search.tolerance:
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
        share, pilot = rank / self._search.draws, self._lost[:PILOT]
        if high == np.inf:
            many = [u for u in tried if float((pilot <= u).mean()) > share]
            return min(many) if many else 1.0
        if tried:
            few = [u for u in tried if float((pilot <= u).mean()) < share]
            return max(few) if few else min(tried)
        if low == -np.inf and self._width(0.0, high) <= self._search.tolerance:
            return 0.0
        return float((max(low, 0.0) + high) / 2.0)

    def _surprised(self, low: float, high: float) -> bool:
        """Whether an outcome that follows is another one."""
        most = SURPRISES // 2 * (4 if self._search.turns() else 1)
        for end, follows, other in (low, self._held > low, 0.0), (high, self._lost < high, 1.0):
            number = self._number(min(max(end, 0.0), 1.0))
            left = np.flatnonzero(follows & (self._search.at(number) == NOT_ASKED))[:most]
            found = self._search.outcomes(number, left)
            if found is not None and bool((found == other).any()):
                return True
        return False

    def _moved(self, u: float, by: float) -> float:
        """An end of the interval that draws which were not used before say is one."""
        search, first = self._search, self._search.draws
        alpha = search.alpha / (1.0 if self._follow else 2.0)  # half is for `parts`
        while 0.0 <= u <= 1.0:
            alpha /= 2.0
            alike = log(alpha) / log(search.probability if by < 0 else search.lost)
            count = max(search.draws, int(np.ceil(alike)))  # so few prove it if they are all alike
            if count > search.most:
                break
            side = search.side(self._number(u), np.arange(first, first + count), alpha)
            if side is None:
                break
            if side == (1 if by < 0 else -1):
                return u
            u, by, first = u + by, 2.0 * by, first + count
        return -np.inf if by < 0 else np.inf
