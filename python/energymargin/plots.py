"""Pictures of scores (matplotlib): a state with its search tree, scores along a trajectory, how"""

from energymargin.look.plots import *  # noqa: F403
from energymargin.look.plots import __all__ as __all__  # noqa: PLC0414
