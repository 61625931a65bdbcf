"""Pictures of scores (matplotlib): a state with its search tree, scores along a trajectory, how
well they tell labels apart, how an effort falls with the nodes, and how a probability falls over
its horizon.

Each `plot_...` takes and returns an Axes; without one it makes a figure of pyplot. Each
`figure_...` makes a whole Figure.
"""

from energymargin.base.doors import check_doors
from energymargin.base.errors import needs_extra

with needs_extra("a picture", "plots"):
    import matplotlib  # noqa: F401

from energymargin.look.plots.actions import (
    figure_improvement,
    figure_margin_profile,
    plot_critical_curve,
    plot_critical_value,
    plot_critical_values,
    plot_margin_profile,
    plot_ranking,
)
from energymargin.look.plots.companions import (
    figure_grasp,
    figure_resting_poses,
    plot_grasps,
    plot_resting_pose,
)
from energymargin.look.plots.curves import plot_precision_recall, plot_roc
from energymargin.look.plots.results import (
    figure_belief,
    figure_engines,
    plot_effort,
    plot_future,
    plot_probability,
)
from energymargin.look.plots.states import plot_state, state_legend
from energymargin.look.plots.styles import CAPTURED_COLOR, LOST_COLOR, SUCCEEDED_COLOR
from energymargin.look.plots.trajectories import (
    TrajectoryScores,
    figure_along,
    figure_scores,
    figure_trees,
    plot_scores,
    trajectory_scores,
)

__all__ = [
    "CAPTURED_COLOR",
    "LOST_COLOR",
    "SUCCEEDED_COLOR",
    "TrajectoryScores",
    "figure_along",
    "figure_belief",
    "figure_engines",
    "figure_grasp",
    "figure_improvement",
    "figure_margin_profile",
    "figure_resting_poses",
    "figure_scores",
    "figure_trees",
    "plot_critical_curve",
    "plot_critical_value",
    "plot_critical_values",
    "plot_effort",
    "plot_future",
    "plot_grasps",
    "plot_margin_profile",
    "plot_precision_recall",
    "plot_probability",
    "plot_ranking",
    "plot_resting_pose",
    "plot_roc",
    "plot_scores",
    "plot_state",
    "state_legend",
    "trajectory_scores",
]

check_doors(globals(), __all__)
