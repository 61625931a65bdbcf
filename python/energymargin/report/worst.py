"""The states that each score gets most wrong, as pictures of their search trees.

A tree is searched again as it was for the score in the file: the same problem, nodes and seed give
the same bits.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from energymargin import plots, tasks
from energymargin._core import (
    CaptureProbability,
    CaptureScore,
    EscapeEffort,
    ForceScore,
    Problem,
)
from energymargin.datasets import Dataset, Future
from energymargin.evaluation.curves import CAPTURED, Wrongness
from energymargin.metrics import KINDS, metric_kind, with_unit
from energymargin.outlines import Plan
from energymargin.plots.styles import LEGEND_SIZE
from energymargin.report.subject import Data, Subject, view_command
from energymargin.searches import SearchSettings, metric_search, value_of
from energymargin.tasks.base import plane_of

WIDTH = 5.4  # inch
HEIGHTS = (3.0, 7.5)  # inch
BESIDE, AROUND = 1.6, 1.7  # inch, that colour bar and legend take of the width and of the height
CURVE = 2.4  # inch, of the height of a probability's curve
RESOLUTION = 130  # dots an inch
COLORS = 256


@dataclass(frozen=True)
class Card:
    """One state, and why it is shown."""

    title: str
    text: str
    image: str | None
    """A data URI; None if there is no picture."""
    view: str = ""
    """The command that shows the state in the viewer; empty without a dataset."""
    why: str = ""
    """Why there is none of this state, why it is not that of the score in the file, or why the
    score is uncertain."""


@dataclass(frozen=True, eq=False)
class Mistakes:
    """The most wrong states of one metric."""

    metric: str
    cards: list[Card]
    none: str
    """Why there is none, if so."""


@dataclass(frozen=True, eq=False)
class Worst:
    """The most wrong states of all metrics."""

    metrics: list[Mistakes]
    lacking: str
    """Why there are no pictures at all; empty if there are."""


def worst(
    subject: Subject,
    data: Data,
    every: Sequence[Wrongness],
    *,
    each: int,
    progress: Callable[[float], None],
) -> Worst:
    """Of each metric and label up to `each` states; progress(share) has the share that is done."""
    chosen = [
        (one, [p for label in (False, True) for p in one.worst(label, each)]) for one in every
    ]
    total, done = max(1, sum(len(places) for _, places in chosen)), 0
    drawer = _Drawer(subject, data)
    found = []
    for one, places in chosen:
        cards = []
        for place in places:
            progress(done / total)
            cards.append(drawer.card(one, place))
            done += 1
        found.append(Mistakes(one.metric, cards, _none(one)))
    return Worst(found, drawer.lacking)


class _Drawer:
    """Makes the cards."""

    def __init__(self, subject: Subject, data: Data) -> None:
        self._subject, self._data = subject, data
        self._repeater: SearchRepeater | None = None
        self.lacking = data.lacking
        """Why it can draw no picture; empty if it can."""
        if data.dataset is not None:
            try:
                self._repeater = SearchRepeater(data.dataset, subject.settings, subject.future)
            except ValueError as error:
                self.lacking = str(error)

    def card(self, one: Wrongness, place: int) -> Card:
        """Of a state, or of the last state of a trajectory."""
        number = self._number(one, place)
        title = _title(one, place)
        text = f"{self._where(number)}. {_why(one, place)}"
        if self._repeater is None:
            return Card(title, text, None, self._view(number))
        try:
            repeated = self._repeater.repeat(number, one.metric)
            image = picture(repeated, self._repeater.plane)
        except (ValueError, RuntimeError) as error:  # of a task that has changed, or is gone
            return Card(title, text, None, self._view(number), f"No picture: {error}.")
        return Card(title, text, image, self._view(number), self._notes(one, number, repeated))

    def _number(self, one: Wrongness, place: int) -> int:
        """Of the state that stands for a place in what is compared."""
        if one.target == CAPTURED:
            return int(one.compared.number[place])
        return int(self._subject.members[one.compared.trajectory[place]][-1])

    def _view(self, number: int) -> str:
        labelled, frame = self._subject.labelled, self._subject.frames[number]
        command = view_command(self._subject, self._data)
        place = f" --trajectory {labelled.trajectory[number]} --frame {frame}"
        return command + place if command else ""

    def _where(self, number: int) -> str:
        labelled, frame = self._subject.labelled, int(self._subject.frames[number])
        t = int(labelled.trajectory[number])
        time = ""
        if self._data.dataset is not None:
            time = f" ({self._data.dataset.trajectories[t].times[frame]:.3g} s)"
        return f"Trajectory {t}, frame {frame}{time}"

    def _notes(self, one: Wrongness, number: int, repeated: RepeatedSearch) -> str:
        """What is to be known of the picture, and of the score."""
        warnings = () if repeated.search is None else repeated.search.warnings
        notes = [f"{text[0].upper()}{text[1:]}." for text in warnings]
        changed = self._changed(one, number, repeated)
        return " ".join([changed, *notes] if changed else notes)

    def _changed(self, one: Wrongness, number: int, repeated: RepeatedSearch) -> str:
        """Whether the tree in the picture is another one than that of the score in the file."""
        stored = self._subject.scores(one.metric)[number]
        if repeated.score == stored:
            return ""
        return (
            "Not the tree of the score in the file: searched again it gives "
            f"{repeated.score:.4g}, and the file has {stored:.4g}. The task or energymargin has "
            "changed since."
        )


def _title(one: Wrongness, place: int) -> str:
    """The score and what happened: the contradiction."""
    score, label = one.compared.scores[place], bool(one.compared.labels[place])
    return f"{one.metric} {with_unit(one.metric, float(score))}, but {one.words(label).one}"


def _why(one: Wrongness, place: int) -> str:
    label = bool(one.compared.labels[place])
    side = "below" if label else "above"
    if one.ranks.level[place]:
        side += " or level with"
    share = one.ranks.beyond[place] + one.ranks.level[place]
    return f"Ranked {side} {_percent(share)} of the {one.words(not label).many}."


def _none(one: Wrongness) -> str:
    if one.compared.of_both_kinds:
        return "it ranks none on the wrong side"
    return "there are no scores" if not len(one.compared.labels) else "all have the same label"


def _percent(share: float) -> str:
    """Of a share between 0 and 1; 0 and 100 % are exact."""
    text = f"{100 * share:.0f}"
    if text == "100" and share < 1:
        return "more than 99 %"
    return "less than 1 %" if text == "0" else f"{text} %"


@dataclass(frozen=True)
class RepeatedSearch:
    """A state's problem, the search for one of its scores, and that score."""

    problem: Problem
    search: CaptureScore | EscapeEffort | CaptureProbability | None
    """None for the force score, which needs no search."""
    score: float


