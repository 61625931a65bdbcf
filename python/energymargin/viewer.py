"""The tree breaks out of the capture set, in a browser (viser)."""

from energymargin.look.viewer import *  # noqa: F403
from energymargin.look.viewer import __all__ as __all__  # noqa: PLC0414
