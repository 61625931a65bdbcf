"""Scores that are learned from a store: microseconds a state, with an interval, or a refusal."""

from energymargin.act.surrogates.control import ControlledMean, controlled_mean
from energymargin.act.surrogates.features import Layout
from energymargin.act.surrogates.model import Estimates, Model
from energymargin.act.surrogates.quality import Quality
from energymargin.act.surrogates.surrogate import Surrogate
from energymargin.base.doors import check_doors

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
