"""A state with its search tree, as a picture that is part of the page.

The tree is grown again, as it was for the scores in the file: the same problem, nodes and seed give
the same bits.
"""

from __future__ import annotations

import base64
import io
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
    Problem,
    capture_probability,
    capture_score,
    disturbances,
    escape_effort,
    force_score,
    stream,
)
from energymargin.datasets import Dataset, Future
from energymargin.metrics import ANY, TIMED
from energymargin.outlines import Plan
from energymargin.plots.styles import LEGEND_SIZE
from energymargin.settings import SearchSettings
from energymargin.tasks.base import plane_of

__all__ = ["RepeatedSearch", "SearchRepeater", "picture"]

WIDTH = 5.4  # inch
HEIGHTS = (3.0, 7.5)  # inch
BESIDE, AROUND = 1.6, 1.7  # inch, that colour bar and legend take of the width and of the height
CURVE = 2.4  # inch, of the height of a probability's curve
RESOLUTION = 130  # dots an inch
COLORS = 256


@dataclass(frozen=True)
class RepeatedSearch:
    """A state's problem, the search for one of its scores, and that score."""

    problem: Problem
    search: CaptureScore | EscapeEffort | CaptureProbability | None
    """None for the force score, which needs no search."""
    score: float


class SearchRepeater:
    """Grows the searches of a dataset's states, each once."""

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

    def grow(self, number: int, metric: str) -> RepeatedSearch:
        """The search behind a metric of the state of this number. Raises ValueError if its problem
        cannot be made."""
        kind = _kind(metric)
        if (number, kind) not in self._kept:
            (problem,) = self._dataset.problems([number], self._future)
            self._kept[number, kind] = problem, self._search(problem, number, metric)
        problem, found = self._kept[number, kind]
        if kind in TIMED:
            return RepeatedSearch(problem, found, _probability(found, metric))
        if kind == "force":
            return RepeatedSearch(problem, None, found.force)
        if kind == "tree":
            return RepeatedSearch(problem, found, getattr(found, metric.replace("/", "_")))
        return RepeatedSearch(problem, found, found.effort)

    def _search(self, problem: Problem, number: int, metric: str) -> Any:
        """As a scorer of the file does it."""
        settings = self._settings
        grown: dict[str, Any] = {"nodes": settings.nodes, "seed": stream(settings.seed, number)}
        kind = _kind(metric)
        if kind in TIMED:
            return capture_probability(
                problem,
                disturbance=disturbances.Uniform(settings.strength, settings.objects),
                rollouts=settings.rollouts,
                seed=settings.seed if settings.common_random_numbers else grown["seed"],
                success=metric == "probability/success",
                by_object=metric == "probability/any",
            )
        if kind == "force":
            return force_score(problem)
        if kind == "tree":
            return capture_score(
                problem,
                **grown,
                nodes_per_edge=settings.nodes_per_edge,
                least_likelihood=settings.least_likelihood,
                warn=False,
            )
        return escape_effort(
            problem,
            planner=metric.split("/")[1],
            **grown,
            captured="any" if metric.endswith(ANY) else "all",
            search=settings.search,
            stop_at_escape=settings.stop_at_escape,
        )


def _kind(metric: str) -> str:
    """Metrics of one kind have one search."""
    if metric.startswith("effort") or metric in TIMED:
        return metric
    return "force" if metric.startswith("force") else "tree"


def _probability(found: CaptureProbability, metric: str) -> float:
    """What a metric is of what `_search` found for it."""
    if metric == "probability/success":
        assert found.success is not None  # it was asked for
        return found.success
    survival = found.any if metric == "probability/any" else None
    return found.captured if survival is None else survival.captured


def picture(grown: RepeatedSearch, plane: Plan) -> str:
    """A data URI of a picture, with a legend. Of a probability it is the undisturbed future, and
    the curve below it."""
    if isinstance(grown.search, CaptureProbability):
        made = _of_probability(grown.problem, grown.search, plane)
    else:
        made = Figure(figsize=(WIDTH, HEIGHTS[1]), dpi=RESOLUTION, layout="constrained")
        ax = made.subplots()
        plots.plot_state(grown.problem, grown.search, ax, plane=plane, legend=True)
        _move_legend_below(ax, made)
        made.set_size_inches(WIDTH, _height(ax))
    return f"data:image/png;base64,{base64.b64encode(_png(made)).decode()}"


def _of_probability(problem: Problem, found: CaptureProbability, plane: Plan) -> Figure:
    made = Figure(figsize=(WIDTH, HEIGHTS[1]), dpi=RESOLUTION, layout="constrained")
    rows = made.add_gridspec(2)
    ax, curve = made.add_subplot(rows[0]), made.add_subplot(rows[1])
    plots.plot_future(problem, ax, plane=plane, legend=True)
    _move_legend_below(ax, made)
    plots.plot_probability(found, curve, which="captured" if found.any is None else "any")
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
