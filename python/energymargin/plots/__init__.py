"""Pictures of scores: the search tree over the workspace, and scores along a trajectory
(matplotlib)."""

try:
    import matplotlib  # noqa: F401
except ImportError as error:
    raise ImportError("pictures need matplotlib: pip install energymargin[plots]") from error

from energymargin.plots.qualitative import figure_qualitative
from energymargin.plots.states import CAPTURED_COLOR, SUCCEEDED_COLOR, plot_state
from energymargin.plots.trajectories import figure_scores, plot_trajectory_scores

__all__ = [
    "CAPTURED_COLOR",
    "SUCCEEDED_COLOR",
    "figure_qualitative",
    "figure_scores",
    "plot_state",
    "plot_trajectory_scores",
]
