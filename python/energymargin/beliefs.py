"""Models that are known with an error: beliefs over problems, their particles and their scores."""

from energymargin.base.doors import check_doors
from energymargin.evaluate.belief_scores import BeliefScore, BeliefScores
from energymargin.evaluate.belief_scoring import score_belief
from energymargin.model.beliefs.belief import Belief, Particles
from energymargin.model.beliefs.sampling import Sampling
from energymargin.model.beliefs.uncertainty import Source, Uncertainty, source_of

__all__ = [
    "Belief",
    "BeliefScore",
    "BeliefScores",
    "Particles",
    "Sampling",
    "Source",
    "Uncertainty",
    "score_belief",
    "source_of",
]

check_doors(globals(), __all__)
