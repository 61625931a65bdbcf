"""MuJoCo: states from its data, and a second opinion: scenes as its models, escapes replayed.

The functions need MuJoCo: pip install 'energymargin[mujoco]'.
"""

from energymargin.base.doors import check_doors
from energymargin.mujoco.mjcf import model_of, to_mjcf
from energymargin.mujoco.replay import Replay, replay
from energymargin.mujoco.states import set_state, state, targets

__all__ = ["Replay", "model_of", "replay", "set_state", "state", "targets", "to_mjcf"]

check_doors(globals(), __all__)
