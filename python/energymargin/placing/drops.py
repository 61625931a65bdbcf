"""How a body that is dropped comes to lie on a plane, as simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin import Cancel, Cancelled, Inertial, Scene, scenes
from energymargin.base.plausibility import kept_warnings
from energymargin.placing.boxes import Floats
from energymargin.placing.settling import settle

GRAVITY = 9.81  # m/s^2
ROCKING = 2e-3  # of the reach; a body that moves less within REST is at rest after a drop
REST, LONGEST = 0.15, 5.0  # s


@dataclass(frozen=True, eq=False)
class Drops:
    """Drops of a body on a plane, by their numbers."""

    shape: Any
    mass: float
    friction: float
    inertial: Inertial | None
    slope: float
    height: float
    seed: int
    normals: Floats
    """Of its faces, (N, 3)."""
    reach: float
    """From its centre of mass [m]."""

    def ends(self, numbers: Sequence[int], cancel: Cancel) -> list[int]:
        """The face that is down in the end, of each; once it is cancelled, of those that ended."""
        down = GRAVITY * np.array([np.sin(self.slope), 0, -np.cos(self.slope)])
        scene = Scene(down, friction_rule="max")
        scene.add_plane("plane", friction=self.friction)
        body: dict[str, Any] = {"mass": self.mass, "inertial": self.inertial}
        scene.add_body("object", self.shape, friction=self.friction, **body)
        points = np.concatenate(scenes.shape_parts(self.shape))
        rule: dict[str, Any] = {"still": ROCKING * self.reach, "during": REST}
        found = list[int]()
        for number in numbers:
            turn = Rotation.random(random_state=np.random.default_rng([self.seed, number]))
            start = {"position": (0, 0, self.height - turn.apply(points)[:, 2].min())}
            state = scene.pack(object=start | {"orientation": turn.as_quat()})
            try:
                with kept_warnings():  # which each of many drops would repeat
                    end = settle(scene, state, time=LONGEST, **rule, cancel=cancel)
            except Cancelled:
                break
            if not end.complete:
                break
            there = Rotation.from_quat(scene.unpack(end.state)["object"]["orientation"])
            found.append(int(np.argmax(self.normals @ there.inv().apply([0, 0, -1.0]))))
        return found
