"""Choose, shape and guard actions by the margin."""

from energymargin.actions.ranking import Ranking, Standing, rank

__all__ = ["Ranking", "Standing", "rank"]
