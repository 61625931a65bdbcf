"""Choose, shape and guard actions by the margin."""

from energymargin.actions.along_plan import Along, Moment, along
from energymargin.actions.decisions import Decision, GuardCounters
from energymargin.actions.guard import Candidates, Guard, ProblemOfAction
from energymargin.actions.improved import Generation, Improvement
from energymargin.actions.improvement import improve
from energymargin.actions.noise import Noise
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
