"""Choose, shape and guard actions by the margin."""

from energymargin.act.choosing import Candidates, Noise
from energymargin.act.critical import CriticalValue, critical_value
from energymargin.act.guard import Decision, Guard, GuardCounters, ProblemOfAction
from energymargin.act.improvement import Generation, Improvement, improve
from energymargin.act.profile import MarginProfile, Moment, margin_profile
from energymargin.act.ranking import Ranking, Standing, rank
from energymargin.base.doors import check_doors

__all__ = [
    "Candidates",
    "CriticalValue",
    "Decision",
    "Generation",
    "Guard",
    "GuardCounters",
    "Improvement",
    "MarginProfile",
    "Moment",
    "Noise",
    "ProblemOfAction",
    "Ranking",
    "Standing",
    "critical_value",
    "improve",
    "margin_profile",
    "rank",
]

check_doors(globals(), __all__)
