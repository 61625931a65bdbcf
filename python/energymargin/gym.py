"""Environments of the tasks in gymnasium, and a wrapper that scores any environment."""

from energymargin.act.gym import *  # noqa: F403
from energymargin.act.gym import __all__ as __all__  # noqa: PLC0414
