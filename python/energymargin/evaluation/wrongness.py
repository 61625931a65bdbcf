"""Wrongness of a score about a state: the share of the states with the other label that it ranks on
the wrong side; one with an equal score counts half.

Its mean over all captured states is 1 - AUC, and so is its mean over all lost ones. So the most
wrong states cost the AUC most, whatever the score's unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin.evaluation import LabelledScores
from energymargin.evaluation.curves import CAPTURED, SUCCESS, Target, metrics_against
from energymargin.evaluation.labelled import Compared, compared_states, compared_trajectories
from energymargin.metrics import ANY

__all__ = ["Ranks", "Words", "Wrongness", "by_trajectory", "ranks", "wrongness"]


class Words(NamedTuple):
    """A label in words."""

    one: str
    """Of one state, or trajectory."""
    many: str


_WORDS = {
    CAPTURED: {
        True: Words("stays captured", "states that stay captured"),
        False: Words("is lost", "states that are lost"),
    },
    SUCCESS: {
        True: Words("the trajectory succeeds", "trajectories that succeed"),
        False: Words("the trajectory fails", "trajectories that fail"),
    },
}
_WORDS_ANY = {
    CAPTURED: {
        True: Words("one object or more stays captured", "states where one or more stay captured"),
        False: Words("all objects are lost", "states where all objects are lost"),
    },
    SUCCESS: {
        True: Words("one object or more succeeds", "trajectories where one or more succeed"),
        False: Words("all objects fail", "trajectories where all objects fail"),
    },
}


class Ranks(NamedTuple):
    """Of each of N scores the shares of those with the other label, 0 to 1, shape (N,) each; NaN if
    there are none."""

    beyond: NDArray[np.float64]
    """On the wrong side of it: above one whose label is 1, below one whose label is 0."""
    level: NDArray[np.float64]
    """Equal to it."""

    @property
    def wrong(self) -> NDArray[np.float64]:
        """How wrong each score is."""
        return self.beyond + self.level / 2


@dataclass(frozen=True)
class Wrongness:
    """A metric against its label: N states, or trajectories."""

    metric: str
    target: Target
    """"captured" or "success"."""
    compared: Compared
    ranks: Ranks

    def words(self, label: bool) -> Words:
        """A label in words."""
        words = _WORDS_ANY if self.metric.endswith(ANY) else _WORDS
        return words[self.target][label]

    def worst(self, label: bool, count: int) -> list[int]:
        """Places in `compared` of the most wrong ones with this label, at most one of a trajectory;
        only such that another is on the wrong side of."""
        order = np.argsort(-self.ranks.wrong, kind="stable")
        order = order[(self.compared.labels[order] == label) & (self.ranks.beyond[order] > 0)]
        _, first = np.unique(self.compared.trajectory[order], return_index=True)
        return [int(place) for place in order[np.sort(first)][:count]]


def wrongness(labelled: LabelledScores, horizon: int, last: int) -> list[Wrongness]:
    """Every metric compared with its label, as `evaluate` does."""
    of_states = [
        (metric, CAPTURED, compared_states(labelled, metric, horizon))
        for metric in metrics_against(labelled, CAPTURED)
    ]
    of_trajectories = [
        (metric, SUCCESS, compared_trajectories(labelled, metric, last))
        for metric in metrics_against(labelled, SUCCESS)
    ]
    return [
        Wrongness(metric, target, compared, ranks(compared.scores, compared.labels))
        for metric, target, compared in (*of_states, *of_trajectories)
    ]


def ranks(scores: NDArray[np.float64], labels: NDArray[np.bool_]) -> Ranks:
    """Each score against those with the other label; both shape (N,)."""
    beyond, level = np.full(len(scores), np.nan), np.full(len(scores), np.nan)
    for label in (False, True):
        own, others = scores[labels == label], np.sort(scores[labels != label])
        if len(others):
            left, right = (np.searchsorted(others, own, side) for side in ("left", "right"))
            wrong = len(others) - right if label else left
            beyond[labels == label] = wrong / len(others)
            level[labels == label] = (right - left) / len(others)
    return Ranks(beyond, level)


def by_trajectory(every: Sequence[Wrongness], trajectories: int) -> NDArray[np.float64]:
    """Mean wrongness of each trajectory's states, over all metrics of states; shape (T,), NaN if
    there is none."""
    total, count = np.zeros(trajectories), np.zeros(trajectories)
    for one in every:
        wrong = one.ranks.wrong
        there = ~np.isnan(wrong)
        if one.target == CAPTURED:
            np.add.at(total, one.compared.trajectory[there], wrong[there])
            np.add.at(count, one.compared.trajectory[there], 1)
    mean = np.full(trajectories, np.nan)
    np.divide(total, count, out=mean, where=count > 0)
    return mean
