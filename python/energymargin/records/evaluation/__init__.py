"""How well scores tell robust states from fragile ones, and successes from failures (Section VI-E,
Table I).

State level: capture, effort and force against the label "captured over a horizon of h frames", by
AUC and AP for each h. Trajectory level: the success score of the last frames against the
trajectory's success. Every cell has a bootstrap interval in which whole trajectories are drawn, for
the states of one trajectory are alike.

With several objects there are two labels, "all are captured" and "at least one is". A score whose
name ends in "/any" is compared with the second. The force score, one number for both, is compared
with each.
"""

from energymargin.base.doors import check_doors
from energymargin.records.evaluation.bootstrap import DRAWS
from energymargin.records.evaluation.labelled import (
    HORIZON,
    LAST_FRAMES,
    Among,
    Compared,
    LabelledScores,
    compared_states,
)
from energymargin.records.evaluation.table import Cell, Evaluation, cell_of, evaluate, tables_of

__all__ = [
    "DRAWS",
    "HORIZON",
    "LAST_FRAMES",
    "Among",
    "Cell",
    "Compared",
    "Evaluation",
    "LabelledScores",
    "cell_of",
    "compared_states",
    "evaluate",
    "tables_of",
]

check_doors(globals(), __all__)
