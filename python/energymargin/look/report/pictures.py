"""The pictures of a report, as SVG: scores along trajectories, curves, and histograms by label."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from energymargin.evaluation import LabelledScores
from energymargin.look.plots.curves import plot_distribution, plot_precision_recall, plot_roc
from energymargin.look.plots.trajectories import figure_scores, trajectory_scores
from energymargin.look.report.subject import Data, Subject
from energymargin.records.evaluation.curves import TARGETS, Wrongness, metrics_against, target_name

WORST, OTHERS, ALL = "Most wrong first", "A sample of the others", "The others"
WIDE = 8.0  # inch, of the axes of scores along a trajectory
CURVES = (10.0, 4.9)  # inch, of both curves
HISTOGRAM = (5.0, 2.7)  # inch
COLUMNS = 2  # of histograms


class Image(NamedTuple):
    """One of several pictures at the same place."""

    group: str
    """Title of the list that it is chosen from; may be empty."""
    title: str
    source: str
    """A data URI."""


class Picture(NamedTuple):
    """A place in the page: one image, or several to choose from."""

    name: str
    label: str
    """What it shows, for who cannot see it."""
    images: Sequence[Image]
    chooser: str = ""
    """The name of the choice."""


def along(subject: Subject, data: Data, wrong: NDArray[np.float64], most: int) -> Picture | None:
    """At most so many trajectories: half those whose scores are most wrong, `wrong` (T,), and of
    the others some that are evenly spaced; None if no trajectory has a score."""
    worst, others = chosen(np.array(subject.scored, int), wrong, most)
    rest = ALL if len(worst) + len(others) == len(subject.scored) else OTHERS
    images = [_trajectory(subject, data, t, WORST) for t in worst]
    images += [_trajectory(subject, data, t, rest) for t in others]
    label = "Each score along the chosen trajectory, over time"
    return Picture("along", label, images, "Trajectory") if images else None


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


def _trajectory(subject: Subject, data: Data, t: int, group: str) -> Image:
    own, labelled = subject.members[t], subject.labelled
    number = int(labelled.trajectory[own[0]])
    times = None if data.dataset is None else data.dataset.trajectories[t].times
    bands = {metric: ends[own] for metric, ends in subject.bands.items()}
    scores = trajectory_scores(labelled, number, times=times)._replace(bands=bands)
    end = "successful" if labelled.success[own[-1]] else "failed"
    captured = int(labelled.captured[own].sum())
    lacking = int(np.any([np.isnan(v[own]) for v in labelled.scores.values()], axis=0).sum())
    title = f"trajectory {number}: {end}, captured in {captured} of {len(own)}"
    title += f", {lacking} not scored" if lacking else ""
    return Image(group, title, svg(figure_scores({title: scores}, width=WIDE)))


def curves(labelled: LabelledScores, frames: int, last: int) -> Picture:
    """ROC and precision over recall of the states, and of whole trajectories."""
    images = []
    for target in TARGETS:
        if metrics_against(labelled, target):
            figure = Figure(figsize=CURVES, layout="constrained")
            left, right = figure.subplots(1, 2)
            plot_roc(labelled, ax=left, target=target, frames=frames, last=last)
            plot_precision_recall(labelled, ax=right, target=target, frames=frames, last=last)
            images.append(Image("", target_name(target, frames, last), svg(figure)))
    label = "ROC, and precision over recall, of each score"
    return Picture("roc", label, images, "Held against")


def distributions(every: Sequence[Wrongness]) -> Picture | None:
    """A histogram of each metric that has scores; None if there is none."""
    there = [one for one in every if len(one.compared.scores)]
    if not there:
        return None
    rows = math.ceil(len(there) / COLUMNS)
    size = (HISTOGRAM[0] * COLUMNS, HISTOGRAM[1] * rows)
    figure = Figure(figsize=size, layout="constrained")
    for number, one in enumerate(there):
        plot_distribution(one, figure.add_subplot(rows, COLUMNS, number + 1))
    label = "Histograms of each score by label"
    return Picture("distributions", label, [Image("", label, svg(figure))])


def svg(figure: Figure) -> str:
    """A data URI; the same figure gives the same bytes."""
    drawn = io.BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "energymargin"}):
        figure.savefig(drawn, format="svg", metadata={"Date": None, "Creator": None})
    return f"data:image/svg+xml;base64,{base64.b64encode(drawn.getvalue()).decode()}"
