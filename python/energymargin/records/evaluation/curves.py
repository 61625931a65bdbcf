"""How well a score predicts a label, as curves: ROC, and precision over recall; and how wrong it
is about one state.

Scores and labels are paired as in `evaluate`, and AUC and AP are its numbers.

A score's wrongness about a state is the share of the states with the other label that it ranks on
the wrong side; one with an equal score counts half. Its mean over all captured states is 1 - AUC,
and so is its mean over all lost ones. So the most wrong states cost the AUC most, whatever the
score's unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from energymargin.base.aliases import Floats, Mask
from energymargin.base.checks import one_of, whole_number
from energymargin.base.errors import EnergyMarginError
from energymargin.base.reprs import Record
from energymargin.records.evaluation import labelled as pairing
from energymargin.records.evaluation.bootstrap import auc_ap, ranked

__all__ = [
    "TARGETS",
    "OneLabelError",
    "PrecisionRecall",
    "Ranks",
    "Roc",
    "Target",
    "Wrongness",
    "by_trajectory",
    "metrics_against",
    "precision_recall",
    "ranks",
    "roc",
    "target_name",
    "wrongness",
]

Target = Literal["captured", "success"]
CAPTURED: Target = "captured"
SUCCESS: Target = "success"
TARGETS: tuple[Target, ...] = (CAPTURED, SUCCESS)
"""The labels of a score: that a state stays captured over a horizon of frames, or that its
trajectory succeeds."""


@dataclass(frozen=True, eq=False, repr=False)
class Roc(Record):
    """Receiver operating characteristic: P points, from none that counts as positive to all.

    States, or trajectories, whose score is at least the threshold count as positive.
    """

    false_positive_rate: Floats
    """Shape (P,), from 0 rising to 1."""
    true_positive_rate: Floats
    """Shape (P,), from 0 rising to 1."""
    threshold: Floats
    """In the score's unit, shape (P,), falling; may be inf. NaN at the first point: none counts."""
    auc: float
    """Area under the curve, as of `evaluate`."""
    count: int
    """How many states, or trajectories."""
    positives: int
    """How many of them have the label 1."""


@dataclass(frozen=True, eq=False, repr=False)
class PrecisionRecall(Record):
    """Precision over recall: P points, from none that counts as positive to where all recall is.

    States, or trajectories, whose score is at least the threshold count as positive.
    """

    recall: Floats
    """Shape (P,), from 0 rising to 1."""
    precision: Floats
    """Shape (P,); 1 at the first point, where none counts as positive."""
    threshold: Floats
    """In the score's unit, shape (P,), falling; may be inf. NaN at the first point: none counts."""
    ap: float
    """Average precision, as of `evaluate`: the area below steps, each at the height of its end."""
    count: int
    """How many states, or trajectories."""
    positives: int
    """How many of them have the label 1."""

    @property
    def steps(self) -> Floats:
        """Heights at `recall` whose steps, each at the height of its end, are drawn: the precision,
        which at the first point begins the first step; shape (P,)."""
        return np.concatenate([self.precision[1:2], self.precision[1:]])


class OneLabelError(EnergyMarginError, ValueError):
    """There is one label alone, so there is no curve."""

    def __init__(self, message: str, brief: str = "one label only") -> None:
        """`brief` says it in a few words, for a legend."""
        super().__init__(message)
        self.brief = brief


def roc(
    labelled: pairing.LabelledScores,
    metric: str,
    *,
    target: Target = CAPTURED,
    frames: int = pairing.HORIZON,
    last: int = pairing.LAST_FRAMES,
    among: pairing.Among = "all",
) -> Roc:
    """The ROC of a metric.

    `target`: "captured", over so many `frames` after a state's own, or "success" of a whole
    trajectory, against the weighted mean of its `last` frames' scores. A metric that ends in "/any"
    is compared with the label of at least one object; "force/any" is the force score.
    States without a score, or with fewer frames left, are left out, and with
    `among` "captured" those that are not captured now. Raises ValueError on a metric that has no
    scores, another word, negative `frames`, `last` below 1; OneLabelError if all labels are alike.
    """
    from sklearn.metrics import roc_curve

    compared = _compared(labelled, metric, _Asked(target, frames, last, among))
    scores, labels, *_ = compared
    false, true, rank = roc_curve(labels, ranked(scores))
    auc, _ = auc_ap(scores, labels)
    limits = _thresholds(compared, rank[1:])
    return Roc(np.asarray(false), np.asarray(true), limits, auc, len(labels), int(labels.sum()))


