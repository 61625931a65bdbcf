"""Choices: rankings of candidates, how a plan was improved, the margin along a plan with its
weakest moment; and how much it can take: where it holds, margins of several quantities, a line in a
plane."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from energymargin.act.candidates import Standing
from energymargin.act.critical import CriticalValue
from energymargin.act.improvement import Improvement
from energymargin.act.limits import CriticalCurve, CriticalValues
from energymargin.act.profile import EFFORT, MarginProfile
from energymargin.act.quantities import Scale
from energymargin.act.ranking import Ranking
from energymargin.base.aliases import Floats
from energymargin.base.metrics import KINDS, axis_label, is_likelihood, value_text, with_unit
from energymargin.look.plots import styles

BEST, ALIKE, WORSE = "tab:blue", "0.25", "0.7"
DISTURBANCE_COLOR = "tab:orange"
PARAMETER_COLORS = ("#009E73", "#CC79A7", "#56B4E9", "#7F5539")  # of no other line of the figure
LINE, LETTER = 0.19, 0.085  # inch: of a candidate's name
BETWEEN = 0.14  # inch, between two candidates
ENDLESS = "no escape found"
WIDTH, HEIGHT, OF_EFFORTS = 6.0, 2.6, 1.9  # inch
LOG_FROM = 30.0  # the largest effort in the least, from which on the axis is logarithmic
WEAKEST_COLOR = "black"


def plot_ranking(ranking: Ranking, ax: Axes | None = None) -> Axes:
    """The candidates with their 95 % intervals, the best on top: blue the best, black those that
    may be better, grey the others; a hollow mark left the race.

    A triangle at the right edge is an effort without a bound: no escape was found. Returns `ax`, or
    the axes of a new figure. Raises ValueError on another thing than a Ranking.
    """
    names = [styles.folded(name) for name in ranking.names]
    lines = [line for name in names for line in name.split("\n")]
    width = 4.2 + LETTER * max(map(len, lines))
    ax = styles.axes_or_new(ax, width, 1.5 + LINE * len(lines) + BETWEEN * len(names))
    colors = [ALIKE if one.name in ranking.confidence_set else WORSE for one in ranking]
    colors[0] = BEST
    edge = _scale(ax, ranking)
    for row, (standing, color) in enumerate(zip(ranking, colors, strict=True)):
        _draw_standing(ax, row, standing, color, edge)
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(ranking) - 0.5, -0.5)
    ax.set_xlabel(axis_label(ranking.metric))
    styles.light_grid(ax)
    _explain(ax, ranking, colors)
    return ax


def figure_improvement(improvement: Improvement) -> Figure:
    """The scores of each generation and the strength of the disturbance; where the parameters went;
    and the last comparison. Raises ValueError on another thing than an Improvement."""
    figure = Figure(figsize=(12.0, 4.0), dpi=150, layout="constrained")
    scores, parameters, last = figure.subplots(1, 3, width_ratios=(1.1, 1.1, 1.0))
    _draw_scores(scores, improvement)
    _draw_parameters(parameters, improvement)
    plot_ranking(improvement.ranking, last)
    scores.set_title("search: each generation meets new draws", fontsize=9)
    parameters.set_title("the strategy's best guess after each generation", fontsize=9)
    last.set_title("last comparison: new draws, as stated", fontsize=9)
    return figure


# A ranking


def _scale(ax: Axes, ranking: Ranking) -> float:
    """Sets the limits of the scores; where an interval without an end goes to."""
    if is_likelihood(ranking.metric):
        ax.set_xlim(-0.02, 1.02)
        return 1.0
    values = np.array([(s.low, s.score, s.high) for s in ranking]).ravel()
    edge, _ = styles.room_for_infinity(ax.xaxis, values)
    return np.inf if np.isnan(edge) else edge


def _draw_standing(ax: Axes, row: int, standing: Standing, color: str, edge: float) -> None:
    low, score, high = np.minimum((standing.low, standing.score, standing.high), edge)
    fill = color if standing.racing else "white"
    ax.plot([low, high], [row, row], color=color, linewidth=1.6)
    if np.isposinf(standing.high):
        ax.plot(high, row, ">", color=color, markersize=4)
    endless = np.isposinf(standing.score)
    mark: dict[str, Any] = {"marker": ">", "markersize": 7} if endless else {"marker": "o"}
    ax.plot(score, row, color=color, markerfacecolor=fill, zorder=3, **{"markersize": 5, **mark})


def _explain(ax: Axes, ranking: Ranking, colors: list[str]) -> None:
    """What the marks mean, of those that there are."""
    words = {BEST: "best", ALIKE: "may be better", WORSE: "worse"}
    dot: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 5}
    for color, text in words.items():
        if color in colors:
            ax.plot([], [], color=color, label=text, **dot)
    out = [color for one, color in zip(ranking, colors, strict=True) if not one.racing]
    if out:
        ax.plot([], [], color=out[0], markerfacecolor="white", label="left the race", **dot)
    if any(np.isposinf(standing.high) for standing in ranking):
        ax.plot([], [], color=ALIKE, label=ENDLESS, **dot | {"marker": ">"})
    ax.plot([], [], color=ALIKE, linewidth=1.6, label="95 % interval")
    styles.draw_legend(ax, "below")


# How a plan was improved


def _draw_scores(ax: Axes, improvement: Improvement) -> None:
    """Draws the scores of all plans, best and median of each generation, and the factor."""
    generations = improvement.generations
    numbers = np.arange(1, len(generations) + 1)
    every = np.repeat(numbers, [len(one.scores) for one in generations])
    scores = np.concatenate([one.scores for one in generations])
    best = np.array([one.scores[one.best] for one in generations])
    median = np.array([_median(one.scores) for one in generations])
    height, _ = styles.room_for_infinity(ax.yaxis, scores)
    plans: dict[str, Any] = {"linestyle": "", "endless": ENDLESS}
    line: dict[str, Any] = {"linewidth": 1.4, "markersize": 3}
    styles.draw_bounded(ax, every, scores, "each plan", height, color="0.75", marker=".", **plans)
    styles.draw_bounded(ax, numbers, median, "median", height, color=ALIKE, marker="s", **line)
    styles.draw_bounded(ax, numbers, best, "best", height, color=BEST, marker="o", **line)
    ax.set_ylabel(axis_label(improvement.ranking.metric))
    _count_generations(ax, len(numbers))
    factors = [one.factor for one in generations]
    if max(factors) > 1.0:
        beside = ax.twinx()
        beside.step(numbers, factors, where="mid", color=DISTURBANCE_COLOR, linewidth=1.2)
        beside.set_ylabel("disturbance, times the stated one", color=DISTURBANCE_COLOR)
        beside.set_ylim(bottom=0.0)
    styles.draw_legend(ax, "below")


def _draw_parameters(ax: Axes, improvement: Improvement) -> None:
    """The strategy's favourite after each generation, and the numbers of the last one."""
    points = np.array([one.favourite for one in improvement.generations])
    numbers = np.arange(1, len(points) + 1)
    ranges = improvement.ranges.items()
    for k, ((name, (low, high)), column) in enumerate(zip(ranges, points.T, strict=True)):
        look = styles.curve_style(k).look(color=PARAMETER_COLORS[k % len(PARAMETER_COLORS)])
        last = low + column[-1] * (high - low)
        label = f"{styles.folded(name)}: {last:.3g} of {low:g} to {high:g}"
        ax.plot(numbers, column, label=label, **look)
    ax.set(ylabel="share of the parameter's range", ylim=(-0.02, 1.02))
    _count_generations(ax, len(points))
    styles.draw_legend(ax, "below", ncols=1, title="last value")


