"""A stream of states scored as it comes, with an alarm, and the alarm's threshold from data."""

from energymargin.act.monitor import *  # noqa: F403
from energymargin.act.monitor import __all__ as __all__  # noqa: PLC0414
