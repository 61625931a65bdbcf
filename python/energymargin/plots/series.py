"""What is drawn of one trajectory: its scores, with the labels of its frames."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.evaluation import LabelledScores
from energymargin.metrics import is_likelihood
from energymargin.store import Run, ScoreStore

__all__ = ["Along", "Scores", "along", "checked", "labelled_scores"]

Scores = LabelledScores | Run | ScoreStore | str | os.PathLike[str]
"""Scores with their labels: in memory, of a run, or of the only run of a file, by its path too."""


def labelled_scores(scores: Scores) -> LabelledScores:
    """What there is; ValueError if it is none of these, or a file that has not just one run."""
    if isinstance(scores, LabelledScores):
        return scores
    if isinstance(scores, Run):
        return scores.labelled_scores()
    if isinstance(scores, ScoreStore):
        return scores.run().labelled_scores()
    if isinstance(scores, (str, os.PathLike)):
        with ScoreStore(scores) as store:
            return labelled_scores(store)
    raise ValueError(
        f"scores is a {type(scores).__name__}, expected LabelledScores, a Run or a ScoreStore, or "
        "the path of a file of scores"
    )


class Along(NamedTuple):
    """What `plot_scores` draws of one trajectory of K frames."""

    times: NDArray[np.float64] | None
    """Of the frames [s], shape (K,), rising; None: they are counted."""
    scores: Mapping[str, NDArray[np.float64]]
    """By metric, shape (K,): inf where no escape was found, NaN where there is no score."""
    captured: NDArray[np.bool_] | None
    """Whether each frame is captured, shape (K,); None: it is not known."""

    @property
    def frames(self) -> NDArray[np.float64]:
        """Where they are on the x axis: at their times [s], or else their numbers."""
        if self.times is not None:
            return self.times
        return np.arange(len(next(iter(self.scores.values()))), dtype=float)


def along(scores: Scores, trajectory: int, times: ArrayLike | None = None) -> Along:
    """The scores and labels of one trajectory, by its number, of a store's run or of what it has.

    `scores` as of `plot_roc`. `times` of its frames [s], shape (K,), as a `Trajectory` has them; a
    run does not know them. Raises ValueError if there is no such trajectory.
    """
    labelled = labelled_scores(scores)
    states = np.flatnonzero(labelled.trajectory == trajectory)
    if not len(states):
        there = np.unique(labelled.trajectory)
        known = f"one from {there[0]} to {there[-1]}" if len(there) else "none, for there are none"
        raise ValueError(f"trajectory is {trajectory!r}, expected {known}")
    return Along(
        None if times is None else np.asarray(times, dtype=float),
        {metric: values[states] for metric, values in labelled.scores.items()},
        labelled.captured[states],
    )


def checked(
    times: ArrayLike | None, scores: Mapping[str, ArrayLike], captured: ArrayLike | None
) -> Along:
    """What can be drawn; ValueError on anything else, as of `plot_scores`."""
    if not (isinstance(scores, Mapping) and scores):
        kind = "empty" if isinstance(scores, Mapping) else f"a {type(scores).__name__}"
        raise ValueError(f"scores is {kind}, expected arrays by metric")
    arrays = {name: _numbers(name, values) for name, values in scores.items()}
    name, first = next(iter(arrays.items()))
    if first.ndim != 1 or not len(first):
        raise ValueError(f"{name} has shape {first.shape}, expected (K,), K > 0: a number a frame")
    frames = len(first)
    for name, values in arrays.items():
        _check_shape(name, values, frames)
        _check_scores(name, values)
    if times is not None:
        times = _numbers("times", times)
        _check_shape("times", times, frames)
        _check_times(times)
    return Along(times, arrays, None if captured is None else _labels(captured, frames))


def _numbers(name: str, values: ArrayLike) -> NDArray[np.float64]:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {values!r}, expected numbers") from None


def _check_shape(name: str, values: NDArray[Any], frames: int) -> None:
    if values.shape != (frames,):
        raise ValueError(f"{name} has shape {values.shape}, expected ({frames},)")


def _check_scores(name: str, values: NDArray[np.float64]) -> None:
    """NaN is a score that is not there, and inf an effort without an escape."""
    low, high = (0.0, 1.0) if is_likelihood(name) else (np.finfo(float).min, np.inf)
    wrong = values[(values < low) | (values > high)]
    if len(wrong):
        expected = "0 to 1" if is_likelihood(name) else "a number or inf"
        raise ValueError(
            f"{name} has {wrong[0]:g}, expected {expected}, or NaN where there is none"
        )


def _check_times(times: NDArray[np.float64]) -> None:
    wrong = ~np.isfinite(times)
    wrong[1:] |= ~(np.diff(times) > 0)
    if wrong.any():
        k = int(wrong.argmax())
        raise ValueError(f"times has {times[k]:g} at frame {k}, expected finite numbers that rise")


def _labels(captured: ArrayLike, frames: int) -> NDArray[np.bool_]:
    labels = np.asarray(captured)
    _check_shape("captured", labels, frames)
    wrong = [label for label in labels.tolist() if label not in (0, 1)]
    if wrong:
        raise ValueError(f"captured has {wrong[0]!r}, expected True and False, or 1 and 0")
    return labels.astype(bool)