def _count_generations(ax: Axes, count: int) -> None:
    """The axis of their numbers."""
    ax.set(xlabel="generation", xlim=(0.5, count + 0.5))
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    styles.light_grid(ax)


def _median(scores: Floats) -> float:
    """Median of the scores that are not NaN; NaN if there is none."""
    there = scores[~np.isnan(scores)]
    return float(np.median(there)) if len(there) else np.nan


def plot_margin_profile(profile: MarginProfile, *, ax: Axes | None = None) -> Axes:
    """Probability of staying captured at each moment, between the ends of its interval.

    A diamond is at the weakest moment. Moments at which the nominal motion itself is out of the
    capture set are shaded. Returns `ax`, or the axes of a new figure. Raises ValueError on another
    thing than a MarginProfile.
    """
    ends = profile.low, profile.high
    ax = styles.axes_or_new(ax, WIDTH, HEIGHT)
    ax.fill_between(profile.times, *ends, color=styles.CAPTURED_COLOR, alpha=0.35, linewidth=0)
    at = f"{value_text('probability', profile.weakest.probability)} at {profile.weakest.time:.3g} s"
    _draw(ax, profile, "probability", f"captured for {_ahead(profile)}", f"weakest: {at}")
    ax.set_ylim(-0.05, 1.05)
    return ax


