"""Scores that are learned from a store: microseconds a state, with an interval, or a refusal."""

from energymargin.act.surrogates import *  # noqa: F403
from energymargin.act.surrogates import __all__ as __all__  # noqa: PLC0414
