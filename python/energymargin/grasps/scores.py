"""Scores of grasps: what became of each trial, and what follows from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin import Problem
from energymargin.base.checks import check_shape, not_negative_number, share
from energymargin.base.table_text import csv_text
from energymargin.grasps.grasp_set import GraspSet
from energymargin.grasps.outcomes import ENDINGS, Grasp
from energymargin.grasps.trials import GraspTrials
from energymargin.summary import Summarized

HELD, DIVERGED = ENDINGS.index("held"), ENDINGS.index("diverged")
MISSING = -1  # in place of an ending
OF_TRIALS = ("endings", "times", "back", "redrawn")
ARRAYS: dict[str, Any] = dict.fromkeys(("endings", "likely"), np.int8(MISSING))
ARRAYS |= dict.fromkeys(("times", "efforts"), np.nan)
ARRAYS |= dict.fromkeys(("back", "seconds", "lost_time"), 0.0)
ARRAYS |= dict.fromkeys(("redrawn", "steps", "unconverged"), 0)
"""The arrays of GraspScores, and what they have before there are trials."""
MANY, MOST = 0.2, 0.8  # shares of the trials
LOOSE = 0.01  # share of the steps


@dataclass(frozen=True, eq=False, repr=False)
class GraspScores(Summarized):
    """How n grasps fared in K trials each."""

    grasps: GraspSet
    trials: GraspTrials
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

    @staticmethod
    def before(grasps: GraspSet, trials: GraspTrials, rollouts: int) -> GraspScores:
        """Scores without a trial so far, which need no memory: `writable` makes the arrays."""
        n = len(grasps)
        shapes = {name: (n, rollouts) if name in OF_TRIALS else (n,) for name in ARRAYS}
        arrays = {name: np.broadcast_to(ARRAYS[name], shape) for name, shape in shapes.items()}
        return GraspScores(grasps, trials, **arrays, errors={})

    def writable(self) -> GraspScores:
        """The same, in arrays that can be filled."""
        arrays = {name: np.require(getattr(self, name), requirements="W") for name in ARRAYS}
        return replace(self, **arrays)

    @property
    def complete(self) -> bool:
        """Whether every trial was made, or there is an error that says why not."""
        missing = np.flatnonzero((self.endings == MISSING).any(axis=1))
        return set(missing.tolist()) <= set(self.errors)

    @property
    def counted(self) -> NDArray[np.int64]:
        """Trials that count, (n,): those that were made and did not diverge."""
        return np.asarray(self._count.sum(axis=1))

    @property
    def _count(self) -> NDArray[np.bool_]:
        """Whether each trial counts, (n, K)."""
        return np.asarray((self.endings != MISSING) & (self.endings != DIVERGED))

    @property
    def colliding(self) -> NDArray[np.int64]:
        """Trials in which the hand was in the object or the table, (n,): lost, or made with another
        pose."""
        lost = self.endings == ENDINGS.index("collided")
        return np.asarray((lost | (self.redrawn > 0) | (self.back > 0)).sum(axis=1))

    @property
    def probabilities(self) -> NDArray[np.float64]:
        """Share of the trials in which the object was held, (n,); NaN without trials."""
        return self.held_until(np.inf)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What speaks against the scores."""
        made = int((self.endings != MISSING).sum())
        inside, missed = self.colliding.sum(), (self.endings == ENDINGS.index("not gripped")).sum()
        hand, solver = f"of {made} trials the hand", "the contact solver"
        n = max(self.steps.sum(), 1)
        places = {f"in {inside} {hand} was inside the object or the table": inside > MANY * made}
        places[f"in {missed} {hand} closed beside the object"] = missed > MOST * made
        wrong = "; ".join(text for text, many in places.items() if many)
        diverged = int((self.endings == DIVERGED).sum())
        loose, lost = self.unconverged.sum() / n, self.lost_time.sum() / n / self.trials.step
        still = f"nothing moved in {100 * lost:.1f} % of the time, as bodies would have passed"
        number, error = next(iter(self.errors.items()), (0, ""))
        without = f"without a score: {len(self.errors)} grasps, as {self.grasps.names[number]}"
        found = {
            f"{wrong}: {self._doubts()}": wrong,
            f"{diverged} of {made} trials diverged, and do not count": diverged,
            f"{solver} did not converge in {100 * loose:.1f} % of the steps": loose > LOOSE,
            f"{still} through each other: a grasp may look better than it is": lost > LOOSE,
            f"{without}: {error}": self.errors,
        }
        return tuple(text for text, true in found.items() if true)

    def held_until(self, time: float) -> NDArray[np.float64]:
        """Share of the trials in which it was held until a time [s] after closing, (n,).

        Raises ValueError on a time that is neither inf nor a finite number of at least 0.
        """
        time = time if time == np.inf else not_negative_number("time", time)
        return self._mean((self.endings == HELD) | (self.times > time))

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

    def shown(self, number: int) -> tuple[Problem, str]:
        """The problem of a grasp to look at, as is believed most, and why the hand could not close
        on the object: then it is open, where the grasp says. Else that is empty."""
        grasp = grasp_of(self.grasps, number)
        problem, why = self.trials.likely(grasp)
        return (problem or self.trials.open_problem(grasp)), why

    def table(self, ranks: Sequence[int] | None = None) -> dict[str, list[str]]:
        """Texts by column, the best grasp first: all of them, or those of some ranks, from 0 on.
        What is not known is empty, and a column of which nothing is known is left out."""
        ranks = range(len(self.grasps)) if ranks is None else ranks
        order, ends = self.order[list(ranks)], self.interval()
        columns = {
            "rank": [str(rank + 1) for rank in ranks],
            "grasp": [self.grasps.names[k] for k in order],
            "holds": [_text("{:.2f}", self.probabilities[k]) for k in order],
            "95 % interval": [_text("{:.2f} to {:.2f}", *ends[k]) for k in order],
            "for": [_text("{:.2g} s", self.mean_time[k]) for k in order],
            "lost": [self.how_lost(k) or self.errors.get(k, "") for k in order],
            "colliding": [str(self.colliding[k] or "") for k in order],
            "redrawn": [str(self.redrawn[k].sum() or "") for k in order],
            "effort": [_text("{:.2g} J", self.efforts[k]) for k in order],
            "label": [_text("{:g}", self.grasps.labels[k]) for k in order],
        }
        return {name: column for name, column in columns.items() if any(column)}

    def to_csv(self, columns: Mapping[str, ArrayLike] | None = None) -> str:
        """All figures, as CSV, the best grasp first.

        columns: more of them by name, each (n,), as of `em.grasps.baselines`.
        """
        more = {name: np.asarray(one) for name, one in (columns or {}).items()}
        for name, column in more.items():
            check_shape(name, column, (len(self.grasps),))
        own = (self.probabilities, *self.interval().T, self.mean_time, self.efforts)
        counts = [(self.endings == code).sum(axis=1) for code in range(len(ENDINGS))]
        counts += [self.colliding, self.redrawn.sum(axis=1)]
        figures = np.column_stack([*own, self.grasps.labels, *counts, *more.values()])
        head = ["rank", "name", "probability", "low", "high", "mean_time", "effort", "label"]
        texts = [[_text("{:.6g}", figure) for figure in row] for row in figures]
        lines = [[rank, self.grasps.names[k], *texts[k]] for rank, k in enumerate(self.order, 1)]
        head += [name.replace(" ", "_") for name in (*ENDINGS, "colliding", "redrawn")]
        return csv_text([*head, *more], lines)

    @property
    def mean_time(self) -> NDArray[np.float64]:
        """Mean time held within the protocol [s], (n,); a trial that did not grip counts 0."""
        capped = np.where(np.isnan(self.times), 0.0, np.minimum(self.times, self.horizon))
        return self._mean(np.where(self._count, capped, 0.0))

    def _mean(self, values: NDArray[Any]) -> NDArray[np.float64]:
        """Mean of values of the trials that count, (n,), which are 0 of others; NaN without any."""
        means = values.sum(axis=1) / np.maximum(self.counted, 1)
        return np.where(self.counted > 0, means, np.nan)

    def _doubts(self) -> str:
        """What is likely wrong if the hand is not where the object is."""
        open = np.nanmax(self.grasps.openings, initial=-1.0)
        wide = open if open > 0 else getattr(self.trials.hand, "opening", None)
        into = "into it" if wide is None else f"into an opening of {wide:.3g} m"
        frame = "are frame, unit and order of the quaternions (x, y, z, w) right"
        return f"{frame}, and does the object, {self.trials.object.size_text}, fit {into}?"

    @property
    def _some(self) -> NDArray[np.int64]:
        if len(self.ranked) == 0:
            why = f", as {next(iter(self.errors.values()))}" if self.errors else ""
            none = f"none of the {len(self.grasps)} grasps has a trial that counts{why}"
            raise ValueError(f"{none}: expected one at least")
        return self.ranked


def _text(form: str, *values: float) -> str:
    return "" if np.isnan(values).any() else form.format(*values)


def grasp_of(grasps: GraspSet, number: int) -> Grasp:
    """A grasp of a set, as trials take it."""
    pose, opening = grasps.poses[number], float(grasps.openings[number])
    return Grasp(number, pose, opening, grasps.object_poses[number])