def figure_margin_profile(profile: MarginProfile) -> Figure:
    """`plot_margin_profile`, and the efforts below it, if they were asked for."""
    efforts = not np.isnan(profile.efforts).all()
    heights = (HEIGHT, OF_EFFORTS)[: 1 + efforts]
    figure = Figure(figsize=(WIDTH, sum(heights)), dpi=150, layout="constrained")
    grid: dict[str, Any] = {"sharex": True, "squeeze": False, "height_ratios": heights}
    axes = figure.subplots(len(heights), 1, **grid)[:, 0]
    plot_margin_profile(profile, ax=axes[0])
    if efforts:
        axes[0].set_xlabel("")
        there = profile.efforts[np.isfinite(profile.efforts)]
        if len(there) and there.min() > 0 and there.max() / there.min() >= LOG_FROM:
            axes[1].set_yscale("log")
        weakest = f"there: {with_unit(EFFORT, profile.weakest.effort)}"
        _draw(axes[1], profile, EFFORT, "least effort found", weakest)
        if axes[1].get_yscale() == "linear":
            axes[1].set_ylim(bottom=0.0)
    return figure


def _draw(ax: Axes, profile: MarginProfile, metric: str, label: str, weakest: str) -> None:
    """A score at each moment, with a diamond at the weakest; shades, labels and the legend."""
    values = profile.efforts if metric == EFFORT else profile.probabilities
    axis = KINDS["effort" if metric == EFFORT else "probability"].axis
    style, (height, _) = styles.metric_style(metric), styles.room_for_infinity(ax.yaxis, values)
    look = style.look(linestyle="-", endless="no escape found")
    styles.draw_bounded(ax, profile.times, values, label, height, **look)
    time, value = profile.weakest.time, values[profile.weakest.number]
    if np.isfinite(value):
        ax.axvline(time, color=WEAKEST_COLOR, linewidth=0.8, linestyle=":")
        mark = styles.LineStyle(WEAKEST_COLOR, "", "D").look(markersize=6, markeredgecolor="white")
        ax.plot(time, value, label=weakest, zorder=5, **mark)
    styles.shade_frames(ax, profile.times, ~profile.captured, "nominal motion not captured")
    ax.set(xlabel="time of the plan [s]", ylabel=axis)
    styles.light_grid(ax)
    styles.draw_legend(ax)


def _ahead(profile: MarginProfile) -> str:
    """How far they look, in words."""
    if len(profile) > 1 and np.ptp(profile.ahead) > 0:
        return "the rest of the plan"
    return f"{profile.ahead[0]:.3g} s"


TIGHTEST, OTHERS = "tab:orange", "tab:blue"
BAR = 0.42  # inch, of a quantity
WITHOUT = {"everywhere": "holds in the whole range", "nowhere": "does not hold in the range"}
"""What is said of a quantity without a crossing."""


def plot_critical_value(limit: CriticalValue, *, ax: Axes | None = None) -> Axes:
    """The probability at the values that were tried, between what it can be by what is known, and
    each crossing with its interval.

    Returns `ax`, or the axes of a new figure. Raises ValueError on another thing than a
    CriticalValue.
    """
    values, low, high = limit.outcomes.T
    ax = styles.axes_or_new(ax, 6.0, 3.2)
    band: dict[str, Any] = {"facecolor": (styles.CAPTURED_COLOR, 0.35), "linewidth": 1.2}
    band["edgecolor"] = styles.CAPTURED_COLOR
    ax.fill_between(values, low, high, label="share of the draws that hold", **band)
    ax.axhline(limit.probability, color="0.4", linewidth=0.8, linestyle=":")
    for k, (value, first, last, side) in enumerate(limit.crossings):
        ax.axvspan(first, last, color="0.5", alpha=0.3, linewidth=0)
        name = f"holds {side} {_with_unit(value, limit.unit)}"
        ax.axvline(value, color=f"C{k}", linewidth=1.2, label=name)
    ax.set(xlabel=_axis(limit.quantity, limit.unit), ylabel="probability", ylim=(-0.05, 1.05))
    ax.set_xlim(*limit.range)
    _by_ratio(ax, "x", limit.range)
    styles.light_grid(ax)
    styles.draw_legend(ax)
    return ax


