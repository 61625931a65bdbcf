"""Scores that are learned from a store: microseconds a state, with an interval, or a refusal."""

from energymargin.act.surrogates.model import Estimates, Layout, Quality
from energymargin.act.surrogates.surrogate import Surrogate
from energymargin.base.doors import check_doors

__all__ = ["Estimates", "Layout", "Quality", "Surrogate"]

check_doors(globals(), __all__)
