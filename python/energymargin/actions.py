"""Choose, shape and guard actions by the margin."""

from energymargin.act.candidates import Standing
from energymargin.act.choosing import Candidates, Noise
from energymargin.act.critical import CriticalValue, critical_value, critical_value_of
from energymargin.act.guard import Decision, Guard, GuardCounters, ProblemOfAction
from energymargin.act.improvement import Generation, Improvement, improve
from energymargin.act.limits import CriticalCurve, CriticalValues, critical_curve, critical_values
from energymargin.act.policy_comparison import OutcomeComparison, compare
from energymargin.act.profile import MarginProfile, Moment, margin_profile
from energymargin.act.quantities import Quantity, quantity_of
from energymargin.act.ranking import Ranking, rank
from energymargin.base.doors import check_doors

__all__ = [
    "Candidates",
    "CriticalCurve",
    "CriticalValue",
    "CriticalValues",
    "Decision",
    "Generation",
    "Guard",
    "GuardCounters",
    "Improvement",
    "MarginProfile",
    "Moment",
    "Noise",
    "OutcomeComparison",
    "ProblemOfAction",
    "Quantity",
    "Ranking",
    "Standing",
    "compare",
    "critical_curve",
    "critical_value",
    "critical_value_of",
    "critical_values",
    "improve",
    "margin_profile",
    "quantity_of",
    "rank",
]

check_doors(globals(), __all__)