def plot_critical_values(limits: CriticalValues, *, ax: Axes | None = None) -> Axes:
    """A tornado: how far each quantity's nominal value is from where it fails, as a share of
    itself, the tightest one on top; the interval is a thin line.

    A quantity that holds in the whole range that was asked is a pale bar from edge to edge. Returns
    `ax`, or the axes of a new figure. Raises ValueError on another thing than CriticalValues.
    """
    order = np.argsort(limits.margins, kind="stable")  # those that are not known at the end
    every = list(zip(limits, limits.nominals, limits.margins, strict=True))
    rows = [every[k] for k in order]
    ax = styles.axes_or_new(ax, 6.4, 1.2 + BAR * len(limits))
    marks = [_marks(one, nominal) for one, nominal, _ in rows]
    edge = 1.15 * max([1e-3, *(abs(share) for row in marks for _, *at in row for share in at)])
    for number, (one, _, _) in enumerate(rows):
        color = TIGHTEST if one is limits.tightest else OTHERS
        for value, at, *ends in marks[number]:
            ax.barh(number, at, height=0.55, color=color, alpha=0.8)
            ax.plot(ends, [number, number], color="0.15", linewidth=1.4)
            ax.annotate(_with_unit(value, one.unit), (at, number), **_beside(at))
        if not one.crossings:
            if one.side == "everywhere":
                ax.barh(number, 2 * edge, left=-edge, height=0.55, color=color, alpha=0.15)
            said = WITHOUT.get(one.side, "not known")
            ax.annotate(said, (0, number), ha="center", va="center", fontsize=8)
    ax.axvline(0.0, color="0.2", linewidth=0.9)
    names = [f"{one.quantity}\nnow {_with_unit(nominal, one.unit)}" for one, nominal, _ in rows]
    ax.set_yticks(range(len(rows)), names, fontsize=8)
    ax.set(xlim=(-edge, edge), ylim=(len(rows) - 0.5, -0.5))
    ax.xaxis.set_major_formatter(lambda share, _: f"{share:+.0%}")
    ax.set_xlabel(f"change until less than {limits[0].probability:.0%} hold")
    styles.light_grid(ax)
    return ax


def plot_critical_curve(curve: CriticalCurve, *, ax: Axes | None = None) -> Axes:
    """The line between held and lost in the plane of two quantities, with its band; where it holds
    is shaded.

    Returns `ax`, or the axes of a new figure. Raises ValueError on another thing than a
    CriticalCurve.
    """
    one = curve.found[0]
    ax = styles.axes_or_new(ax, 5.4, 3.8)
    low, high = curve.band.T
    kind = f"{curve.confidence:.0%} band"
    ax.fill_between(curve.values, low, high, color="0.5", alpha=0.4, linewidth=0, label=kind)
    ax.plot(curve.values, curve.curve, "o-", color="tab:blue", markersize=3, label="critical value")
    sides = {each.side for each in curve.found} & {"above", "below"}
    if len(sides) == 1:
        of, to = one.range if sides == {"above"} else one.range[::-1]
        held: dict[str, Any] = {"color": styles.CAPTURED_COLOR, "alpha": 0.2, "linewidth": 0}
        there = [
            of if each.side == "everywhere" else to if np.isnan(each.value) else each.value
            for each in curve.found
        ]
        ax.fill_between(curve.values, there, to, label=f"{one.probability:.0%} hold", **held)
    ax.set(xlabel=_axis(curve.quantity, curve.unit), ylabel=_axis(one.quantity, one.unit))
    ax.set(xlim=(curve.values[0], curve.values[-1]), ylim=one.range)
    _by_ratio(ax, "x", (curve.values[0], curve.values[-1]))
    _by_ratio(ax, "y", one.range)
    styles.light_grid(ax)
    styles.draw_legend(ax)
    return ax


def _marks(one: CriticalValue, nominal: float) -> list[tuple[float, ...]]:
    """The value of each crossing, and how far it and the ends of its interval are from the nominal
    value, as shares of that, or of the range where it is 0."""
    size = abs(nominal) or one.range[1] - one.range[0]
    return [(v, *((at - nominal) / size for at in (v, *ends))) for v, *ends, _ in one.crossings]


def _beside(at: float) -> dict[str, Any]:
    """Where the value of a bar is written."""
    to, side = (4, "left") if at >= 0 else (-4, "right")
    place = {"xytext": (to, 9), "textcoords": "offset points"}
    return {**place, "ha": side, "va": "center", "fontsize": 7}


def _by_ratio(ax: Axes, axis: str, ends: tuple[float, float]) -> None:
    """Makes an axis logarithmic if its values were searched by ratios."""
    if Scale.of(ends).by_ratio:
        (ax.set_xscale if axis == "x" else ax.set_yscale)("log")


def _axis(quantity: str, unit: str) -> str:
    return f"{quantity} [{unit}]" if unit else quantity


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}".rstrip()
