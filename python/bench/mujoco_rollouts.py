"""The rollouts of a tree by MuJoCo, from C: `make bench` compares its speed.

Once by `mj_step`, with the steps of an edge in one call, and once by `mujoco.rollout`, which takes
edges of the same number of steps as one batch. Both get their arrays before the clock starts, begin
each edge without a warm start, and end in the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

import mujoco
import numpy as np
from mujoco.rollout import Rollout
from scipy.spatial.transform import Rotation

import energymargin as em
from edges import Edge, Vector, axes, inertia, objects
from mujoco_model import Twin, chain_base, turned

__all__ = ["MuJoCoEdges"]

PHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS.value
APPLIED = mujoco.mjtState.mjSTATE_XFRC_APPLIED.value
WHOLE = PHYSICS | APPLIED | mujoco.mjtState.mjSTATE_WARMSTART.value


@dataclass(frozen=True)
class Batch:
    """Edges of the same number of steps, as `mujoco.rollout` takes them."""

    steps: int
    starts: Vector
    """Shape (B, n)."""
    wrenches: Vector
    """Shape (B, steps, 6 bodies)."""
    states: Vector
    """After each step, shape (B, steps, n): where it puts them."""
    sensors: Vector


class MuJoCoEdges:
    """A tree's edges in MuJoCo."""

    def __init__(self, problem: em.Problem, edges: Sequence[Edge]) -> None:
        """Builds the model, and the arrays that start each edge."""
        self.twin = Twin(problem)
        self.scene = self.twin.scene
        self.model = mujoco.MjModel.from_xml_string(self.twin.text)
        self.data = mujoco.MjData(self.model)
        self.edge_steps = [edge.steps for edge in edges]
        positions, velocities = self._states(np.array([edge.start for edge in edges]))
        applied = self._applied(edges)
        self.wholes, self.starts, self.applied = [], [], applied
        for at, speed, wrench in zip(positions, velocities, applied, strict=True):
            self.data.qpos[:], self.data.qvel[:] = at, speed
            self.data.xfrc_applied[:] = wrench.reshape(-1, 6)
            self.wholes.append(self._state(WHOLE))
            self.starts.append(self._state(PHYSICS))
        self._threads = Rollout(nthread=0)

    @property
    def steps(self) -> int:
        """Of all edges."""
        return sum(self.edge_steps)

    def step(self) -> None:
        """All edges by `mj_step`."""
        model, data = self.model, self.data
        for start, steps in zip(self.wholes, self.edge_steps, strict=True):
            mujoco.mj_setState(model, data, start, WHOLE)
            mujoco.mj_step(model, data, steps)

    def roll_out(self) -> None:
        """All edges by `mujoco.rollout`, on the calling thread."""
        for batch in self._batches:
            self._threads.rollout(
                [self.model] * len(batch.starts),
                [self.data],
                batch.starts,
                batch.wrenches,
                control_spec=APPLIED,
                skip_checks=True,
                nstep=batch.steps,
                state=batch.states,
                sensordata=batch.sensors,
            )

    def rolled_out(self) -> Vector:
        """The states at the ends of the edges after `roll_out`, shape (M, n)."""
        order = np.argsort(self.edge_steps, kind="stable")
        ends = np.concatenate([batch.states[:, -1] for batch in self._batches])
        return np.asarray(ends[np.argsort(order)])

    def stepped(self) -> tuple[Vector, Vector, list[int], list[int]]:
        """`step` once more, step by step: the states at the ends of the edges, shape (M, n), where
        the objects are there [m], shape (M, k, 3), and of each step the number of contacts and of
        the solver's iterations."""
        model, data = self.model, self.data
        bodies = [model.body(name).id for name in objects(self.scene)]
        states, places, contacts, iterations = [], [], [], []
        for start, steps in zip(self.wholes, self.edge_steps, strict=True):
            mujoco.mj_setState(model, data, start, WHOLE)
            for _ in range(steps):
                mujoco.mj_step(model, data)
                contacts.append(int(data.ncon))
                iterations.append(int(data.solver_niter.max()))
            states.append(self._state(PHYSICS))
            mujoco.mj_kinematics(model, data)
            places.append(data.xpos[bodies].copy())
        return np.array(states), np.array(places), contacts, iterations

    @cached_property
    def _batches(self) -> list[Batch]:
        order = np.argsort(self.edge_steps, kind="stable")
        made = []
        for steps, group in groupby(order, lambda edge: self.edge_steps[edge]):
            chosen = list(group)
            starts = np.array([self.starts[edge] for edge in chosen])
            wrenches = np.repeat(self.applied[chosen][:, None], steps, axis=1)
            states = np.zeros((len(chosen), steps, starts.shape[1]))
            made.append(Batch(steps, starts, wrenches, states, np.zeros((len(chosen), steps, 0))))
        return made

    def _state(self, of: int) -> Vector:
        state = np.zeros(mujoco.mj_stateSize(self.model, of))
        mujoco.mj_getState(self.model, self.data, state, of)
        return state

    def _applied(self, edges: Sequence[Edge]) -> Vector:
        """On all bodies, shape (M, 6 bodies)."""
        wrenches = np.zeros((len(edges), self.model.nbody, 6))
        for body in self.scene.bodies:
            if body.force.any():
                wrenches[:, self.model.body(body.name).id, :3] += np.ravel(body.force)
        given = np.array([edge.wrenches for edge in edges])
        for number, name in enumerate(objects(self.scene)):
            wrenches[:, self.model.body(name).id] += given[:, number]
        return wrenches.reshape(len(edges), -1)

    def _states(self, states: Vector) -> tuple[Vector, Vector]:
        """The scene's states, shape (M, n), as MuJoCo has them: qpos and qvel."""
        positions = np.tile(self.model.qpos0, (len(states), 1))
        velocities = np.zeros((len(states), self.model.nv))

        def put(joint: str, position: Any, velocity: Any) -> None:
            of = self.model.joint(joint)
            place, speed = np.atleast_2d(position.T).T, np.atleast_2d(velocity.T).T
            first, start = int(of.qposadr[0]), int(of.dofadr[0])
            positions[:, first : first + place.shape[1]] = place
            velocities[:, start : start + speed.shape[1]] = speed

        links = {joint.child for joint in self.scene.joints}
        for body in self.scene.bodies:
            if not body.fixed and body.name not in links:
                self._put_body(body, states[:, self.scene.slice(body.name)], put)
        for joint in self.scene.joints:
            if joint.type != "fixed" and not joint.held:
                now = states[:, self.scene.joint_slice(joint.name)]
                put(joint.name, now[:, 0], now[:, 1])
        return positions, velocities

    def _put_body(self, body: em.Body, now: Vector, put: Any) -> None:
        """Of a free body's 13 numbers, shape (M, 13), what its joints say."""
        place, orientation, velocity, spin = np.split(now, (3, 7, 10), axis=1)
        linear, angular = axes(body.linear_factor), axes(body.angular_factor)
        turn = Rotation.from_quat(orientation)
        if linear == angular == (0, 1, 2):
            put(
                body.name,
                np.hstack([place, turned(orientation)]),
                np.hstack([velocity, turn.inv().apply(spin)]),
            )
            return
        arm = turn.apply(inertia(body).center)
        base, turned_base = chain_base(body, self.twin.now[body.name])
        rest = base + Rotation.from_quat(turned_base).apply(inertia(body).center)
        slid, speed = place + arm - rest, velocity + np.cross(spin, arm)
        for axis in linear:
            put(f"{body.name}/slide{axis}", slid[:, axis], speed[:, axis])
        for axis in angular:
            angle = 2.0 * np.arctan2(orientation[:, axis], orientation[:, 3])
            put(f"{body.name}/hinge{axis}", angle, spin[:, axis])
