"""Scores of grasps: what became of each trial, and what follows from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Problem
from energymargin.checks import check_shape, share
from energymargin.grasps.grasp_set import GraspSet
from energymargin.grasps.trials import ENDINGS, Grasp, Trials
from energymargin.reprs import Record
from energymargin.summary import Summarized
from energymargin.table_text import csv_text

HELD, DIVERGED = ENDINGS.index("held"), ENDINGS.index("diverged")
MISSING = -1  # in place of an ending
MANY, MOST = 0.2, 0.8  # shares of the trials
LOOSE = 0.01  # share of the steps


@dataclass(frozen=True, eq=False, repr=False)
class GraspScores(Record, Summarized):
    """How n grasps fared in K trials each."""

    grasps: GraspSet
    trials: Trials
    """What was asked: hand, object, protocol, belief and disturbance."""
    endings: NDArray[np.int8]
    """Number in ENDINGS of how each trial ended, (n, K); -1: it was not made."""
    times: NDArray[np.float64]
    """When the object was lost, after the hand had closed [s], (n, K): inf if it was held, NaN if
    the hand did not grip."""
    back: NDArray[np.float64]
    """How far the hand was moved back along its approach, out of what it was in [m], (n, K)."""
    redrawn: NDArray[np.int64]
    """Poses that were drawn again, (n, K)."""
    likely: NDArray[np.int8]
    """Number in ENDINGS of the trial with nothing unknown and without a disturbance, (n,)."""
    efforts: NDArray[np.float64]
    """Least effort of escape found at the weakest moment [J], (n,); NaN: it was not asked for."""
    seconds: NDArray[np.float64]
    """Computing time of each grasp [s], (n,)."""
    steps: NDArray[np.int64]
    """Simulation steps, (n,)."""
    unconverged: NDArray[np.int64]
    """Of these, steps whose contact solver did not converge, (n,)."""
    lost_time: NDArray[np.float64]
    """Of their time, that in which nothing moved, as bodies would have passed through each other
    [s], (n,)."""
    errors: dict[int, str]
    """Why a grasp has no score, by its number."""

    @property
    def complete(self) -> bool:
        """Whether every trial was made, or there is an error that says why not."""
        missing = (self.endings == MISSING).any(axis=1)
        return not any(missing[k] for k in range(len(missing)) if k not in self.errors)

    @property
    def counted(self) -> NDArray[np.int64]:
        """Trials that count, (n,): those that were made and did not diverge."""
        return np.asarray(((self.endings != MISSING) & (self.endings != DIVERGED)).sum(axis=1))

    @property
    def probabilities(self) -> NDArray[np.float64]:
        """Share of the trials in which the object was held, (n,); NaN without trials."""
        held = (self.endings == HELD).sum(axis=1)
        return np.where(self.counted > 0, held / np.maximum(self.counted, 1), np.nan)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What speaks against the scores."""
        made = int((self.endings != MISSING).sum())
        missed, collided = (ENDINGS.index(which) for which in ("not gripped", "collided"))
        places = [
            f"in {number} of {made} trials the hand {what}"
            for what, number, many in (
                ("was inside the object or the table, and moved back", (self.back > 0).sum(), MANY),
                ("found no place", (self.endings == collided).sum(), MANY),
                ("closed beside the object", (self.endings == missed).sum(), MOST),
            )
            if number > many * made
        ]
        found = [f"{'; '.join(places)}: {self._doubts()}"] if places else []
        if diverged := int((self.endings == DIVERGED).sum()):
            found.append(f"{diverged} of {made} trials diverged, and do not count")
        if self.unconverged.sum() > LOOSE * self.steps.sum():
            share_of = self.unconverged.sum() / self.steps.sum()
            found.append(
                f"the contact solver did not converge in {100 * share_of:.1f} % of the steps"
            )
        if self.lost_time.sum() > LOOSE * self.trials.step * self.steps.sum():
            share_of = self.lost_time.sum() / (self.trials.step * self.steps.sum())
            found.append(
                f"nothing moved in {100 * share_of:.1f} % of the time, as bodies would have passed "
                "through each other: a grasp may look better than it is"
            )
        if self.errors:
            number, text = next(iter(self.errors.items()))
            name = self.grasps.names[number]
            found.append(f"without a score: {len(self.errors)} grasps, as {name}: {text}")
        return tuple(found)

    def held_until(self, time: float) -> NDArray[np.float64]:
        """Share of the trials in which it was held until a time [s] after closing, (n,)."""
        held = ((self.endings == HELD) | (self.times > time)).sum(axis=1)
        return np.where(self.counted > 0, held / np.maximum(self.counted, 1), np.nan)

    def interval(self, confidence: float = 0.95) -> NDArray[np.float64]:
        """Ends of each probability's interval, (n, 2), by Clopper and Pearson; NaN without
        trials."""
        from scipy.stats import beta

        tail, trials = (1 - share("confidence", confidence)) / 2, self.counted
        held = np.rint(np.nan_to_num(self.probabilities) * trials)
        low = np.where(held > 0, beta.ppf(tail, held, trials - held + 1), 0.0)
        high = np.where(held < trials, beta.ppf(1 - tail, held + 1, trials - held), 1.0)
        ends = np.stack([low, high], axis=1)
        ends[trials == 0] = np.nan
        return ends

    @property
    def order(self) -> NDArray[np.int64]:
        """Numbers of the grasps, the best first: by probability, then by how long they hold, then
        by effort; those without a score last."""
        finest_last = (self.efforts, self.mean_time, self.probabilities)
        return np.lexsort([-np.nan_to_num(key, nan=-1.0) for key in finest_last])

    @property
    def horizon(self) -> float:
        """Duration of the protocol's motions [s]."""
        return self.trials.protocol.horizon

    @property
    def ranked(self) -> NDArray[np.int64]:
        """Numbers of the grasps that have a score, in their order."""
        return self.order[self.counted[self.order] > 0]

    @property
    def best(self) -> int:
        """Number of the grasp that holds best. Raises ValueError if none has a score, as the next
        two do."""
        return int(self._some[0])

    @property
    def doubtful(self) -> int:
        """Number of the grasp whose probability is nearest to a half."""
        some = np.sort(self._some)
        return int(some[np.abs(self.probabilities[some] - 0.5).argmin()])

    @property
    def worst(self) -> int:
        """Number of the grasp that holds worst."""
        return int(self._some[-1])

    def losses(self, number: int) -> dict[str, int]:
        """How often a grasp ended in which way, the commonest first."""
        made = [ENDINGS[code] for code in self.endings[number] if code != MISSING]
        return dict(Counter(made).most_common())

    def how_lost(self, number: int) -> str:
        """The same in words, without the trials in which it was held."""
        return ", ".join(f"{n} {how}" for how, n in self.losses(number).items() if how != "held")

    def problem(self, number: int) -> Problem:
        """The problem of a grasp once the hand has closed, as is believed most: for a viewer, an
        effort or a picture.

        Raises ValueError if the hand does not close on the object.
        """
        return self.trials.likely_problem(grasp_of(self.grasps, number))

    def rows(self) -> list[tuple[str, ...]]:
        """Rank, name, probability, interval, how and when it is lost, label; the best first."""
        figures = np.column_stack([self.probabilities, self.interval()])
        return [self._row(rank, int(k), figures[k]) for rank, k in enumerate(self.order, 1)]

    def to_csv(self, columns: Mapping[str, ArrayLike] | None = None) -> str:
        """`rows` and all figures, as CSV.

        columns: more of them by name, each (n,), as of `em.grasps.baselines`.
        """
        more = {name: np.asarray(one) for name, one in (columns or {}).items()}
        for name, column in more.items():
            check_shape(name, column, (len(self.grasps),))
        head = ["rank", "name", "probability", "low", "high", "mean_time", "effort", "label"]
        lines = [[*head, *(name.replace(" ", "_") for name in ENDINGS), *more]]
        own = (self.probabilities, self.interval(), self.mean_time, self.efforts)
        figures = np.column_stack(own)
        for rank, k in enumerate(self.order, 1):
            texts = ["" if np.isnan(one) else f"{one:.6g}" for one in figures[k]]
            label = self.grasps.labels[k]
            counts = [str(int((self.endings[k] == code).sum())) for code in range(len(ENDINGS))]
            said = "" if np.isnan(label) else f"{label:g}"
            rest = ["" if np.isnan(column[k]) else f"{column[k]:.6g}" for column in more.values()]
            lines.append([str(rank), self.grasps.names[k], *texts, said, *counts, *rest])
        return csv_text(lines[0], lines[1:])

    @property
    def mean_time(self) -> NDArray[np.float64]:
        """Mean time held within the protocol [s], (n,); a trial that did not grip counts 0."""
        capped = np.where(np.isnan(self.times), 0.0, np.minimum(self.times, self.horizon))
        counts = (self.endings != MISSING) & (self.endings != DIVERGED)
        total = np.where(counts, capped, 0.0).sum(axis=1)
        return np.where(self.counted > 0, total / np.maximum(self.counted, 1), np.nan)

    def _doubts(self) -> str:
        """What is likely wrong if the hand is not where the object is."""
        asked = self.trials
        open = np.nanmax(self.grasps.openings, initial=-1.0)
        wide = open if open > 0 else getattr(asked.hand, "opening", None)
        into = "into it" if wide is None else f"into an opening of {wide:.3g} m"
        frame = "are frame, unit and order of the quaternions (x, y, z, w) right"
        return f"{frame}, and does the object, {asked.object.size_text}, fit {into}?"

    @property
    def _some(self) -> NDArray[np.int64]:
        if len(self.ranked) == 0:
            why = f", as {next(iter(self.errors.values()))}" if self.errors else ""
            raise ValueError(
                f"none of the {len(self.grasps)} grasps has a trial that counts{why}: expected one "
                "at least"
            )
        return self.ranked

    def _row(self, rank: int, k: int, figures: NDArray[np.float64]) -> tuple[str, ...]:
        """`figures`: the probability, and the ends of its interval."""
        name, label = self.grasps.names[k], self.grasps.labels[k]
        said = "" if np.isnan(label) else f"{label:g}"
        lost = self.how_lost(k)
        if np.isnan(figures[0]):
            return str(rank), name, "-", "-", lost or self.errors.get(k, "not made"), said
        probability, within = "{:.2f}", "{:.2f} to {:.2f}"
        return (
            str(rank),
            name,
            probability.format(figures[0]),
            within.format(*figures[1:]),
            lost,
            said,
        )


def grasp_of(grasps: GraspSet, number: int) -> Grasp:
    """A grasp of a set, as trials take it."""
    return Grasp(
        number,
        grasps.poses[number],
        float(grasps.openings[number]),
        grasps.object_poses[number],
    )
