"""The pictures of a report, as SVG: scores along trajectories, curves, and histograms by label."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

import energymargin as em
from energymargin.look.plots.curves import plot_distribution, plot_precision_recall, plot_roc
from energymargin.look.plots.trajectories import figure_scores, trajectory_scores
from energymargin.look.report.subject import Subject

WORST, OTHERS, ALL = "Most wrong first", "A sample of the others", "The others"
WIDE = 8.0  # inch, of the axes of scores along a trajectory
CURVES = (10.0, 4.9)  # inch, of both curves
HISTOGRAM = (5.0, 2.7)  # inch
COLUMNS = 2  # of histograms


class Image(NamedTuple):
    """One of several pictures at the same place."""

    title: str
    source: str
    """A data URI."""
    group: str = ""
    """Title of the list that it is chosen from."""


def along(subject: Subject, wrong: NDArray[np.float64], most: int) -> list[Image]:
    """At most so many trajectories: half those whose scores are most wrong, `wrong` (T,), and of
    the others some that are evenly spaced."""
    worst, others = chosen(np.array(subject.scored, int), wrong, most)
    rest = ALL if len(worst) + len(others) == len(subject.scored) else OTHERS
    groups = {**dict.fromkeys(worst, WORST), **dict.fromkeys(others, rest)}
    return [_trajectory(subject, t, group) for t, group in groups.items()]


def chosen(
    scored: NDArray[np.int64], wrong: NDArray[np.float64], most: int
) -> tuple[list[int], list[int]]:
    """The most wrong of the trajectories `scored`, from the worst on, and evenly spaced others,
    rising."""
    order = scored[np.argsort(-np.nan_to_num(wrong[scored], nan=-1.0), kind="stable")]
    worst = order[: (most + 1) // 2]
    rest = np.sort(order[len(worst) :])
    few = min(most - len(worst), len(rest))
    others = rest[np.linspace(0, len(rest) - 1, few).round().astype(int)] if few else rest[:0]
    return worst.tolist(), others.tolist()


def _trajectory(subject: Subject, t: int, group: str) -> Image:
    own, labelled = subject.members[t], subject.labelled
    number = int(labelled.trajectory[own[0]])
    times = None if subject.dataset is None else subject.dataset.trajectories[t].times
    bands = {metric: ends[own] for metric, ends in subject.bands.items()}
    scores = trajectory_scores(labelled, number, times=times)._replace(bands=bands)
    end = "successful" if labelled.success[own[-1]] else "failed"
    captured = int(labelled.captured[own].sum())
    lacking = int(np.any([np.isnan(v[own]) for v in labelled.scores.values()], axis=0).sum())
    title = f"trajectory {number}: {end}, captured in {captured} of {len(own)}"
    title += f", {lacking} not scored" if lacking else ""
    return Image(title, svg(figure_scores({title: scores}, width=WIDE)), group)


def both_curves(labelled: em.evaluation.LabelledScores, frames: int, last: int) -> list[Image]:
    """ROC and precision over recall of the states, and of whole trajectories."""
    images = []
    for target in em.evaluation.curves.TARGETS:
        if em.evaluation.curves.metrics_against(labelled, target):
            figure = Figure(figsize=CURVES, layout="constrained")
            asked: dict[str, Any] = {"target": target, "frames": frames, "last": last}
            for plot, ax in zip(
                (plot_roc, plot_precision_recall), figure.subplots(1, 2), strict=True
            ):
                plot(labelled, ax=ax, **asked)
            images.append(
                Image(em.evaluation.curves.target_name(target, frames, last), svg(figure))
            )
    return images


def distributions(every: Sequence[em.evaluation.curves.Wrongness]) -> str:
    """A histogram of each metric that has scores, as a data URI; empty if there is none."""
    there = [one for one in every if len(one.compared.scores)]
    rows = math.ceil(len(there) / COLUMNS)
    figure = Figure(figsize=(HISTOGRAM[0] * COLUMNS, HISTOGRAM[1] * rows), layout="constrained")
    for number, one in enumerate(there):
        plot_distribution(one, figure.add_subplot(rows, COLUMNS, number + 1))
    return svg(figure) if there else ""


def svg(figure: Figure) -> str:
    """A data URI; the same figure gives the same bytes."""
    drawn = io.BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "energymargin"}):
        figure.savefig(drawn, format="svg", metadata={"Date": None, "Creator": None})
    return f"data:image/svg+xml;base64,{base64.b64encode(drawn.getvalue()).decode()}"
