"""A thing that a hand sets down: it is gripped, and let go as a protocol says."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from energymargin import Plan, Scene, World, scenes
from energymargin.grasps import GraspObject, Hand, Protocol, grip
from energymargin.placing.boxes import Floats

INSIDE = 1e-4  # m; a hand that is deeper in something has no room


class Release:
    """A hand that holds a body of a scene, and what it does to let it go."""

    def __init__(
        self, scene: Scene, body: str, hand: Hand | str, grasp: ArrayLike, protocol: Protocol | str
    ) -> None:
        """`grasp`: the grasp frame in the body's frame, (4, 4). Raises ValueError if the hand does
        not close on the body there, and on names that the scene has already."""
        own = next(one for one in scene.bodies if one.name == body)
        thing = GraspObject(own.shape, own.mass, own.friction, own.inertial)
        self._grip = grip(hand, thing, grasp, protocol, step=scene.step)
        self._body, self._old = body, scene
        self.scene = scene.with_body(body)  # a copy
        """With the hand."""
        held = self._grip.hand
        self.fitted = held.add_to(self.scene, force=held.force, opening=np.nan)
        self._world = World(self.scene)

    def begin(
        self, state: Floats, after: float
    ) -> tuple[str | None, tuple[Scene, Floats, Plan | None, float]]:
        """From a state without the hand: what is in the hand's way; and the scene, the state, the
        plan and the duration, `after` [s] it has let go."""
        held = self.state(state)
        plan = self.plan(held, after)
        return self.blocked_by(held), (self.scene, held, plan, plan.duration)

    def state(self, state: Floats) -> Floats:
        """A state of the scene without the hand, with the hand where it holds the body."""
        found = self.scene.pack()
        links = {joint.child for joint in self._old.joints}
        for one in self._old.bodies:
            if one.name not in links and (one.kinematic or not one.fixed):
                found[self.scene.slice(one.name)] = state[self._old.slice(one.name)]
        for joint in self._old.joints:
            if joint.type != "fixed" and joint.mimic is None:
                at = self.scene.joint_slice(joint.name)
                found[at] = state[self._old.joint_slice(joint.name)]
        for name, position in self._grip.joints.items():
            found[self.scene.joint_slice(name)] = position, 0.0
        base = pose_of(self._old, state, self._body) @ self._grip.base
        row = found[self.scene.slice(self.fitted.base)]
        row[:3], row[3:7], row[7:] = base[:3, 3], quaternion(base[:3, :3]), 0.0
        return np.asarray(found)

    def plan(self, state: Floats, after: float) -> Plan:
        """What the hand does from a state on, and `after` [s] it has let go."""
        step = self.scene.step
        base = pose_of(self.scene, state, self.fitted.base)
        rows = self._grip.protocol.rows((base @ self.fitted.frame)[:3, :3], step)
        still = np.zeros((max(round(after / step), 1), 6))
        shares = np.append(self._grip.protocol.shares(step), np.ones(len(still)))
        ends = self.fitted.targets
        targets = {name: shut + shares * (wide - shut) for name, (wide, shut) in ends.items()}
        rows = np.concatenate([rows, still])
        return Plan(step=step, targets=targets, velocities={self.fitted.base: rows})

    def blocked_by(self, state: Floats) -> str | None:
        """What the hand is in, if it is in something else than the body."""
        others = [one.name for one in self._old.bodies if one.name != self._body]
        depths = dict[str, float]()
        for other in others:
            gaps = (self._world.distance(state, own, other) for own in self.fitted.bodies)
            if (gap := min(gaps)) < -INSIDE:
                depths[other] = gap
        return min(depths, key=depths.__getitem__, default=None)


def quaternion(turn: Floats) -> Floats:
    """x, y, z, w, of which (1, 0, 0, 0) would look like one in another order."""
    found = Rotation.from_matrix(turn).as_quat()
    return np.asarray(-found if found[0] > 0 else found)


def pose_of(scene: Scene, state: Floats, name: str) -> Floats:
    """A body's pose, (4, 4)."""
    return np.asarray(scenes.pose(*scenes.body_poses(scene, state)[name]))
