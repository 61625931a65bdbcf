"""Scores with labels: which states and trajectories are compared with which one (Section VI-D)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from energymargin.base.aliases import Floats, Ints, Mask
from energymargin.base.checks import one_of, whole_number
from energymargin.base.metrics import ANY, TIMED
from energymargin.base.reprs import Record
from energymargin.base.summary import Summarized

HORIZONS = range(6)  # frames
HORIZON = 2  # frames; the default of curves
LAST_FRAMES = 5  # frames, k-bar of Section VI-D
SUCCESS, FORCE = "success", "force"
NOW = "now/"
PROBABLE_SUCCESS = "probability/success"
SUCCESSES = (SUCCESS, PROBABLE_SUCCESS, SUCCESS + ANY)  # the metrics of trajectories

Among = Literal["all", "captured"]
"""Which states are compared: all of them, or those that are captured now."""
AMONG: tuple[Among, ...] = ("all", "captured")


@dataclass(frozen=True, eq=False, repr=False)
class LabelledScores(Record, Summarized):
    """N states of several trajectories, those of one in a row and in the order of time.

    Raises ValueError on arrays of other lengths, and on a trajectory whose states are not in a row.
    """

    task: str
    trajectory: Ints
    """Which trajectory a state is of, shape (N,)."""
    captured: Mask
    """Whether a state lies in its own capture set, shape (N,)."""
    success: Mask
    """Whether the state's trajectory succeeded, shape (N,)."""
    scores: dict[str, Floats]
    """By metric, shape (N,): inf ranks above all else, NaN is a missing score."""
    captured_any: Mask | None = None
    """Whether at least one object lies in its capture set, shape (N,); None: one set for all."""
    success_any: Mask | None = None
    """Whether the state's trajectory succeeded with at least one object, shape (N,), or None."""
    asks: str | None = None
    """The question with a clock that the scores answer, as "horizon 5 frames, plan script"; None:
    one about the state as it is."""
    frames: int | None = None
    """The horizon of that question, in frames."""

    def __post_init__(self) -> None:
        """Checks the lengths and the order."""
        states = len(self.trajectory)
        labels = ("captured", "success", "captured_any", "success_any")
        for name, values in {**{n: getattr(self, n) for n in labels}, **self.scores}.items():
            if values is not None and np.shape(values) != (states,):
                text = f"{name} has shape {np.shape(values)}, expected ({states},): one a state"
                raise ValueError(text)
        starts = [own[0] for own in self.by_trajectory() if len(own)]
        numbers, times = np.unique(self.trajectory[starts], return_counts=True)
        if len(times) and times.max() > 1:
            raise ValueError(
                f"the states of trajectory {numbers[times.argmax()]} are not in a row, expected "
                "those of one trajectory together, in the order of time"
            )

    def beside(self, now: LabelledScores) -> LabelledScores:
        """These scores, probabilities first, and beside them those of the same states as they are,
        but for success; NOW stands before a name that both have."""
        named = self.named_beside(now).items()
        others = {name: own for name, own in named if name.removeprefix(NOW) not in SUCCESSES}
        asks = f"{self.asks}; of the states as they are: {', '.join(others)}"
        timed = {metric: own for metric, own in self.scores.items() if metric in TIMED}
        return replace(self, scores=timed | self.scores | others, asks=asks)

    def named_beside(self, now: LabelledScores) -> dict[str, Floats]:
        """Scores of the same states as they are, with NOW before a name that both have."""
        own, others = self.scores, now.scores.items()
        return {f"{NOW}{name}" if name in own else name: values for name, values in others}

    def by_trajectory(self) -> list[Ints]:
        """The states' numbers, one array a trajectory."""
        ends = np.flatnonzero(np.diff(self.trajectory)) + 1
        return np.split(np.arange(len(self.trajectory)), ends)


class Compared(NamedTuple):
    """Scores and the labels with which they are compared: N states, or trajectories."""

    scores: Floats
    """Shape (N,); inf ranks above all else."""
    labels: Mask
    """Shape (N,)."""
    trajectory: Ints
    """The trajectory of each, counted from 0, shape (N,)."""
    number: Ints
    """Its number among all states, or trajectories, shape (N,), rising."""

    @property
    def of_both_kinds(self) -> bool:
        """Whether there are labels of both kinds."""
        return bool(self.labels.any() and not self.labels.all())


def captured_labels(captured: Mask, frames: int) -> Mask:
    """Label of each state of one trajectory, shape (K,): captured in all frames k to k +
    `frames`
    (Section VI-D).

    The clipped reading: a horizon that runs past the last frame ends there, so all K states have a
    label.
    """
    return np.array([captured[k : k + frames + 1].all() for k in range(len(captured))], dtype=bool)


