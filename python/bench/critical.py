"""Whether intervals of critical values hold, and what they cost: replicas with known answers.

python python/bench/critical.py --replicas 1000

A trial is one number: draw j of a replica is lost beyond its own critical value, so the answer is a
quantile of a law. Under the null the quantity does nothing.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

import energymargin as em
from energymargin.base.aliases import Floats

__all__ = ["CASES", "GRID_ROLLOUTS", "NULLS", "Case", "Found", "grid_width", "nulls", "replicas"]

ASKED, CONFIDENCE = 0.95, 0.95
SLOW = 10  # so many times fewer are replicas that take fresh draws to the end
MANY = 8192  # draws that a search may take
GRID, EACH = 20, 200  # values, and rollouts of each, that people take by hand
GRID_ROLLOUTS = GRID * EACH


@dataclass(frozen=True)
class Case:
    """A law of the draws' critical values, and the range that is searched."""

    name: str
    law: Callable[[np.random.Generator], Floats]
    """Critical values of MANY draws."""
    answer: float
    range: tuple[float, float]
    flips: float = 0.0
    """Share of the outcomes, by draw and value, that are another one."""

    def search(self, replica: int, draws: int | None = None) -> em.CriticalValue:
        """One replica; `draws` as of em.critical_value."""
        random = np.random.default_rng([replica, len(self.name)])
        own = self.law(random)

        def holds(value: float, numbers: Sequence[int]) -> Floats:
            outcomes = own[numbers] > value
            if self.flips:
                key = np.random.default_rng([replica, round(1e9 * value)])
                outcomes ^= key.random(MANY)[numbers] < self.flips
            return np.asarray(outcomes, dtype=float)

        sizes: dict[str, Any] = {"probability": ASKED, "confidence": CONFIDENCE, "draws": draws}
        return em.critical_value_of(holds, self.name, self.range, **sizes)


def _noisy(value: float) -> float:
    """Where a normal law with flips has the probability that is asked for."""
    share = (ASKED - FLIPS) / (1.0 - 2.0 * FLIPS)
    return float(stats.norm.ppf(1.0 - share, value, 1.0))


FLIPS = 0.02
CASES = (
    Case("normal", lambda r: r.normal(5, 1, MANY), stats.norm.ppf(0.05, 5, 1), (0, 10)),
    Case("uniform", lambda r: r.uniform(0, 10, MANY), 0.5, (0, 10)),
    Case(
        "lognormal, by ratios",
        lambda r: r.lognormal(0, 0.5, MANY),
        stats.lognorm.ppf(0.05, 0.5),
        (0.01, 100),
    ),
    Case("normal, outcomes that flip", lambda r: r.normal(5, 1, MANY), _noisy(5), (0, 10), FLIPS),
)
NULLS = (0.90, 0.95, 0.98)
"""Probabilities of a quantity that does nothing, where 0.95 is asked."""


@dataclass(frozen=True)
class Found:
    """What came of the replicas of a case."""

    held: int
    """Whose interval has the answer."""
    replicas: int
    rollouts: float
    """In the mean."""
    width: float
    """Likewise."""


def replicas(case: Case, count: int, draws: int | None = None) -> Found:
    """So many searches."""
    found = [case.search(replica, draws) for replica in range(count)]
    held = sum(one.low <= case.answer <= one.high for one in found)
    widths = [one.high - one.low for one in found]
    rollouts = float(np.mean([one.rollouts for one in found]))
    return Found(held, count, rollouts, float(np.mean(widths)))


def grid_width(case: Case, count: int) -> float:
    """Mean width of what a grid of GRID values with EACH fresh rollouts leaves possible: from the
    last value that holds for sure to the first one that does not (Clopper and Pearson, Bonferroni).
    """
    values = np.linspace(*case.range, GRID)
    law, tail = stats.binom(EACH, 1.0 - ASKED), (1.0 - CONFIDENCE) / 2.0 / GRID
    widths = []
    for replica in range(count):
        random = np.random.default_rng([replica, GRID])
        lost = np.array([(case.law(random)[:EACH] <= value).sum() for value in values])
        sure, gone = law.cdf(lost) < tail, law.sf(lost - 1) < tail
        low = values[sure].max(initial=case.range[0])
        high = values[gone].min(initial=case.range[1])
        widths.append(high - low)
    return float(np.mean(widths))


def nulls(probability: float, count: int) -> Counter[str]:
    """Sides that are claimed for a quantity that does nothing."""
    sides: Counter[str] = Counter()
    for replica in range(count):
        lucky = np.random.default_rng([replica, 7]).random(MANY) < probability

        def holds(value: float, numbers: Sequence[int], lucky: Any = lucky) -> Floats:
            return np.asarray(lucky[numbers], dtype=float)

        sides[em.critical_value_of(holds, "nothing", (0, 1), probability=ASKED).side] += 1
    return sides


def main() -> None:
    """Prints both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--replicas", type=int, default=1000)
    count = parser.parse_args().replicas
    print("| draws | intervals that hold | rollouts | width | width of a grid of 20 x 200 |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for case in CASES:
        found = replicas(case, max(count // SLOW, 1) if case.flips else count)
        grid = "" if case.flips else f"{grid_width(case, min(count, 100)):.3g}"
        held = f"{found.held} of {found.replicas}"
        print(f"| {case.name} | {held} | {found.rollouts:.0f} | {found.width:.3g} | {grid} |")
    print("\n| it does nothing, and holds in | below or above | everywhere | nowhere |")
    print("| --- | ---: | ---: | ---: |")
    for probability in NULLS:
        sides = nulls(probability, count)
        claims = sides["below"] + sides["above"]
        ends = f"{sides['everywhere']} | {sides['nowhere']}"
        print(f"| {probability:.0%} | {claims} of {count} | {ends} |")


if __name__ == "__main__":
    main()
