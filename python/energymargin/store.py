"""Scores on disk: durable, and known by what was scored."""

from energymargin.records.store import *  # noqa: F403
from energymargin.records.store import __all__ as __all__  # noqa: PLC0414
