"""Results of one problem: effort over nodes, probability over time, in one engine or several, the
undisturbed future; and the scores of a belief."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from energymargin._core import CaptureProbability, EscapeEffort, Problem, Survival
from energymargin.base.checks import not_negative_number, yes_or_no
from energymargin.base.metrics import axis_label, is_likelihood, value_text
from energymargin.base.table_text import counted
from energymargin.evaluate.belief_scores import BeliefScore
from energymargin.evaluate.engine_comparison import EngineComparison
from energymargin.evaluate.futures import Undisturbed, undisturbed
from energymargin.look import outlines
from energymargin.look.outlines import Limits, Plan, plane_for, view_of
from energymargin.look.plots import styles
from energymargin.look.plots.scenes import (
    draw_bodies,
    draw_ghost,
    draw_outlines,
    leaving_objects,
    set_plane,
)
from energymargin.look.plots.states import AROUND, plot_state, state_legend
from energymargin.look.plots.styles import draw_legend, light_grid
from energymargin.model.beliefs.belief import Belief

CURVE_SIZE, FUTURE_SIZE = (6.0, 3.6), (6.0, 4.5)  # inch
ENGINES_HEIGHTS = (2.8, 1.6)  # inch: of the probabilities, and of the distances below
FUTURE_PATH: dict[str, Any] = {"color": "#0072B2", "linewidth": 1.8, "zorder": 8}
EXIT_MARK: dict[str, Any] = {"color": styles.LOST_COLOR, "marker": "D", "markersize": 6}
EXIT_MARK |= {"linestyle": "", "markeredgecolor": "white", "zorder": 9}

BESIDE = 0.03  # of the width from one node to the most: free on both sides, where a mark may be
BAND = 0.15  # opacity

Result = TypeVar("Result", EscapeEffort, CaptureProbability)


def plot_effort(
    results: EscapeEffort | Mapping[str, EscapeEffort],
    *,
    ax: Axes | None = None,
    known: float | None = None,
    legend: bool = True,
) -> Axes:
    """Best effort of escape [J] against nodes, of one search or of several by name, as steps.

    `known` is the exact effort [J], drawn as a line. A search that found no escape has no curve,
    but an entry in the legend, which also says which searches were stopped. The legend is inside
    `ax`, or beside the axes of a new figure. Up to 49 curves differ without their colours too.

    Returns `ax`, or the axes of a new figure. Raises ValueError if a result is no EscapeEffort or
    `known` is negative or not finite.
    """
    searches = _by_name(results, EscapeEffort, alone="search")
    known = None if known is None else not_negative_number("known", known)
    most = max(2, *(result.nodes for result in searches.values()))
    with styles.curve_axes(ax, CURVE_SIZE, "best", legend=legend) as axes:
        for number, (name, result) in enumerate(searches.items()):
            _draw_effort(axes, name, result, styles.curve_style(number))
        if known is not None:
            label = f"known: {known:.3g} J"
            axes.axhline(known, linestyle=":", color=styles.CHANCE_COLOR, label=label)
        if all(math.isinf(result.effort) for result in searches.values()):
            axes.text(0.5, 0.5, "no escape found", ha="center", transform=axes.transAxes)
            if known is None:
                axes.set_yticks([])
        axes.set_xscale("log")
        axes.set_xlim(most**-BESIDE, most ** (1 + BESIDE))
        axes.set(xlabel="nodes of the search tree", ylabel="best effort of escape [J]")
    return axes


def _draw_effort(ax: Axes, name: str, result: EscapeEffort, style: styles.LineStyle) -> None:
    """Steps from the first escape on, which go on to the last node."""
    stopped = "" if result.complete else ", stopped early"
    if not result.history:
        label = f"{name}: no escape in {counted(result.nodes, 'node')}{stopped}"
        ax.plot([], [], linestyle="", marker=style.marker, color=style.color, label=label)
        return
    nodes, efforts = np.array(result.history, dtype=float).T
    nodes = np.maximum(nodes, 1.0)  # what is known before the first node is drawn at it
    x, y = np.append(nodes, max(result.nodes, nodes[-1])), np.append(efforts, efforts[-1])
    label = f"{name}: {result.effort:.3g} J{stopped}"
    ax.step(x, y, where="post", label=label, **style.look(markevery=range(len(nodes))))


def plot_probability(
    results: CaptureProbability | Mapping[str, CaptureProbability],
    *,
    ax: Axes | None = None,
    which: str = "captured",
    confidence: float = 0.95,
    legend: bool = True,
) -> Axes:
    """Probability of having been captured throughout, over time [s], of one result or of several
    by name, as steps.

    The band is the Clopper-Pearson interval at each time, for that time alone. A mark is at the
    mean time captured. A dotted line is the time at which the undisturbed object leaves. `which`:
    "captured", all objects, or "any", at least one, of results with by_object=True. The legend has
    the values at the horizon; it is inside `ax`, or beside the axes of a new figure.

    Returns `ax`, or the axes of a new figure. Raises ValueError on what is no CaptureProbability,
    on a result that lacks `which`, or a confidence that is not between 0 and 1.
    """
    named = _by_name(results, CaptureProbability, alone="captured")
    bands = {name: result.band(confidence, which) for name, result in named.items()}
    most = max(float(result.times[-1]) for result in named.values())
    with styles.curve_axes(ax, CURVE_SIZE, "best", legend=legend) as axes:
        for number, (name, result) in enumerate(named.items()):
            style, (low, high) = styles.curve_style(number), bands[name]
            shade: dict[str, Any] = {"color": style.color, "alpha": BAND, "linewidth": 0}
            axes.fill_between(result.times, low, high, step="post", **shade)
            label = f"{name}: {_survival(result, which).captured:.2f}"
            label += f" ({low[-1]:.2f} to {high[-1]:.2f})"
            label += "" if result.complete else ", stopped early"
            _draw_survival(axes, result, which, style, label)
        _explain(axes, named, which)
        axes.set(xlim=(0.0, 1.03 * most), ylim=(-0.03, 1.03))
        axes.set(xlabel="time [s]", ylabel="captured until then [0..1]")
    return axes


def _survival(result: CaptureProbability, which: str) -> CaptureProbability | Survival:
    """What has a curve, a mean time, and the probability at the horizon."""
    return result if which == "captured" or result.any is None else result.any


def _draw_survival(
    ax: Axes, result: CaptureProbability, which: str, style: styles.LineStyle, label: str
) -> None:
    """The curve, its mean time, and where it ends undisturbed."""
    survival = _survival(result, which)
    line = style.look(marker="", linewidth=1.5)
    ax.step(result.times, survival.curve, where="post", label=label, **line)
    at = int((result.times <= survival.mean_time).sum()) - 1
    mark = style.look(linestyle="", markersize=7, markeredgecolor="white", zorder=4)
    ax.plot(survival.mean_time, survival.curve[at], gid="mean time", **mark)
    if which == "captured" and result.undisturbed is False:  # None: it was not asked for
        dots: dict[str, Any] = {"color": style.color, "linestyle": ":", "linewidth": 1.3}
        ax.axvline(result.undisturbed_time, gid="leaves", **dots)


def _explain(ax: Axes, results: Mapping[str, CaptureProbability], which: str) -> None:
    """What mark and dotted line mean, in the legend; with the number, if it is but one."""
    first, *others = results.values()
    time = "" if others else f", {_survival(first, which).mean_time:.3g} s"
    ax.plot([], [], "o", color="0.3", label=f"mean time captured{time}")
    if which == "captured" and any(one.undisturbed is False for one in results.values()):
        time = "" if others else f" at {first.undisturbed_time:.3g} s"
        ax.plot([], [], ":", color="0.3", label=f"leaves undisturbed{time}")


def _by_name(
    results: Result | Mapping[str, Result], kind: type[Result], *, alone: str
) -> dict[str, Result]:
    """Results of one kind by name: one that is given alone has the name `alone`."""
    expected = f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"
    if isinstance(results, kind):
        return {alone: results}
    if not (isinstance(results, Mapping) and results):
        raise ValueError(f"results is {results!r}, expected {expected}, or several by name")
    for name, result in results.items():
        if not isinstance(result, kind):
            raise ValueError(f"results has {result!r} as {name!r}, expected {expected}")
    return dict(results)


def plot_future(
    problem: Problem,
    *,
    ax: Axes | None = None,
    plane: Plan | None = None,
    limits: Limits | None = None,
    legend: bool | None = None,
) -> Axes:
    """The state of a problem with a horizon, and the undisturbed future from there.

    Lines are the paths of the objects' centres while the robot follows its plan. The bodies are
    drawn once more, half transparent, at the horizon. A diamond marks where an object leaves the
    capture set. The sets are those of the state; they may move with the effector.
    `plane`, `limits` [m] and `legend` are as in `plot_state`.

    Returns `ax`, or the axes of a new figure. Raises ValueError on a problem without a horizon, and
    RuntimeError if the simulation diverges.
    """
    future = undisturbed(problem)
    plane = outlines.plane_for(problem.scene, future.states) if plane is None else plane
    if limits is None:
        limits = outlines.view_of(problem.scene, future.states, plane, AROUND)
    legend = ax is None if legend is None else yes_or_no("legend", legend)
    ax = styles.axes_or_new(ax, *FUTURE_SIZE)
    plot_state(problem, ax=ax, plane=plane, limits=limits, legend=False)
    lines = _draw_future(ax, problem, future, plane)
    ax.set_title(future.words, fontsize=10)
    if legend:
        styles.draw_legend(ax, "below", [*state_legend(problem, tree=False), *lines])
    return ax


def _draw_future(ax: Axes, problem: Problem, future: Undisturbed, plane: Plan) -> list[Line2D]:
    draw_ghost(ax, problem.scene, future.states[-1], plane)
    leaves, left = future.exit_moment, leaving_objects(problem, future)
    lines = []
    centers = outlines.object_centers(problem.scene, future.states, plane)
    for number, path in enumerate(centers.swapaxes(0, 1)):
        lines += ax.plot(*path.T, label="undisturbed path", gid="undisturbed", **FUTURE_PATH)
        if left[number]:
            lines += ax.plot(*path[leaves], label="where it leaves", gid="exit", **EXIT_MARK)
    return lines


def figure_engines(comparison: EngineComparison) -> Figure:
    """The probability over time in each engine, and below how far its objects are, without a
    disturbance, from where the first engine has them [mm].

    Raises ValueError on another thing than an EngineComparison.
    """
    named = dict(zip(comparison.engines, comparison.probabilities, strict=True))
    size = (CURVE_SIZE[0], sum(ENGINES_HEIGHTS))
    figure = Figure(figsize=size, dpi=150, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=ENGINES_HEIGHTS)
    plot_probability(named, ax=above)
    above.set_xlabel("")
    for number, distances in enumerate(comparison.distances):
        below.plot(comparison.times, 1000 * distances, color=styles.curve_style(number).color)
    below.set(xlabel="time [s]", ylabel="apart [mm]")
    return figure


COLORS = "viridis"
AROUND_PARTICLES = 0.15  # of the view's longer side
MOST_OUTLINES = 64
LOW = 0.1  # the quantile that is marked
MARK_COLORS = ("#0072B2", "#E69F00", "#D55E00", "0.5")


def figure_belief(
    belief: Belief, score: BeliefScore, *, plane: Plan | None = None, known: float | None = None
) -> Figure:
    """The particles of a belief in a plane, coloured by their scores; how many have at most which
    score, with the mean and, but for probabilities, the quantile of 10 % and the worst; and the
    first-order shares.

    `known`: the score of the problem itself, to compare with. Raises ValueError on a score of
    something else.
    """
    figure = Figure(figsize=(10.5, 3.6), dpi=150, layout="constrained")
    where, how_much, why = figure.subplots(1, 3, width_ratios=(1.25, 1.1, 0.9))
    finite = score.values[np.isfinite(score.values)]
    most = 1.0 if is_likelihood(score.metric) else float(finite.max(initial=0.0))
    colors = ScalarMappable(Normalize(0.0, most or 1.0), COLORS)
    _draw_particles(where, belief, score, plane, colors)
    figure.colorbar(colors, ax=where, label=axis_label(score.metric), shrink=0.8)
    _draw_scores(how_much, score, known)
    _draw_shares(why, score)
    return figure


def _draw_particles(
    ax: Axes, belief: Belief, score: BeliefScore, plane: Plan | None, colors: ScalarMappable
) -> None:
    """The outlines of what moves in each particle, over the problem's own state."""
    problem = belief.problem
    states = np.array([problem.state, *(p.state for p in score.particles.problems)])
    plane = plane_for(problem.scene, states) if plane is None else plane
    limits = view_of(problem.scene, states, plane, AROUND_PARTICLES)
    draw_bodies(ax, problem.scene, np.asarray(problem.state), plane, limits)
    moving = {body.name for body in problem.scene.bodies if body.role != "none"}
    look: dict[str, Any] = {"fill": False, "linewidth": 0.8, "alpha": 0.7, "zorder": 5}
    drawn = states[1 : MOST_OUTLINES + 1]
    for state, color in zip(drawn, colors.to_rgba(score.values), strict=False):
        draw_outlines(ax, problem.scene, state, plane, moving, edgecolor=color, **look)
    set_plane(ax, plane, limits)
    ax.set_title(f"{len(score.values)} particles", fontsize=10)


