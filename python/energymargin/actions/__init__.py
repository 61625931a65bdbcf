"""Choose, shape and guard actions by the margin."""

from energymargin.actions.choosing import Candidates, Noise
from energymargin.actions.guard import Decision, Guard, GuardCounters, ProblemOfAction
from energymargin.actions.improvement import Generation, Improvement, improve
from energymargin.actions.profile import MarginProfile, Moment, margin_profile
from energymargin.actions.ranking import Ranking, Standing, rank
from energymargin.doors import check_doors

__all__ = [
    "Candidates",
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
    "improve",
    "margin_profile",
    "rank",
]

check_doors(globals(), __all__)