def precision_recall(
    labelled: pairing.LabelledScores,
    metric: str,
    *,
    target: Target = CAPTURED,
    frames: int = pairing.HORIZON,
    last: int = pairing.LAST_FRAMES,
    among: pairing.Among = "all",
) -> PrecisionRecall:
    """Precision over recall of a metric; arguments and errors as of `roc`."""
    from sklearn.metrics import precision_recall_curve

    compared = _compared(labelled, metric, _Asked(target, frames, last, among))
    scores, labels, *_ = compared
    precision, recall, rank = precision_recall_curve(labels, ranked(scores))
    first = int(np.flatnonzero(recall == 1.0)[-1])  # below that threshold precision alone is lost
    recall, precision = (np.asarray(each[first:][::-1]) for each in (recall, precision))
    _, ap = auc_ap(scores, labels)
    limits = _thresholds(compared, rank[first:][::-1])
    return PrecisionRecall(recall, precision, limits, ap, len(labels), int(labels.sum()))


def metrics_against(labelled: pairing.LabelledScores, target: Target = CAPTURED) -> list[str]:
    """The metrics that `evaluate` compares with a target; ValueError on another target."""
    if one_of("target", target, TARGETS) == CAPTURED:
        return pairing.state_metrics(labelled)
    return [metric for metric in pairing.SUCCESSES if metric in labelled.scores]


def target_name(
    target: Target = CAPTURED, frames: int = pairing.HORIZON, last: int = pairing.LAST_FRAMES
) -> str:
    """A target in words, for a title."""
    if target == SUCCESS:
        return f"success of a trajectory, by its last {last} frames"
    return f"captured over the next {frames} frame{'s' * (frames != 1)}" if frames else "captured"


class _Asked(NamedTuple):
    """What scores are compared with, as of `roc`."""

    target: Target
    frames: int
    last: int
    among: pairing.Among = "all"

    def compared(self, labelled: pairing.LabelledScores, metric: str) -> pairing.Compared:
        """The scores and labels."""
        if self.target == CAPTURED:
            return pairing.compared_states(labelled, metric, self.frames, among=self.among)
        return pairing.compared_trajectories(labelled, metric, self.last)


def _compared(labelled: pairing.LabelledScores, metric: str, asked: _Asked) -> pairing.Compared:
    """The scores and labels; raises OneLabelError unless there are labels of both kinds."""
    target, frames, last, _ = asked
    one_of("target", target, TARGETS)
    whole_number("frames", frames, 0)
    whole_number("last", last, 1)
    if not len(labelled.trajectory):
        raise OneLabelError("there are no states", "no states")
    compared = asked.compared(labelled, metric)
    what = "states" if target == CAPTURED else "trajectories"
    if not len(compared.labels):
        raise OneLabelError(f"none of the {what} has a score of {metric!r}", "no scores yet")
    if not compared.of_both_kinds:
        which = "all" if compared.labels.all() else "none"
        have = "have" if which == "all" else "has"
        raise OneLabelError(
            f"{which} of the {len(compared.labels)} {what} with a score of {metric!r} {have} the "
            f"label {target_name(target, frames, last)!r}: expected both labels"
        )
    return compared


def _thresholds(compared: pairing.Compared, ranks: Floats) -> Floats:
    """NaN, and the scores that have these ranks."""
    return np.concatenate([[np.nan], np.unique(compared.scores)[np.asarray(ranks, dtype=int)]])


_WORDS: dict[Target, tuple[str, str]] = {
    CAPTURED: ("is lost", "stays captured"),
    SUCCESS: ("the trajectory fails", "the trajectory succeeds"),
}


class Ranks(NamedTuple):
    """Shares of the scores with the other label, 0 to 1, for each of N scores, shape (N,); NaN if
    there are none."""

    beyond: Floats
    """On the wrong side of it: above one whose label is 1, below one whose label is 0."""
    level: Floats
    """Equal to it."""

    @property
    def wrong(self) -> Floats:
        """How wrong each score is."""
        return self.beyond + self.level / 2


@dataclass(frozen=True)
class Wrongness:
    """A metric against its label: N states, or trajectories."""

    metric: str
    target: Target
    """"captured" or "success"."""
    compared: pairing.Compared
    ranks: Ranks

    def words(self, label: bool) -> str:
        """A label of one state, or trajectory, in words."""
        return _WORDS[self.target][label]

    def worst(self, label: bool, count: int) -> list[int]:
        """Places in `compared` of the most wrong ones with this label, at most one of a trajectory;
        only such that another is on the wrong side of."""
        order = np.argsort(-self.ranks.wrong, kind="stable")
        order = order[(self.compared.labels[order] == label) & (self.ranks.beyond[order] > 0)]
        _, first = np.unique(self.compared.trajectory[order], return_index=True)
        return [int(place) for place in order[np.sort(first)][:count]]


def wrongness(labelled: pairing.LabelledScores, frames: int, last: int) -> list[Wrongness]:
    """Every metric compared with its label, as `evaluate` does."""
    found = []
    for target in TARGETS:
        for metric in metrics_against(labelled, target):
            compared = _Asked(target, frames, last).compared(labelled, metric)
            wrong = ranks(compared.scores, compared.labels)
            found.append(Wrongness(metric, target, compared, wrong))
    return found


def ranks(scores: Floats, labels: Mask) -> Ranks:
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


def by_trajectory(every: Sequence[Wrongness], trajectories: int) -> Floats:
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