class SearchRepeater:
    """Repeats the searches of a dataset's states, each once."""

    def __init__(
        self, dataset: Dataset, settings: dict[str, Any], future: Future | None = None
    ) -> None:
        """`settings` and `future`: of the run. Raises ValueError if the settings are not those of a
        search, or if the task cannot be made."""
        try:
            self._settings = SearchSettings(**settings)
        except TypeError:
            raise ValueError(
                f"the run's settings are those of another program: {settings}"
            ) from None
        self._dataset, self._future = dataset, future
        self.plane = plane_of(tasks.make(dataset.task, **dataset.parameters))
        """In which pictures show the task."""
        self._kept: dict[tuple[int, str], tuple[Problem, Any]] = {}

    def repeat(self, number: int, metric: str) -> RepeatedSearch:
        """The search behind a metric of the state of this number. Raises ValueError if its problem
        cannot be made."""
        search = _shared(metric)
        if (number, search) not in self._kept:
            (problem,) = self._dataset.problems([number], future=self._future)
            found = metric_search(problem, metric, self._settings, number, warn=False)
            self._kept[number, search] = problem, found
        problem, found = self._kept[number, search]
        shown = None if isinstance(found, ForceScore) else found
        return RepeatedSearch(problem, shown, value_of(metric, found))


def _shared(metric: str) -> str:
    """The same for metrics that one search answers."""
    return "tree" if metric_kind(metric) is KINDS["likelihood"] else metric


def picture(repeated: RepeatedSearch, plane: Plan) -> str:
    """A data URI of a picture, with a legend. Of a probability it is the undisturbed future, and
    the curve below it."""
    if isinstance(repeated.search, CaptureProbability):
        made = _of_probability(repeated.problem, repeated.search, plane)
    else:
        made = Figure(figsize=(WIDTH, HEIGHTS[1]), dpi=RESOLUTION, layout="constrained")
        ax = made.subplots()
        plots.plot_state(repeated.problem, repeated.search, ax=ax, plane=plane, legend=True)
        _move_legend_below(ax, made)
        made.set_size_inches(WIDTH, _height(ax))
    return f"data:image/png;base64,{base64.b64encode(_png(made)).decode()}"


def _of_probability(problem: Problem, found: CaptureProbability, plane: Plan) -> Figure:
    made = Figure(figsize=(WIDTH, HEIGHTS[1]), dpi=RESOLUTION, layout="constrained")
    rows = made.add_gridspec(2)
    ax, curve = made.add_subplot(rows[0]), made.add_subplot(rows[1])
    plots.plot_future(problem, ax=ax, plane=plane, legend=True)
    _move_legend_below(ax, made)
    plots.plot_probability(found, ax=curve, which="captured" if found.any is None else "any")
    height = _height(ax)
    rows.set_height_ratios((height - AROUND, CURVE))
    made.set_size_inches(WIDTH, height + CURVE)
    return made


def _move_legend_below(ax: Axes, figure: Figure) -> None:
    """From the axes to the figure, which makes room for it."""
    legend = ax.get_legend()
    assert legend is not None  # it was asked for
    names = [text.get_text() for text in legend.get_texts()]
    handles = [handle for handle in legend.legend_handles if handle is not None]
    legend.remove()
    figure.legend(
        handles, names, loc="outside lower center", ncols=3, frameon=False, fontsize=LEGEND_SIZE
    )


def _height(ax: Axes) -> float:
    """Of a figure that leaves its axes, whose scales are equal, no room to spare."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    height = (WIDTH - BESIDE) * (y1 - y0) / (x1 - x0) + AROUND
    return min(max(height, HEIGHTS[0]), HEIGHTS[1])


def _png(figure: Figure) -> bytes:
    """A third of the bytes of matplotlib's own: these pictures have few colours."""
    drawn, small = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", bbox_inches="tight")
    Image.open(drawn).convert("RGB").quantize(COLORS).save(small, format="png", optimize=True)
    return small.getvalue()
