"""The pictures of a report: scores along trajectories, curves, and histograms by label, as SVG; and
the states that each score gets most wrong, as pictures of their search trees.

A tree is searched again as it was for the score in the file: the same problem, nodes and seed give
the same bits.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Callable, Sequence
from itertools import count
from typing import Any, NamedTuple

import numpy as np
import PIL.Image
from matplotlib import pyplot, rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import energymargin as em
from energymargin.base.aliases import Floats, Ints
from energymargin.base.metrics import with_unit
from energymargin.base.table_text import sentence
from energymargin.datasets import Dataset, Future
from energymargin.evaluation import curves
from energymargin.look import plots
from energymargin.look.outlines import Plan
from energymargin.look.plots.curves import plot_distribution, plot_precision_recall, plot_roc
from energymargin.look.plots.trajectories import figure_scores, trajectory_scores
from energymargin.look.plots.trees import Result
from energymargin.look.report.subject import Subject, view_command

WORST, OTHERS, ALL = "Most wrong first", "A sample of the others", "The others"
WIDE = 8.0  # inch, of the axes of scores along a trajectory
CURVES = (10.0, 4.9)  # inch, of both curves
HISTOGRAM = (5.0, 2.7)  # inch
COLUMNS = 2  # of histograms
RESOLUTION = 130  # dots an inch
COLORS = 256


class Image(NamedTuple):
    """One of several pictures at the same place."""

    title: str
    source: str
    """A data URI."""
    group: str = ""
    """Title of the list that it is chosen from."""


def along(subject: Subject, wrong: Floats, most: int) -> list[Image]:
    """At most so many trajectories: half those whose scores are most wrong, `wrong` (T,), and of
    the others some that are evenly spaced."""
    worst, others = chosen(np.array(subject.scored, int), wrong, most)
    rest = ALL if len(worst) + len(others) == len(subject.scored) else OTHERS
    groups = {**dict.fromkeys(worst, WORST), **dict.fromkeys(others, rest)}
    return [_trajectory(subject, t, group) for t, group in groups.items()]


def chosen(scored: Ints, wrong: Floats, most: int) -> tuple[list[int], list[int]]:
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
    for target in curves.TARGETS:
        if curves.metrics_against(labelled, target):
            figure = Figure(figsize=CURVES, layout="constrained")
            asked: dict[str, Any] = {"target": target, "frames": frames, "last": last}
            left, right = figure.subplots(1, 2)
            plot_roc(labelled, ax=left, **asked)
            plot_precision_recall(labelled, ax=right, **asked)
            images.append(Image(curves.target_name(target, frames, last), svg(figure)))
    return images


def distributions(every: Sequence[curves.Wrongness]) -> str:
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
    return _embedded("svg+xml", drawn)


class Card(NamedTuple):
    """One state or grasp, and why it is shown."""

    title: str
    text: str
    images: Sequence[str]
    """Data URIs."""
    view: str = ""
    """The command that shows it in the viewer; empty without a dataset."""
    why: str = ""
    """Why there is no image, why it is not that of the score in the file, or why the
    score is uncertain."""


class WorstStates(NamedTuple):
    """The most wrong states of one metric."""

    metric: str
    cards: list[Card]
    none: str
    """Why there is none, if so."""


def worst(
    subject: Subject,
    every: Sequence[curves.Wrongness],
    *,
    each: int,
    progress: Callable[[float], None],
) -> tuple[list[WorstStates], str]:
    """Up to `each` states of each metric and label; and why there are no pictures, empty if there
    are. progress(share) has the share that is done."""
    repeater, lacking = None, subject.lacking
    if subject.dataset is not None:
        try:
            repeater = SearchRepeater(subject.dataset, subject.run.settings, subject.run.future)
        except ValueError as error:
            lacking = str(error)
    chosen = [(one, one.worst(False, each) + one.worst(True, each)) for one in every]
    total, done = max(1, sum(len(places) for _, places in chosen)), count()

    def card(one: curves.Wrongness, place: int) -> Card:
        progress(next(done) / total)
        return _card(subject, repeater, one, place)

    found = [WorstStates(one.metric, [card(one, p) for p in ps], _none(one)) for one, ps in chosen]
    return found, lacking


def _card(
    subject: Subject, repeater: SearchRepeater | None, one: curves.Wrongness, place: int
) -> Card:
    """Card of a state, or of the last state of a trajectory: the score and what happened, which
    contradict each other."""
    compared = one.compared
    score, label = float(compared.scores[place]), bool(compared.labels[place])
    title = f"{one.metric} {with_unit(one.metric, score)}, but {one.words(label)}"
    if one.target == "captured":
        number = int(compared.number[place])
    else:
        number = int(subject.members[compared.trajectory[place]][-1])
    t, frame = int(subject.labelled.trajectory[number]), int(subject.frames[number])
    where, view = f"Trajectory {t}, frame {frame}", view_command(subject)
    if subject.dataset is not None:
        where += f" ({subject.dataset.trajectories[t].times[frame]:.3g} s)"
        view += f" --trajectory {t} --frame {frame}"
    images, why = [], ""
    if repeater is not None:
        try:
            repeated = repeater.repeat(number, one.metric)
            images = pictures(repeated, repeater.plane)
            why = _notes(float(subject.scores(one.metric)[number]), repeated, subject.run.sampling)
        except (ValueError, RuntimeError) as error:  # of a task that has changed, or is gone
            why = f"No picture: {error}."
    return Card(title, f"{where}. {_why(one, place)}", images, view, why)


def _notes(stored: float, repeated: RepeatedSearch, sampling: object | None) -> str:
    """What is to be known of a picture, and of the score in the file."""
    text = ""
    if sampling is not None:
        text = (
            f"The picture shows the model without its errors, whose score is {repeated.score:.4g}; "
            f"the file has {stored:.4g}, the mean of draws of the belief."
        )
    elif repeated.score != stored:
        text = (
            f"Not the tree of the score in the file: searched again it gives {repeated.score:.4g}, "
            f"and the file has {stored:.4g}. The task or energymargin has changed since."
        )
    warnings = () if repeated.search is None else repeated.search.warnings
    return " ".join(filter(None, (text, *map(sentence, warnings))))


def _why(one: curves.Wrongness, place: int) -> str:
    side = "below" if one.compared.labels[place] else "above"
    side += " or level with" if one.ranks.level[place] else ""
    share = one.ranks.beyond[place] + one.ranks.level[place]
    return f"Ranked {side} {100 * share:.3g} % of all with the other label."


def _none(one: curves.Wrongness) -> str:
    if one.compared.of_both_kinds:
        return "it ranks none on the wrong side"
    return "there are no scores" if not len(one.compared.labels) else "all have the same label"


class RepeatedSearch(NamedTuple):
    """A state's problem, the search for one of its scores, and that score."""

    problem: em.Problem
    search: Result | em.CaptureProbability | None
    """None for the force score, which needs no search."""
    score: float


