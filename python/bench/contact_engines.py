"""One scene in three engines: where its bodies go, and how long that takes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import mujoco
import numpy as np
import pybullet as p
from scipy.spatial.transform import Rotation

import energymargin as em
from edges import inertia
from energymargin.base.aliases import Floats
from energymargin.mujoco.mjcf import model_of
from energymargin.mujoco.simulation import Simulation
from pybullet_rollouts import JOINTS, UNIT, shape

__all__ = ["Engine", "MuJoCo", "Ours", "Played", "PyBullet"]


@dataclass(frozen=True)
class Played:
    """What an engine does with a scene."""

    poses: dict[str, Floats]
    """Poses of bodies that move freely: position [m] and quaternion (x, y, z, w), shape (K, 7)."""
    seconds: float
    """In the engine's steps."""
    steps: int
    duration: float
    """Simulated [s]."""


class Engine(Protocol):
    """An engine with its settings."""

    @property
    def name(self) -> str:
        """In tables."""
        ...

    def play(self, scene: em.Scene, times: Sequence[float]) -> Played:
        """Goes through a scene from its start; poses at times, ascending [s]."""
        ...


@dataclass(frozen=True)
class Ours:
    """This library, at steps of the scene's over `parts`."""

    parts: int = 1

    @property
    def name(self) -> str:
        """With the step."""
        return f"ours, 1/{240 * self.parts} s"

    def play(self, scene: em.Scene, times: Sequence[float]) -> Played:
        """One simulation."""
        world, state = em.World(scene), scene.pack()
        frames = [round(time / scene.step) for time in times]
        begun = perf_counter()
        states = world.simulate(state, frames[-1], record=frames).states
        seconds = perf_counter() - begun
        return Played(_poses(scene, states), seconds, frames[-1], times[-1])


@dataclass(frozen=True)
class MuJoCo:
    """MuJoCo with elliptic cones and contacts as stiff as its step lets them be."""

    step: float

    @property
    def name(self) -> str:
        """With the step."""
        return f"MuJoCo, 1/{1 / self.step:.0f} s"

    def play(self, scene: em.Scene, times: Sequence[float]) -> Played:
        """One simulation."""
        model = model_of(scene, step=self.step)
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        simulation, seconds, states = Simulation(scene, model, data), 0.0, []
        for time in times:
            steps = round(time / self.step) - simulation.steps
            begun = perf_counter()
            simulation.advance(steps)
            seconds += perf_counter() - begun
            states.append(simulation.state())
        return Played(_poses(scene, states), seconds, simulation.steps, times[-1])


@dataclass(frozen=True)
class PyBullet:
    """PyBullet at the scene's step, with all of its iterations in each."""

    iterations: int

    @property
    def name(self) -> str:
        """With the iterations."""
        return f"PyBullet, {self.iterations:,} iterations"

    def play(self, scene: em.Scene, times: Sequence[float]) -> Played:
        """One simulation; drives are forces of the scene's law, anew in each step."""
        p.connect(p.DIRECT)
        try:
            twin = _Twin(scene, self.iterations)
            seconds, step, frames = 0.0, 0, {}
            for time in times:
                while step < round(time / scene.step):
                    twin.drive()
                    begun = perf_counter()
                    p.stepSimulation()
                    seconds += perf_counter() - begun
                    step += 1
                frames[time] = {name: twin.pose(name) for name in free_bodies(scene)}
            poses = {
                name: np.array([f[name] for f in frames.values()]) for name in free_bodies(scene)
            }
            return Played(poses, seconds, step, times[-1])
        finally:
            p.disconnect()


def free_bodies(scene: em.Scene) -> list[str]:
    """Bodies that move and hang on no joint."""
    links = {joint.child for joint in scene.joints}
    return [body.name for body in scene.bodies if not body.fixed and body.name not in links]


def _poses(scene: em.Scene, states: Iterable[Floats]) -> dict[str, Floats]:
    """Those of the free bodies in K states, each of shape (K, 7)."""
    return {
        name: np.array([state[scene.slice(name)][:7] for state in states])
        for name in free_bodies(scene)
    }


