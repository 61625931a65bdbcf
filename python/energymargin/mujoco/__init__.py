"""MuJoCo, as a second opinion: scenes as its models, and what becomes of an escape there.

The functions need MuJoCo: pip install 'energymargin[mujoco]'.
"""

from energymargin.mujoco.mjcf import model_of, to_mjcf
from energymargin.mujoco.replay import Replay, replay

__all__ = ["Replay", "model_of", "replay", "to_mjcf"]
