"""Engines of your own: simulators whose rollouts all questions can be asked of."""

from energymargin.base.doors import check_doors
from energymargin.model.engine_checks import check
from energymargin.model.engines import Batch, Engine

__all__ = ["Batch", "Engine", "check"]

check_doors(globals(), __all__)
