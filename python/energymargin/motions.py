"""Motions of a kinematic body, as rows of a plan: lift, turn, shake, hold."""

from energymargin.model.motions import *  # noqa: F403
from energymargin.model.motions import __all__ as __all__  # noqa: PLC0414