class SearchRepeater:
    """Repeats the searches of a dataset's states."""

    def __init__(
        self, dataset: Dataset, settings: dict[str, Any], future: Future | None = None
    ) -> None:
        """`settings` and `future`: of the run. Raises ValueError if the settings are not those of a
        search, or if the task cannot be made."""
        try:
            self._settings = em.searches.SearchSettings(**settings)
        except TypeError:
            text = f"the run's settings are those of another program: {settings}"
            raise ValueError(text) from None
        self._dataset, self._future = dataset, future
        self.plane = em.tasks.plane_of(em.tasks.make(dataset.task, **dataset.parameters))
        """In which pictures show the task."""

    def repeat(self, number: int, metric: str) -> RepeatedSearch:
        """The search behind a metric of the state of this number. Raises ValueError if its problem
        cannot be made."""
        (problem,) = self._dataset.problems([number], future=self._future)
        found = em.searches.metric_search(problem, metric, self._settings, number, warn=False)
        shown = None if isinstance(found, em.ForceScore) else found
        return RepeatedSearch(problem, shown, em.searches.value_of(metric, found))


def pictures(repeated: RepeatedSearch, plane: Plan) -> list[str]:
    """The state and its search, as data URIs; of a probability the undisturbed future and the
    curve."""
    problem, search = repeated.problem, repeated.search
    with pyplot.ioff():
        if isinstance(search, em.CaptureProbability):
            which = "captured" if search.any is None else "any"
            future = plots.plot_future(problem, plane=plane)
            return [png(future), png(plots.plot_probability(search, which=which))]
        return [png(plots.plot_state(problem, search, plane=plane))]


def png(of: Figure | Axes) -> str:
    """A data URI with a third of the bytes of matplotlib's own: these pictures have few colours."""
    figure = of.get_figure(root=True)
    assert figure is not None
    drawn, small = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=RESOLUTION, bbox_inches="tight")
    pyplot.close(figure)
    PIL.Image.open(drawn).convert("RGB").quantize(COLORS).save(small, format="png", optimize=True)
    return _embedded("png", small)


def _embedded(kind: str, file: io.BytesIO) -> str:
    """A data URI of an image."""
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode()}"
