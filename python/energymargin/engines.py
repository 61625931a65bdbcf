"""Engines of your own: simulators whose rollouts all questions can be asked of."""

from energymargin.base.doors import check_doors
from energymargin.model.engine_checks import check
from energymargin.model.engines import Batch, Engine, problem
from energymargin.model.gymnasium_engine import Gymnasium
from energymargin.model.serial_engines import Serial

__all__ = ["Batch", "Engine", "Gymnasium", "Serial", "check", "problem"]

check_doors(globals(), __all__)
