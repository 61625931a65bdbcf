"""The margin along a plan: probability and effort at each moment, the weakest one marked."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from energymargin.actions.profile import EFFORT, MarginProfile, Moment
from energymargin.checks import shown
from energymargin.metrics import KINDS, value_text, with_unit
from energymargin.plots.styles import (
    CAPTURED_COLOR,
    LEGEND_SIZE,
    axes_or_new,
    draw_bounded,
    light_grid,
    metric_style,
    shade_frames,
)

WIDTH, HEIGHT, OF_EFFORTS = 6.0, 2.6, 1.9  # inch
LOG_FROM = 30.0  # the largest effort in the least, from which on the axis is logarithmic
FREE = 0.15  # of the height, below those marks
WEAKEST_COLOR = "black"


def plot_margin_profile(profile: MarginProfile, *, ax: Axes | None = None) -> Axes:
    """Probability of staying captured at each moment, between the ends of its interval.

    A diamond is at the weakest moment. Moments at which the nominal motion itself is out of the
    capture set are shaded. Returns `ax`, or the axes of a new figure. Raises ValueError on another
    thing than a MarginProfile.
    """
    _check(profile)
    ax = axes_or_new(ax, WIDTH, HEIGHT)
    style, weakest = metric_style("probability"), profile.weakest
    ax.fill_between(
        profile.times, profile.low, profile.high, color=CAPTURED_COLOR, alpha=0.35, linewidth=0
    )
    ax.plot(
        profile.times,
        profile.probabilities,
        color=style.color,
        linewidth=1.4,
        marker=style.marker,
        markersize=3.5,
        label=f"captured for {_ahead(profile)}",
    )
    text = f"weakest: {value_text('probability', weakest.probability)} at {weakest.time:.3g} s"
    _mark(ax, weakest, weakest.probability, text)
    ax.set_ylim(-0.05, 1.05)
    return _finished(ax, profile, "probability")


def figure_margin_profile(profile: MarginProfile) -> Figure:
    """`plot_margin_profile`, and the efforts below it, if they were asked for."""
    _check(profile)
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
        _draw_efforts(axes[1], profile)
    return figure


def _draw_efforts(ax: Axes, profile: MarginProfile) -> None:
    """On a logarithmic axis if they differ much; marks at the top where no escape was found."""
    style, weakest = metric_style(EFFORT), profile.weakest
    draw_bounded(
        ax,
        profile.times,
        profile.efforts,
        "least effort found",
        endless="no escape found",
        color=style.color,
        linewidth=1.4,
        marker=style.marker,
        markersize=3.5,
    )
    there = profile.efforts[np.isfinite(profile.efforts)]
    if len(there):
        _scale(ax, float(there.min()), float(there.max()))
    if np.isfinite(weakest.effort):
        _mark(ax, weakest, weakest.effort, f"there: {with_unit(EFFORT, weakest.effort)}")
    _finished(ax, profile, "effort")
    if not len(there):
        ax.set_yticks([])


def _scale(ax: Axes, least: float, most: float) -> None:
    """Scales an axis of efforts, with space for the marks above them."""
    if least > 0 and most / least >= LOG_FROM:
        ax.set_yscale("log")
        ax.set_ylim(least * (least / most) ** FREE, most * (most / least) ** (2 * FREE))
    else:
        ax.set_ylim(0.0, (most or 1.0) / (1.0 - FREE))


def _mark(ax: Axes, weakest: Moment, value: float, text: str) -> None:
    ax.axvline(weakest.time, color=WEAKEST_COLOR, linewidth=0.8, linestyle=":")
    ax.plot(
        weakest.time,
        value,
        color=WEAKEST_COLOR,
        linestyle="",
        marker="D",
        markersize=6,
        markeredgecolor="white",
        zorder=5,
        label=text,
    )


def _finished(ax: Axes, profile: MarginProfile, kind: str) -> Axes:
    """Shades, labels and the legend."""
    shade_frames(ax, profile.times, ~profile.captured, "nominal motion not captured")
    ax.set(xlabel="time of the plan [s]", ylabel=KINDS[kind].axis)
    light_grid(ax)
    ax.legend(fontsize=LEGEND_SIZE, frameon=False)
    return ax


def _ahead(profile: MarginProfile) -> str:
    """How far they look, in words."""
    if len(profile) > 1 and np.ptp(profile.ahead) > 0:
        return "the rest of the plan"
    return f"{profile.ahead[0]:.3g} s"


def _check(profile: MarginProfile) -> None:
    if not isinstance(profile, MarginProfile):
        raise ValueError(
            f"profile is {shown(profile)}, expected a MarginProfile, as of em.margin_profile"
        )