class _Twin:
    """A scene in PyBullet: free and fixed bodies, and joints on fixed ones."""

    def __init__(self, scene: em.Scene, iterations: int) -> None:
        p.setGravity(*scene.gravity)
        p.setPhysicsEngineParameter(
            fixedTimeStep=scene.step, numSolverIterations=iterations, solverResidualThreshold=0.0
        )
        self.places: dict[str, tuple[int, int]] = {}
        self.centers = {b.name: inertia(b).center for b in scene.bodies if not b.fixed}
        self.drives: list[tuple[em.Joint, int, int]] = []
        links = {joint.child for joint in scene.joints}
        for body in scene.bodies:
            if body.name not in links:
                self._add(scene, body)
        for a, b in scene.disabled_collisions:
            (one, link), (other, other_link) = self.places[a], self.places[b]
            p.setCollisionFilterPair(one, other, link, other_link, enableCollision=0)

    def _add(self, scene: em.Scene, base: em.Body) -> None:
        names, joints = [base.name], []
        for joint in scene.joints:  # parents come before their children
            if joint.parent in names:
                names.append(joint.child)
                joints.append(joint)
        bodies = {body.name: body for body in scene.bodies}
        links = [bodies[joint.child] for joint in joints]
        uid = p.createMultiBody(
            base.mass,
            shape(base.shape),
            -1,
            base.position,
            base.orientation,
            baseInertialFramePosition=inertia(base).center,
            linkMasses=[link.mass for link in links],
            linkCollisionShapeIndices=[
                shape(_moved(link.shape, -joint.child_origin))
                for link, joint in zip(links, joints, strict=True)
            ],
            linkVisualShapeIndices=[-1] * len(links),
            linkPositions=[_offset(scene, joint) for joint in joints],
            linkOrientations=[joint.orientation for joint in joints],
            linkInertialFramePositions=[
                inertia(link).center - joint.child_origin
                for link, joint in zip(links, joints, strict=True)
            ],
            linkInertialFrameOrientations=[UNIT] * len(links),
            linkParentIndices=[names.index(joint.parent) for joint in joints],
            linkJointTypes=[JOINTS[joint.type] for joint in joints],
            linkJointAxis=[joint.axis for joint in joints],
            flags=p.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT,
        )
        for link, body in enumerate([base, *links], start=-1):
            self.places[body.name] = (uid, link)
            p.changeDynamics(uid, link, lateralFriction=body.friction)
            if body.inertial:
                p.changeDynamics(uid, link, localInertiaDiagonal=body.inertial.moments)
            p.changeDynamics(uid, link, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0)
        for link, joint in enumerate(joints):
            p.setJointMotorControl2(uid, link, p.VELOCITY_CONTROL, force=0.0)
            self.drives.append((joint, uid, link))

    def drive(self) -> None:
        """What the drives do in the next step."""
        for joint, uid, link in self.drives:
            position, velocity = p.getJointState(uid, link)[:2]
            force = joint.stiffness * (joint.target - position)
            force += joint.damping * (joint.target_velocity - velocity)
            force = float(np.clip(force, -joint.torque_limit, joint.torque_limit))
            p.setJointMotorControl2(uid, link, p.TORQUE_CONTROL, force=force)

    def pose(self, name: str) -> Floats:
        """Position and quaternion of a free body, shape (7,)."""
        position, turn = p.getBasePositionAndOrientation(self.places[name][0])
        center = Rotation.from_quat(turn).apply(self.centers[name])
        return np.concatenate((position - center, turn))


def _offset(scene: em.Scene, joint: em.Joint) -> Floats:
    """A joint's frame in that of its parent: PyBullet's is at the joint that carries the parent."""
    carried = [other for other in scene.joints if other.child == joint.parent]
    return np.asarray(joint.origin) - (carried[0].child_origin if carried else 0.0)


def _moved(of: Any, by: Floats) -> Any:
    """A solid elsewhere in its frame: PyBullet's links have theirs at their joints."""
    return em.Compound([em.Part(of, by)]) if by.any() else of
