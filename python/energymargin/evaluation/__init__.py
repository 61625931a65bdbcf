"""How well the scores tell robust states from fragile ones, and successes from failures (Section
VI-E, Table I).

State level: capture, effort and force against the label "captured over a horizon of h frames", by
AUC and AP for each h. Trajectory level: the success score of the last frames against the
trajectory's success. Every cell has a bootstrap interval in which whole trajectories are drawn, for
the states of one trajectory are alike.

With several objects there are two labels, "all are captured" and "at least one is", and a score
whose name ends in "/any" is held against the second. The force score, one number for both, is held
against each.
"""

from energymargin.evaluation.bootstrap import DRAWS, auc_ap, ranked
from energymargin.evaluation.cells import DASH, PAPER, Cell, csv_fields, paper_text
from energymargin.evaluation.labelled import (
    AMONG,
    FORCE,
    HORIZON,
    HORIZONS,
    LAST_FRAMES,
    PAPER_HORIZON,
    SUCCESS,
    SUCCESSES,
    Among,
    Compared,
    LabelledScores,
    captured_labels,
    compared_states,
    compared_trajectories,
    state_metrics,
    trajectory_score,
)
from energymargin.evaluation.table import ALL_TITLE, ANY_TITLE, CSV_COLUMNS, Evaluation, evaluate
from energymargin.shares import short

__all__ = [
    "ALL_TITLE",
    "AMONG",
    "ANY_TITLE",
    "CSV_COLUMNS",
    "DASH",
    "DRAWS",
    "FORCE",
    "HORIZON",
    "HORIZONS",
    "LAST_FRAMES",
    "PAPER",
    "PAPER_HORIZON",
    "SUCCESS",
    "SUCCESSES",
    "Among",
    "Cell",
    "Compared",
    "Evaluation",
    "LabelledScores",
    "auc_ap",
    "captured_labels",
    "compared_states",
    "compared_trajectories",
    "csv_fields",
    "evaluate",
    "paper_text",
    "ranked",
    "short",
    "state_metrics",
    "trajectory_score",
]
