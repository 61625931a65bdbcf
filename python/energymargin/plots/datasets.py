"""Pictures of a dataset: what its trajectories look like, and what the scores say along them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from energymargin import tasks
from energymargin.datasets import Dataset
from energymargin.evaluation import LabelledScores
from energymargin.plots.qualitative import figure_qualitative
from energymargin.plots.series import along
from energymargin.plots.trajectories import figure_scores

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["figure_along", "figure_trees", "one_of_each"]


def one_of_each(dataset: Dataset) -> dict[str, int]:
    """A failed and a successful trajectory of a dataset, with an end as clear as can be."""
    chosen = {}
    for name, success in (("failed", False), ("successful", True)):
        of_kind = [
            t for t, trajectory in enumerate(dataset.trajectories) if trajectory.success == success
        ]
        if of_kind:
            chosen[name] = max(
                of_kind, key=lambda t: (dataset.trajectories[t].captured[-1] == success, -t)
            )
    return chosen


def figure_trees(dataset: Dataset, nodes: int, seed: int) -> Figure:
    """Search trees in three frames of a failed and of a successful trajectory.

    The trees, and so their scores, are those that the dataset gets from these nodes and this seed.
    """
    chosen = one_of_each(dataset)
    frames = dataset.frames()
    return figure_qualitative(
        tasks.make(dataset.task, **dataset.parameters),
        {name: dataset.trajectories[t] for name, t in chosen.items()},
        nodes=nodes,
        seed=seed,
        first_states={name: frames.index((t, 0)) for name, t in chosen.items()},
    )


def figure_along(dataset: Dataset, labelled: LabelledScores) -> Figure:
    """The scores along a failed and a successful trajectory."""
    columns = {}
    for name, t in one_of_each(dataset).items():
        times = dataset.trajectories[t].times
        columns[f"{name} trajectory"] = along(labelled, t, times)
    return figure_scores(columns)
