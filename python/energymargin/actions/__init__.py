"""Choose, shape and guard actions by the margin."""

from energymargin.actions.along_plan import Along, Moment, along
from energymargin.actions.choosing import Candidates, Noise
from energymargin.actions.guard import Decision, Guard, GuardCounters, ProblemOfAction
from energymargin.actions.improvement import Generation, Improvement, improve
from energymargin.actions.ranking import Ranking, Standing, rank

__all__ = [
    "Along",
    "Candidates",
    "Decision",
    "Generation",
    "Guard",
    "GuardCounters",
    "Improvement",
    "Moment",
    "Noise",
    "ProblemOfAction",
    "Ranking",
    "Standing",
    "along",
    "improve",
    "rank",
]
