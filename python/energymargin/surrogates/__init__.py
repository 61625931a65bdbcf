"""Scores that are learned from a store: microseconds a state, with an interval, or a refusal."""

from energymargin.doors import check_doors
from energymargin.surrogates.control import ControlledMean, controlled_mean
from energymargin.surrogates.features import Layout
from energymargin.surrogates.model import Estimates, Model
from energymargin.surrogates.quality import Quality
from energymargin.surrogates.surrogate import Surrogate

__all__ = [
    "ControlledMean",
    "Estimates",
    "Layout",
    "Model",
    "Quality",
    "Surrogate",
    "controlled_mean",
]

check_doors(globals(), __all__)
