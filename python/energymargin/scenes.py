"""Scenes from files, and states that were measured."""

from energymargin.model.scenes import *  # noqa: F403
from energymargin.model.scenes import __all__ as __all__  # noqa: PLC0414
