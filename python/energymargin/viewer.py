"""A state with its tree, its sets and its escape as a page that turns and plays (three.js)."""

from energymargin.look.viewer import *  # noqa: F403
from energymargin.look.viewer import __all__ as __all__  # noqa: PLC0414
