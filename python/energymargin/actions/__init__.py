"""Choose, shape and guard actions by the margin."""

from energymargin.actions.along_plan import Along, Moment, along
from energymargin.actions.improved import Generation, Improvement
from energymargin.actions.improvement import improve
from energymargin.actions.ranking import Ranking, Standing, rank

__all__ = [
    "Along",
    "Generation",
    "Improvement",
    "Moment",
    "Ranking",
    "Standing",
    "along",
    "improve",
    "rank",
]
