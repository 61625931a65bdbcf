"""The MuJoCo inside of an environment: its whole state, its bodies, and forces on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.mujoco.kinematics import INTEGRATION
from energymargin.mujoco.models import bytes_of, scene_of
from energymargin.mujoco.states import States


class Inside:
    """The model and the data that an environment steps."""

    def __init__(
        self, model: Any, data: Any, scene: em.Scene | None, *, step: float, **roles: Sequence[str]
    ) -> None:
        """`step`: of the environment [s]; `roles`: objects and effector, by name. Raises ValueError
        on names that the model lacks."""
        self.model, self.data = model, data
        made = scene_of(model, data, step=step, **roles) if scene is None else scene
        self.scene: em.Scene = made.with_engine("native")
        """Without an engine."""
        self.substeps = max(round(step / float(model.opt.timestep)), 1)
        """Steps of MuJoCo in one of the environment."""
        self.saved = int(mujoco.mj_stateSize(model, INTEGRATION))
        """How many numbers `save` returns."""
        self._states = States(self.scene, model, others=self.scene.pack())
        objects = (body.name for body in self.scene.bodies if body.role == "object")
        self._objects = [self._states.body_id(name) for name in objects]

    def digest(self) -> bytes:
        """All that the model is."""
        return bytes_of(self.model)

    def save(self) -> Floats:
        """mjSTATE_INTEGRATION."""
        saved = np.empty(self.saved)
        mujoco.mj_getState(self.model, self.data, saved, INTEGRATION)
        return saved

    def restore(self, saved: Floats) -> None:
        """Goes back to it."""
        mujoco.mj_setState(self.model, self.data, saved, INTEGRATION)
        self.refresh()

    def put(self, state: Floats) -> None:
        """Goes to a state of the scene; what the scene lacks stays."""
        self._states.write(self.data, state)
        self.refresh()

    def refresh(self) -> None:
        """Brings what follows from the state up to date: an environment reads it, and what is there
        after a step is that of before."""
        warm = self.data.qacc_warmstart.copy()
        mujoco.mj_forward(self.model, self.data)
        self.data.qacc_warmstart[:] = warm

    def push(self, wrenches: Floats) -> None:
        """Wrenches act on the objects from now on, shape (k, 6)."""
        self.data.xfrc_applied[self._objects] = wrenches

    def read(self) -> Floats:
        """The state of the scene, shape (d,)."""
        return self._states.read(self.data)

    def bodies(self) -> Floats:
        """As of em.engines.Serial."""
        self._states.refresh(self.data)
        found = np.empty((len(self._objects), 13))
        for row, body in zip(found, self._objects, strict=True):
            twist = self._states.twist(self.data, body, mujoco.mjtObj.mjOBJ_BODY)
            row[:3], row[3:7] = self.data.xipos[body], np.roll(self.data.xquat[body], -1)
            row[7:10], row[10:] = twist[3:], twist[:3]
        return found
