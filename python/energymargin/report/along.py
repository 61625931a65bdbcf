"""The scores along trajectories, one at a time, chosen from a list."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from energymargin.metrics import KINDS, is_likelihood, of_kind, unit
from energymargin.report.plots import (
    GUIDE_COLOR,
    LOST_COLOR,
    Choice,
    Plot,
    figure,
    look,
    round_numbers,
)
from energymargin.report.subject import BAND, Data, Subject

__all__ = ["Along", "along"]

GAP = 0.05  # between the axes, of the height
MARKED = 80  # frames; the line of a longer trajectory has no marks
SPARE = 0.05  # below and above the finite scores, of their range
ROW = 0.12  # of infinite efforts of one metric, of the same range
WORST, OTHERS, ALL = "Most wrong first", "A sample of the others", "The others"


@dataclass(frozen=True)
class Along:
    """The trajectories that a page shows."""

    plot: Plot | None
    """None if no trajectory has a score."""
    shown: int
    scored: int
    """How many have scores, of which these are shown."""
    unscored: int
    """How many have none at all."""
    worst: int
    """How many are shown because their scores are most wrong."""
    endless: bool
    """Whether there are infinite efforts."""


def along(subject: Subject, data: Data, wrong: NDArray[np.float64], most: int) -> Along:
    """At most so many trajectories: half those whose scores are most wrong, `wrong` (T,), and of
    the others some that are evenly spaced. Those without any score are left out."""
    lacks = np.all([np.isnan(values) for values in subject.labelled.scores.values()], axis=0)
    scored = np.array([t for t, own in enumerate(subject.members) if not lacks[own].all()], int)
    worst, others = chosen(scored, wrong, most)
    complete = len(worst) + len(others) == len(scored)
    groups = [WORST] * len(worst) + [ALL if complete else OTHERS] * len(others)
    numbers = [*worst, *others]
    plot = Plot(
        name="along",
        label="Each score along the chosen trajectory, over time",
        figures=[_figure(_Course.of(subject, data, t)) for t in numbers],
        choices=[
            Choice(group, _title(subject, t)) for group, t in zip(groups, numbers, strict=True)
        ],
        chooser="Trajectory",
        height=_height(subject.metrics),
    )
    return Along(
        plot if numbers else None,
        shown=len(numbers),
        scored=len(scored),
        unscored=len(wrong) - len(scored),
        worst=len(worst),
        endless=any(bool(np.isposinf(own).any()) for own in subject.labelled.scores.values()),
    )


def chosen(
    scored: NDArray[np.int64], wrong: NDArray[np.float64], most: int
) -> tuple[list[int], list[int]]:
    """Of the trajectories `scored` the most wrong ones, from the worst on, and evenly spaced
    others, rising."""
    order = scored[np.argsort(-np.nan_to_num(wrong[scored], nan=-1.0), kind="stable")]
    worst = order[: (most + 1) // 2]
    rest = np.sort(order[len(worst) :])
    few = min(most - len(worst), len(rest))
    others = rest[np.linspace(0, len(rest) - 1, few).round().astype(int)] if few else rest[:0]
    return worst.tolist(), others.tolist()


@dataclass(frozen=True, eq=False)
class _Course:
    """What is drawn of one trajectory."""

    x: NDArray[np.float64]
    x_title: str
    scores: dict[str, NDArray[np.float64]]
    bands: dict[str, NDArray[np.float64]]
    captured: NDArray[np.bool_]
    captured_any: NDArray[np.bool_] | None

    @classmethod
    def of(cls, subject: Subject, data: Data, t: int) -> _Course:
        """Of trajectory number `t`."""
        own, labelled = subject.members[t], subject.labelled
        timed, some = data.dataset, labelled.captured_any
        frames = subject.frames[own].astype(np.float64)
        return cls(
            x=frames if timed is None else timed.trajectories[t].times,
            x_title="frame" if timed is None else "time [s]",
            scores={metric: values[own] for metric, values in labelled.scores.items()},
            bands={metric: ends[own] for metric, ends in subject.bands.items()},
            captured=labelled.captured[own],
            captured_any=None if some is None else some[own],
        )

    def labels(self) -> list[str]:
        """Of each frame, in words."""
        one = np.array(["not captured", "captured"])[self.captured.astype(int)]
        if self.captured_any is None:
            return [str(word) for word in one]
        words = {
            (True, True): "all objects captured",
            (False, True): "at least one object captured",
        }
        pairs = zip(self.captured.tolist(), self.captured_any.tolist(), strict=True)
        return [words.get(pair, "no object captured") for pair in pairs]


def _title(subject: Subject, t: int) -> str:
    own, labelled = subject.members[t], subject.labelled
    end = "successful" if labelled.success[own[-1]] else "failed"
    captured = int(labelled.captured[own].sum())
    lacking = int(np.any([np.isnan(v[own]) for v in labelled.scores.values()], axis=0).sum())
    text = f"trajectory {labelled.trajectory[own[0]]}: {end}, captured in {captured} of {len(own)}"
    return text + (f", {lacking} not scored" if lacking else "")


def _figure(course: _Course) -> go.Figure:
    kinds = _kinds(list(course.scores))
    height = (1 + GAP) / len(kinds) - GAP
    made = figure(_height(course.scores), hovermode="closest", xaxis=_time_axis(course, len(kinds)))
    shapes = list(_shades(course))
    for row, (metrics, title) in enumerate(kinds):
        high = 1 - row * (height + GAP)
        domain = [max(0.0, high - height), high]
        scale, axis = _Scale.of(course, metrics), f"y{row + 1}"
        made.update_layout(
            {f"yaxis{row + 1}": {"title": {"text": title}, "domain": domain, **scale.layout()}}
        )
        for metric in metrics:
            made.add_traces(list(_belief(course, metric, axis, scale.high)))
            made.add_traces(list(_traces(course, metric, axis, scale.row(metric))))
        shapes += scale.border(axis)
    made.update_layout(shapes=shapes)
    return made


@dataclass(frozen=True, eq=False)
class _Scale:
    """An axis: what is finite, and above it a band of what is infinite, a row for each metric."""

    low: float
    high: float
    endless: list[str]
    """The metrics that have infinite scores."""

    @classmethod
    def of(cls, course: _Course, metrics: Sequence[str]) -> _Scale:
        """Of all scores of these metrics; with zero."""
        bands = [course.bands[metric].ravel() for metric in metrics if metric in course.bands]
        every = np.concatenate([*(course.scores[metric] for metric in metrics), *bands])
        finite = every[np.isfinite(every)]
        low, high = float(finite.min(initial=0.0)), float(finite.max(initial=0.0))
        if is_likelihood(metrics[0]) or low == high:
            low, high = 0.0, 1.0
        return cls(low, high, [m for m in metrics if np.isposinf(course.scores[m]).any()])

    def row(self, metric: str) -> float:
        """Where the infinite scores of a metric are drawn."""
        place = self.endless.index(metric) if metric in self.endless else 0
        return self._above(place + 0.5)

    def layout(self) -> dict[str, Any]:
        """Of the axis: numbers where it is finite, and one tick for all that is infinite."""
        layout: dict[str, Any] = {
            "range": [self.low - SPARE * (self.high - self.low), self._above(len(self.endless))]
        }
        if self.endless:
            numbers = round_numbers(self.low, self.high)
            layout["tickvals"] = [*numbers, self._above(len(self.endless) / 2)]
            layout["ticktext"] = [*(f"{number:.3g}" for number in numbers), "∞"]
        return layout

    def border(self, axis: str) -> list[dict[str, Any]]:
        """Between the finite and the infinite scores, if there are such."""
        line = {
            "type": "line",
            "xref": "paper",
            "x0": 0,
            "x1": 1,
            "yref": axis,
            "y0": self._above(0),
            "y1": self._above(0),
            "line": {"color": GUIDE_COLOR, "dash": "dot", "width": 1},
        }
        return [line] if self.endless else []

    def _above(self, rows: float) -> float:
        """So many rows above the finite scores."""
        return self.high + (SPARE + ROW * rows) * (self.high - self.low)


def _height(metrics: Iterable[str]) -> int:
    """Of the figure [px]."""
    return 160 + 200 * len(_kinds(list(metrics)))


def _kinds(metrics: Sequence[str]) -> list[tuple[list[str], str]]:
    """The metrics of each axis; one that is none of ours has its own."""
    kinds = [(of_kind(name, metrics), kind.axis) for name, kind in KINDS.items()]
    known = {metric for names, _ in kinds for metric in names}
    return [kind for kind in kinds if kind[0]] + [([m], m) for m in metrics if m not in known]


def _time_axis(course: _Course, rows: int) -> dict[str, Any]:
    middles = _borders(course.x)
    return {
        "title": {"text": course.x_title},
        "anchor": f"y{rows}",
        "range": [middles[0], middles[-1]],
        "zeroline": False,
    }


def _traces(course: _Course, metric: str, axis: str, top: float) -> Iterator[go.Scatter]:
    """A line, with a tip for each frame; marks at `top` stand for infinity."""
    values, (color, symbol, dash, width) = course.scores[metric], look(metric)
    labels = course.labels()
    about = [[frame, label] for frame, label in enumerate(labels)]
    time = "%{x:.3g} s" if course.x_title == "time [s]" else ""
    where = f"frame %{{customdata[0]}}{', ' + time if time else ''}<br>%{{customdata[1]}}"
    yield go.Scatter(
        x=course.x,
        y=np.where(np.isfinite(values), values, np.nan),
        customdata=about,
        name=metric,
        legendgroup=metric,
        yaxis=axis,
        mode="lines+markers" if len(values) <= MARKED else "lines",
        line={"color": color, "dash": dash, "width": width},
        marker={"symbol": symbol, "size": 7, "color": color},
        hovertemplate=f"<b>{metric} %{{y:.4g}} {unit(metric)}</b><br>{where}<extra></extra>",
    )
    endless = np.flatnonzero(np.isposinf(values))
    if len(endless):
        yield go.Scatter(
            x=course.x[endless],
            y=np.full(len(endless), top),
            customdata=[about[k] for k in endless],
            name=f"{metric}: no escape",
            legendgroup=metric,
            yaxis=axis,
            mode="markers",
            marker={"symbol": symbol, "size": 9, "color": color},
            hovertemplate=f"<b>{metric}: no escape found</b><br>{where}<extra></extra>",
        )


def _belief(course: _Course, metric: str, axis: str, top: float) -> Iterator[go.Scatter]:
    """Between the quantiles of the particles; what is infinite ends at `top`."""
    if metric not in course.bands or np.isnan(course.bands[metric]).all():
        return
    low, high = np.minimum(course.bands[metric], top).T
    color = look(metric)[0]
    there = ~np.isnan(low)
    yield go.Scatter(
        x=np.concatenate([course.x[there], course.x[there][::-1]]),
        y=np.concatenate([low[there], high[there][::-1]]),
        name=f"{metric}: {BAND[0]:g} to {BAND[1]:g} quantile",
        legendgroup=metric,
        yaxis=axis,
        mode="lines",
        fill="toself",
        fillcolor=color,
        opacity=0.25,
        line={"width": 0},
        hoverinfo="skip",
    )


def _borders(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half-way between the frames, and as far before the first and after the last; (K + 1,)."""
    if len(x) == 1:
        return np.array([x[0] - 0.5, x[0] + 0.5])
    middles = (x[1:] + x[:-1]) / 2
    return np.concatenate([[2 * x[0] - middles[0]], middles, [2 * x[-1] - middles[-1]]])


def _shades(course: _Course) -> Iterator[dict[str, Any]]:
    """Bands over the frames that are not captured: one for each stretch of them."""
    yield from _bands(course, ~course.captured, 0.13)
    if course.captured_any is not None:
        yield from _bands(course, ~course.captured_any, 0.2)


def _bands(course: _Course, shaded: NDArray[np.bool_], opacity: float) -> Iterator[dict[str, Any]]:
    borders = _borders(course.x)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], shaded, [False]]).astype(int)))
    for first, last in edges.reshape(-1, 2):
        yield {
            "type": "rect",
            "layer": "below",
            "x0": borders[first],
            "x1": borders[last],
            "yref": "paper",
            "y0": 0,
            "y1": 1,
            "fillcolor": LOST_COLOR,
            "opacity": opacity,
            "line": {"width": 0},
        }
