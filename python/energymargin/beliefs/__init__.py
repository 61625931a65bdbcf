"""Models that are known with an error: beliefs over problems, their particles and their scores."""

from energymargin.beliefs.belief import Belief, Particles
from energymargin.beliefs.scores import BeliefScore, BeliefScores
from energymargin.beliefs.scoring import score_belief
from energymargin.beliefs.uncertainty import Uncertainty
from energymargin.doors import check_doors

__all__ = ["Belief", "BeliefScore", "BeliefScores", "Particles", "Uncertainty", "score_belief"]

check_doors(globals(), __all__)
