"""The margin along a plan: probability and effort at each moment, the weakest one marked."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from energymargin.act.profile import EFFORT, MarginProfile
from energymargin.base.metrics import KINDS, value_text, with_unit
from energymargin.look.plots import styles

WIDTH, HEIGHT, OF_EFFORTS = 6.0, 2.6, 1.9  # inch
LOG_FROM = 30.0  # the largest effort in the least, from which on the axis is logarithmic
WEAKEST_COLOR = "black"


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
    height = HEIGHT + OF_EFFORTS * efforts
    figure = Figure(figsize=(WIDTH, height), dpi=150, layout="constrained")
    axes = figure.subplots(
        *(1 + efforts, 1),
        sharex=True,
        squeeze=False,
        height_ratios=(HEIGHT, OF_EFFORTS)[: 1 + efforts],
    )[:, 0]
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
