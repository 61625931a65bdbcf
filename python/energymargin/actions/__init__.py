"""Choose, shape and guard actions by the margin."""

from energymargin.actions.improved import Improvement
from energymargin.actions.improvement import improve
from energymargin.actions.ranking import Ranking, Standing, rank

__all__ = ["Improvement", "Ranking", "Standing", "improve", "rank"]
