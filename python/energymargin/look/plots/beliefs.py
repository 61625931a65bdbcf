"""A belief: its particles, the scores that they have, and which of its sources matters most."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from energymargin.base.metrics import axis_label, is_likelihood, value_text
from energymargin.evaluate.belief_scores import BeliefScore
from energymargin.look.outlines import Plan, plane_for, view_of
from energymargin.look.plots.scenes import draw_bodies, draw_outlines, set_plane
from energymargin.look.plots.styles import draw_legend, light_grid
from energymargin.model.beliefs.belief import Belief

COLORS = "viridis"
AROUND = 0.15  # of the view's longer side
MOST_OUTLINES = 64
LOW = 0.1  # the quantile that is marked


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
    limits = view_of(problem.scene, states, plane, AROUND)
    draw_bodies(ax, problem.scene, np.asarray(problem.state), plane, limits)
    moving = {body.name for body in problem.scene.bodies if body.role != "none"}
    look: dict[str, Any] = {"fill": False, "linewidth": 0.8, "alpha": 0.7, "zorder": 5}
    for state, color in zip(
        states[1 : MOST_OUTLINES + 1], colors.to_rgba(score.values), strict=False
    ):
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
    for (name, value), color in zip(
        marks.items(), ("#0072B2", "#E69F00", "#D55E00", "0.5"), strict=False
    ):
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
