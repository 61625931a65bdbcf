"""MuJoCo: the engine of a question, states from its data, scenes as its models, escapes replayed.

Needs the extra [mujoco].
"""

from energymargin.base.doors import check_doors
from energymargin.base.errors import needs_extra

with needs_extra("a model of MuJoCo", "mujoco"):
    import mujoco  # noqa: F401

from energymargin.mujoco.doctor import Diagnosis, Finding, doctor
from energymargin.mujoco.engine import Engine, problem
from energymargin.mujoco.mjcf import model_of, to_mjcf
from energymargin.mujoco.replay import Replay, replay
from energymargin.mujoco.states import set_state, state, targets

__all__ = [
    "Diagnosis",
    "Engine",
    "Finding",
    "Replay",
    "doctor",
    "model_of",
    "problem",
    "replay",
    "set_state",
    "state",
    "targets",
    "to_mjcf",
]

check_doors(globals(), __all__)
