"""The rollouts of a tree as a user of PyBullet would write them: `make bench` compares its speed.

A body with locked axes stands on a chain of joints, one for each axis that is free; a robot's
joints are held by PyBullet's own position control.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pybullet as p
from scipy.spatial import ConvexHull

import energymargin as em
from edges import Edge, axes, inertia
from energymargin.base.aliases import Floats

HOLD = 1000.0  # torque that a joint is held with [N m]
JOINTS = {"revolute": p.JOINT_REVOLUTE, "prismatic": p.JOINT_PRISMATIC, "fixed": p.JOINT_FIXED}
UNIT = (0.0, 0.0, 0.0, 1.0)
UNUSED: dict[str, Any] = {"halfExtents": (0, 0, 0), "radii": 0.0, "lengths": 0.0, "fileNames": ""}
SINGULAR = {
    "shapeTypes": "shapeType",
    "halfExtents": "halfExtents",
    "radii": "radius",
    "lengths": "height",
    "fileNames": "fileName",
}


@dataclass(frozen=True)
class Place:
    """Where PyBullet has a body."""

    uid: int
    link: int = -1
    """-1: the base."""
    linear: tuple[int, ...] = ()
    """Axes of its chain."""
    angular: tuple[int, ...] = ()

    @property
    def chained(self) -> bool:
        """Whether it stands on a chain of joints."""
        return self.link >= 0


class PyBulletScene:
    """A scene in PyBullet. One at a time: PyBullet simulates what was made last."""

    def __init__(self, problem: em.Problem) -> None:
        """Builds it, with the settings of the problem's scene; ValueError on a shape it lacks."""
        p.connect(p.DIRECT)
        self.scene = problem.scene
        self.steps = 0
        self.places: dict[str, Place] = {}
        self.joints: dict[str, tuple[int, int]] = {}
        p.setGravity(*self.scene.gravity)
        p.setPhysicsEngineParameter(
            fixedTimeStep=self.scene.step,
            numSolverIterations=self.scene.solver_iterations,
            solverResidualThreshold=self.scene.solver_tolerance,
        )
        links = {joint.child for joint in self.scene.joints}
        for body in self.scene.bodies:
            if body.name not in links:
                self._add(body, problem.state)
        for joint in self.scene.joints:
            self._drive(joint, problem.state)
        for a, b in self.scene.disabled_collisions:
            p.setCollisionFilterPair(
                *(self.places[name].uid for name in (a, b)),
                *(self.places[name].link for name in (a, b)),
                enableCollision=0,
            )
        self.moving = [
            (b.name, self.places[b.name])
            for b in self.scene.bodies
            if b.mass > 0.0 and b.name not in links
        ]
        self.objects = [self.places[b.name] for b in self.scene.bodies if b.role == "object"]
        self.loads = [(self.places[b.name], b.force) for b in self.scene.bodies if b.force.any()]

    def close(self) -> None:
        """Ends PyBullet's simulation."""
        p.disconnect()

    def _add(self, body: em.Body, state: Floats) -> None:
        linear, angular = axes(body.linear_factor), axes(body.angular_factor)
        if any(joint.parent == body.name for joint in self.scene.joints):
            self._add_robot(body)
        elif body.mass == 0.0 or linear == angular == (0, 1, 2):
            uid = p.createMultiBody(
                body.mass, shape(body.shape), -1, body.position, body.orientation
            )
            self._settle(body, Place(uid))
        else:
            self._add_chain(body, linear, angular, self.scene.unpack(state)[body.name])

    def _add_chain(
        self, body: em.Body, linear: tuple[int, ...], angular: tuple[int, ...], now: dict[str, Any]
    ) -> None:
        count = len(linear) + len(angular)
        base = np.where(body.linear_factor > 0.0, 0.0, now["position"])
        uid = p.createMultiBody(
            0.0,
            basePosition=base,
            linkMasses=[0.0] * (count - 1) + [body.mass],
            linkCollisionShapeIndices=[-1] * (count - 1) + [shape(body.shape)],
            linkVisualShapeIndices=[-1] * count,
            linkPositions=[(0, 0, 0)] * count,
            linkOrientations=[UNIT] * (count - 1)
            + [UNIT if angular else tuple(now["orientation"])],
            linkInertialFramePositions=[(0, 0, 0)] * (count - 1) + [inertia(body).center],
            linkInertialFrameOrientations=[UNIT] * count,
            linkParentIndices=list(range(count)),
            linkJointTypes=[p.JOINT_PRISMATIC] * len(linear) + [p.JOINT_REVOLUTE] * len(angular),
            linkJointAxis=np.eye(3)[[*linear, *angular]].tolist(),
        )
        for link in range(count):
            p.setJointMotorControl2(uid, link, p.VELOCITY_CONTROL, force=0)
            p.changeDynamics(uid, link, jointDamping=0.0)
        self._settle(body, Place(uid, count - 1, linear, angular))

    def _add_robot(self, base: em.Body) -> None:
        names, joints = [base.name], []
        bodies = {body.name: body for body in self.scene.bodies}
        for joint in self.scene.joints:  # parents come before their children
            if joint.parent in names:
                names.append(joint.child)
                joints.append(joint)
        links = [bodies[joint.child] for joint in joints]
        uid = p.createMultiBody(
            base.mass,
            shape(base.shape),
            -1,
            base.position,
            base.orientation,
            linkMasses=[link.mass for link in links],
            linkCollisionShapeIndices=[shape(link.shape) for link in links],
            linkVisualShapeIndices=[-1] * len(links),
            linkPositions=[joint.origin for joint in joints],
            linkOrientations=[joint.orientation for joint in joints],
            linkInertialFramePositions=[inertia(link).center for link in links],
            linkInertialFrameOrientations=[UNIT] * len(links),
            linkParentIndices=[names.index(joint.parent) for joint in joints],
            linkJointTypes=[JOINTS[joint.type] for joint in joints],
            linkJointAxis=[joint.axis for joint in joints],
            flags=p.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT,
        )
        for link, (body, joint) in enumerate(zip(links, joints, strict=True)):
            self._settle(body, Place(uid, link))
            self.joints[joint.name] = (uid, link)
        self._settle(base, Place(uid))

    def _settle(self, body: em.Body, place: Place) -> None:
        self.places[body.name] = place
        p.changeDynamics(place.uid, -1, linearDamping=0.0, angularDamping=0.0)
        p.changeDynamics(place.uid, place.link, lateralFriction=body.friction)
        if body.inertial:
            p.changeDynamics(place.uid, place.link, localInertiaDiagonal=body.inertial.moments)

    def _drive(self, joint: em.Joint, state: Floats) -> None:
        uid, link = self.joints[joint.name]
        now = state[self.scene.joint_slice(joint.name)][0]
        target = now if joint.held else joint.target
        force = HOLD if joint.held else joint.stiffness * abs(target - now)  # as hard as it is now
        p.setJointMotorControl2(uid, link, p.POSITION_CONTROL, targetPosition=target, force=force)

    def set(self, state: Floats) -> None:
        """Puts all that can move where it is in a state."""
        for name, place in self.moving:
            now = state[self.scene.slice(name)]
            position, orientation, velocity, spin = now[:3], now[3:7], now[7:10], now[10:]
            if not place.chained:
                p.resetBasePositionAndOrientation(place.uid, position, orientation)
                p.resetBaseVelocity(place.uid, velocity, spin)
                continue
            for link, axis in enumerate(place.linear):
                p.resetJointState(place.uid, link, position[axis], velocity[axis])
            for axis in place.angular:
                angle = 2.0 * np.arctan2(orientation[axis], orientation[3])
                p.resetJointState(place.uid, place.link, angle, spin[axis])
        for name, (uid, link) in self.joints.items():
            p.resetJointState(uid, link, *state[self.scene.joint_slice(name)])

    def replay(self, edges: Sequence[Edge]) -> Floats:
        """Makes the rollouts; returns where they leave the objects [m], shape (M, k, 3)."""
        ends = []
        for edge in edges:
            self.rollout(edge)
            ends.append([position(place) for place in self.objects])
        return np.array(ends)

    def rollout(self, edge: Edge) -> None:
        """One of them."""
        self.set(edge.start)
        for _ in range(edge.steps):
            for place, wrench in zip(self.objects, edge.wrenches, strict=True):
                self._push(place, wrench[:3])
                p.applyExternalTorque(place.uid, place.link, wrench[3:], p.WORLD_FRAME)
            for place, force in self.loads:
                self._push(place, force)
            for spring in self.scene.springs:
                self._pull(spring)
            p.stepSimulation()
            self.steps += 1

    def _push(self, place: Place, force: Any) -> None:
        p.applyExternalForce(place.uid, place.link, force, position(place), p.WORLD_FRAME)

    def _pull(self, spring: em.Spring) -> None:
        a, b = self.places[spring.body_a], self.places[spring.body_b]
        span = np.subtract(position(b), position(a))
        length = np.linalg.norm(span)
        pull = spring.stiffness * (length - spring.rest_length) / length * span
        self._push(a, pull)
        self._push(b, -pull)