def _draw_scores(ax: Axes, score: BeliefScore, known: float | None) -> None:
    """The share of particles with at most a score."""
    values = np.sort(score.values[np.isfinite(score.values)])
    shares = np.arange(1, len(values) + 1) / len(score.kept)
    ax.step(values, shares, where="post", color="0.2", linewidth=1.5)
    marks = {"mean": score.mean}
    if score.has_quantiles:
        marks |= {"10 % are at most": score.quantile(LOW), "worst": score.worst}
    if known is not None:
        marks["the model as believed most"] = known
    for (name, value), color in zip(marks.items(), MARK_COLORS, strict=False):
        text = f"{name}: {value_text(score.metric, value)}"
        if np.isfinite(value):
            ax.axvline(value, color=color, linewidth=1.4, label=text)
        else:
            ax.plot([], [], color=color, label=text)
    ax.set(xlabel=axis_label(score.metric), ylabel="share of particles", ylim=(0, 1.02))
    if is_likelihood(score.metric):
        ax.set_xlim(-0.02, 1.02)
    light_grid(ax)
    draw_legend(ax, "upper left")


def _draw_shares(ax: Axes, score: BeliefScore) -> None:
    """The sources' shares of the variance, each with its standard error."""
    names, shares = list(score.shares), list(score.shares.values())
    values = [share.value for share in shares]
    if np.isfinite(values).any():
        errors = [share.stderr for share in shares]
        ax.barh(range(len(names)), values, xerr=errors, color="#56B4E9", ecolor="0.3", capsize=3)
    else:
        ax.text(0.5, 0.5, "too few particles", transform=ax.transAxes, ha="center")
    ax.set_yticks(range(len(names)), [name.replace(" of ", "\nof ") for name in names], fontsize=8)
    ax.invert_yaxis()
    ax.set(xlim=(min(0.0, *values, -0.05) if values else 0.0, 1.0), xlabel="share of the variance")
    light_grid(ax)
