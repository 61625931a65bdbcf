"""The known well of rare losses, in MuJoCo."""

from functools import cached_property

import known_losses
import pytest

import energymargin as em

mujoco = pytest.importorskip("mujoco")

__all__ = ["MujocoWell"]

WELL = """
<mujoco>
  <option timestep="{step}" gravity="0 0 0"/>
  <worldbody>
    <body name="block">
      <joint name="way" type="slide" axis="1 0 0" stiffness="{stiffness}" damping="{damping}"/>
      <geom type="sphere" size="0.05" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""


class MujocoWell(known_losses.Well):
    """The block on a spring, in MuJoCo's own step."""

    @cached_property
    def problem(self):
        numbers = {"step": known_losses.STEP, "stiffness": known_losses.STIFFNESS}
        return em.mujoco.problem(
            mujoco.MjModel.from_xml_string(WELL.format(damping=self.damping, **numbers)),
            objects="block",
            captured=em.regions.HalfSpace("block", normal=(1, 0, 0), offset=known_losses.WAY),
            force=(1, 0, 0),
            horizon=known_losses.HORIZON,
            check=known_losses.STEP,
        )

    def step(self, x, v, force):
        scene = self.problem.scene
        state = scene.pack(joints={"way": {"position": x, "velocity": v}})
        wrench = (force, 0, 0, 0, 0, 0)
        return tuple(em.World(scene).rollout(state, wrench, known_losses.STEP).state)