def trajectory_score(scores: Floats, last: int = LAST_FRAMES) -> float:
    """Omega_suc(z, k-bar) of one trajectory, shape (K,) (Section VI-D).

    The weighted mean of its `last` frames, with weights 1, 2, 3, ... Raises ValueError on none.
    """
    whole_number("last", last, 1)
    tail = scores[-last:]
    return float(np.average(tail, weights=np.arange(1, len(tail) + 1)))


def state_metrics(labelled: LabelledScores) -> list[str]:
    """The metrics that `evaluate` compares with the label "captured"."""
    metrics = [metric for metric in labelled.scores if metric not in SUCCESSES]
    if labelled.captured_any is not None and FORCE in metrics:
        metrics.append(FORCE + ANY)
    return metrics


def compared_states(
    labelled: LabelledScores,
    metric: str,
    frames: int,
    *,
    among: Among = "all",
    clipped: bool = False,
) -> Compared:
    """The states that have a score, against "captured over a horizon of `frames` frames".

    Only states that have as many frames after them, unless `clipped`: then a horizon that runs past
    the last frame ends there, which asks less of the last states than of others. `among`
    "captured": only states that are captured now; to say that others are lost takes no foresight.

    A metric that ends in "/any" is compared with the label of at least one object; "force/any" is
    the force score compared with that label. Raises ValueError if there is no such metric, or no
    such label, and on `clipped` of scores with a clock: theirs does not end where the trajectory
    does.
    """
    whole_number("frames", frames, 0)
    one_of("among", among, AMONG)
    if clipped and labelled.asks is not None:
        text = f"clipped is True, but these scores ask about a while ({labelled.asks})"
        raise ValueError(f"{text}, which does not end where a trajectory does: expected False")
    scores, captured = _paired(labelled, metric, labelled.captured, labelled.captured_any)
    members = labelled.by_trajectory()
    labels = [captured_labels(captured[states], frames) for states in members]
    for states in [] if clipped else members:
        scores[states[max(len(states) - frames, 0) :]] = np.nan
    if among == "captured":
        scores[~captured] = np.nan
    numbers = np.repeat(np.arange(len(members)), [len(own) for own in members])
    return _there(scores, np.concatenate(labels), numbers)


class Counts(NamedTuple):
    """Which states a horizon compares. Each that it leaves out is counted once, by the first reason
    of these."""

    counted: int
    positives: int
    """How many of those counted stay captured."""
    lost: int
    """Lost already, where only those count that are captured now."""
    short: int
    """With too few frames left to tell."""
    unscored: int
    """Without any score."""


def count_states(
    labelled: LabelledScores, frames: int, *, among: Among = "all", clipped: bool = False
) -> Counts:
    """Counts the states that `compared_states` compares, and those that it leaves out."""
    members = labelled.by_trajectory()
    labels = np.concatenate([captured_labels(labelled.captured[own], frames) for own in members])
    left = np.concatenate([np.arange(len(own))[::-1] for own in members])
    lost = ~labelled.captured & (among == "captured")
    short = ~lost & (left < frames) & (not clipped)
    scored = ~np.all([np.isnan(labelled.scores[m]) for m in labelled.scores], axis=0)
    there = ~lost & ~short
    which = (there & scored, there & scored & labels, lost, short, there & ~scored)
    return Counts(*(int(states.sum()) for states in which))


def compared_trajectories(labelled: LabelledScores, metric: str, last: int) -> Compared:
    """The trajectories whose last frames have scores, by `trajectory_score`, against success.

    Metrics and errors as of `compared_states`.
    """
    scores, success = _paired(labelled, metric, labelled.success, labelled.success_any)
    members = labelled.by_trajectory()
    whole = np.array([trajectory_score(scores[states], last) for states in members])
    ends = np.array([success[states[-1]] for states in members])
    return _there(whole, ends, np.arange(len(members)))


def _paired(
    labelled: LabelledScores, metric: str, of_all: Mask, of_any: Mask | None
) -> tuple[Floats, Mask]:
    """The scores of a metric, a copy, and the label of all objects, or of at least one for a metric
    that ends so; the force score is the same for both."""
    name = FORCE if metric == FORCE + ANY else metric
    if name not in labelled.scores:
        there = ", ".join(labelled.scores) or "none"
        raise ValueError(f"metric is {metric!r}, expected one that has scores: {there}")
    labels = of_any if metric.endswith(ANY) else of_all
    if labels is None:
        raise ValueError(f"there are scores of {metric!r}, but no labels of at least one object")
    return labelled.scores[name].copy(), labels


def _there(scores: Floats, labels: Mask, trajectory: Ints) -> Compared:
    """Only those that have a score."""
    there = ~np.isnan(scores)
    return Compared(scores[there], labels[there], trajectory[there], np.flatnonzero(there))
