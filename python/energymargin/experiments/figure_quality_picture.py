"""The picture of `figure_quality`: six frames, with trees, sets and ghosts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from energymargin import plots, tasks
from energymargin.experiments.figure_quality import SHOWN, FigureQuality

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["figure_quality"]


def figure_quality(result: FigureQuality) -> Figure:
    """A row for each push; (success, capture) under each frame, from the trees of the scores."""
    dataset, settings = result.dataset, result.settings
    firsts = {frame.push: frame.state - frame.frame for frame in result.frames}
    return plots.figure_qualitative(
        tasks.make(dataset.task, **dataset.parameters),
        {push: dataset.trajectories[t] for push, t in result.pushes.items()},
        frames=SHOWN,
        nodes=settings.nodes,
        seed=settings.seed,
        first_states=firsts,
        pairs=True,
    )
