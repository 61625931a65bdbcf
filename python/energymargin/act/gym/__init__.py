"""Manipulation in gymnasium: environments of the tasks, and a wrapper that scores any environment.

`CaptureWrapper` puts the score of each state into `info` and the reward, and filters actions. The
environments are known to `gymnasium.make` once this package is imported: `import energymargin.gym`,
or `gymnasium.make("energymargin.gym:EnergyMarginPush-v0")`.
"""

from energymargin.base.doors import check_doors
from energymargin.base.errors import needs_extra

with needs_extra("em.gym", "gym"):
    import gymnasium  # noqa: F401

from energymargin.act.gym.environment import CHANNELS, Channel, ScriptedFuture, TaskEnv, present
from energymargin.act.gym.wrapper import CaptureWrapper

__all__ = ["CHANNELS", "CaptureWrapper", "Channel", "ScriptedFuture", "TaskEnv", "present"]

check_doors(globals(), __all__)