def position(place: Place) -> Any:
    """Position of the centre of mass [m]."""
    if place.chained:
        return p.getLinkState(place.uid, place.link, computeForwardKinematics=1)[0]
    return p.getBasePositionAndOrientation(place.uid)[0]


def shape(of: Any) -> int:
    """A collision shape of PyBullet's."""
    if isinstance(of, em.Plane):
        return int(p.createCollisionShape(p.GEOM_PLANE, planeNormal=of.normal))
    with TemporaryDirectory() as folder:
        if not isinstance(of, em.Compound):
            one = {SINGULAR[key]: value for key, value in solid(of, Path(folder) / "0.obj").items()}
            return int(p.createCollisionShape(**one))
        solids = [solid(part.shape, Path(folder) / f"{n}.obj") for n, part in enumerate(of.parts)]
        many = {key: [part.get(key, UNUSED[key]) for part in solids] for key in UNUSED}
        return int(
            p.createCollisionShapeArray(
                [part["shapeTypes"] for part in solids],
                collisionFramePositions=[part.position for part in of.parts],
                collisionFrameOrientations=[part.orientation for part in of.parts],
                **many,
            )
        )


def solid(of: Any, file: Path) -> dict[str, Any]:
    """The arguments of a solid's collision shape; a hull is written into a file for it."""
    if isinstance(of, em.Box):
        return {"shapeTypes": p.GEOM_BOX, "halfExtents": of.size / 2}
    if isinstance(of, em.Sphere):
        return {"shapeTypes": p.GEOM_SPHERE, "radii": of.radius}
    if isinstance(of, em.Cylinder | em.Capsule):
        kind = p.GEOM_CYLINDER if isinstance(of, em.Cylinder) else p.GEOM_CAPSULE
        return {"shapeTypes": kind, "radii": of.radius, "lengths": of.length}
    corners = [f"v {x} {y} {z}" for x, y, z in of.points]
    faces = [f"f {a} {b} {c}" for a, b, c in ConvexHull(of.points).simplices + 1]
    file.write_text("\n".join([*corners, *faces]))
    return {"shapeTypes": p.GEOM_MESH, "fileNames": str(file)}
