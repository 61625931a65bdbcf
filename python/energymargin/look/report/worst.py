"""The states that each score gets most wrong, as pictures of their search trees.

A tree is searched again as it was for the score in the file: the same problem, nodes and seed give
the same bits.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Sequence
from itertools import count
from typing import Any, NamedTuple

from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

import energymargin as em
from energymargin.base.metrics import with_unit
from energymargin.base.table_text import sentence
from energymargin.look import plots
from energymargin.look.outlines import Plan
from energymargin.look.plots.trees import Result
from energymargin.look.report.subject import Subject, view_command

RESOLUTION = 130  # dots an inch
COLORS = 256


class StateCard(NamedTuple):
    """One state, and why it is shown."""

    title: str
    text: str
    images: Sequence[str]
    """Data URIs."""
    view: str
    """The command that shows the state in the viewer; empty without a dataset."""
    why: str
    """Why there is none of this state, why it is not that of the score in the file, or why the
    score is uncertain."""


class WorstStates(NamedTuple):
    """The most wrong states of one metric."""

    metric: str
    cards: list[StateCard]
    none: str
    """Why there is none, if so."""


def worst(
    subject: Subject,
    every: Sequence[em.evaluation.curves.Wrongness],
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
    chosen = [
        (one, [p for label in (False, True) for p in one.worst(label, each)]) for one in every
    ]
    total, done = max(1, sum(len(places) for _, places in chosen)), count()

    def card(one: em.evaluation.curves.Wrongness, place: int) -> StateCard:
        progress(next(done) / total)
        return _card(subject, repeater, one, place)

    found = [WorstStates(one.metric, [card(one, p) for p in ps], _none(one)) for one, ps in chosen]
    return found, lacking


def _card(
    subject: Subject,
    repeater: SearchRepeater | None,
    one: em.evaluation.curves.Wrongness,
    place: int,
) -> StateCard:
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
    return StateCard(title, f"{where}. {_why(one, place)}", images, view, why)


def _notes(stored: float, repeated: RepeatedSearch, sampling: object | None) -> str:
    """What is to be known of a picture, and of the score in the file."""
    warnings = () if repeated.search is None else repeated.search.warnings
    notes = [sentence(text) for text in warnings]
    if sampling is not None:
        notes.insert(
            0,
            f"The picture shows the model without its errors, whose score is {repeated.score:.4g}; "
            f"the file has {stored:.4g}, the mean of draws of the belief.",
        )
    elif repeated.score != stored:
        notes.insert(
            0,
            "Not the tree of the score in the file: searched again it gives "
            f"{repeated.score:.4g}, and the file has {stored:.4g}. The task or energymargin has "
            "changed since.",
        )
    return " ".join(notes)


def _why(one: em.evaluation.curves.Wrongness, place: int) -> str:
    label = bool(one.compared.labels[place])
    side = "below" if label else "above"
    if one.ranks.level[place]:
        side += " or level with"
    share = one.ranks.beyond[place] + one.ranks.level[place]
    return f"Ranked {side} {100 * share:.3g} % of all with the other label."


def _none(one: em.evaluation.curves.Wrongness) -> str:
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
        self,
        dataset: em.datasets.Dataset,
        settings: dict[str, Any],
        future: em.datasets.Future | None = None,
    ) -> None:
        """`settings` and `future`: of the run. Raises ValueError if the settings are not those of a
        search, or if the task cannot be made."""
        try:
            self._settings = em.searches.SearchSettings(**settings)
        except TypeError:
            raise ValueError(
                f"the run's settings are those of another program: {settings}"
            ) from None
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
            return [_png(future), _png(plots.plot_probability(search, which=which))]
        return [_png(plots.plot_state(problem, search, plane=plane))]


def _png(ax: Axes) -> str:
    figure = ax.get_figure(root=True)
    assert figure is not None
    return png(figure)


def png(figure: Figure) -> str:
    """A data URI with a third of the bytes of matplotlib's own: these pictures have few colours."""
    drawn, small = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=RESOLUTION, bbox_inches="tight")
    pyplot.close(figure)
    Image.open(drawn).convert("RGB").quantize(COLORS).save(small, format="png", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(small.getvalue()).decode()}"
