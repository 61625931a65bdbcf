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

import mujoco
import numpy as np
from mujoco.rollout import Rollout

import energymargin as em
from edges import Edge, objects
from energymargin.base.aliases import Floats
from energymargin.mujoco import model_of
from energymargin.mujoco.states import States

__all__ = ["MuJoCoEdges"]

PHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS.value
APPLIED = mujoco.mjtState.mjSTATE_XFRC_APPLIED.value
CONTROLS = mujoco.mjtState.mjSTATE_CTRL.value
DIVERGENCE = [int(getattr(mujoco.mjtWarning, f"mjWARN_BAD{of}")) for of in ("QPOS", "QVEL", "QACC")]
WHOLE = PHYSICS | APPLIED | mujoco.mjtState.mjSTATE_WARMSTART.value


@dataclass(frozen=True)
class Batch:
    """Edges of the same number of steps, as `mujoco.rollout` takes them."""

    steps: int
    starts: Floats
    """Shape (B, n)."""
    controls: Floats
    """And the wrenches, shape (B, steps, controls + 6 bodies)."""
    states: Floats
    """After each step, shape (B, steps, n): where it puts them."""
    sensors: Floats


class MuJoCoEdges:
    """A tree's edges in MuJoCo."""

    def __init__(self, problem: em.Problem, edges: Sequence[Edge]) -> None:
        """Builds the model, and the arrays that start each edge."""
        self.scene = problem.scene
        self.model = model_of(problem.scene, problem.state)
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # which would hide it
        self.data = mujoco.MjData(self.model)
        mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        self.edge_steps = [edge.steps for edge in edges]
        self.wholes, self.starts, self.applied = [], [], self._applied(edges)
        states = States(self.scene, self.model)
        for edge, wrenches in zip(edges, self.applied, strict=True):
            states.write(self.data, edge.start)
            self.data.xfrc_applied[:] = wrenches.reshape(-1, 6)
            self.wholes.append(self._state(WHOLE))
            self.starts.append(self._state(PHYSICS))
        self._threads = Rollout(nthread=0)

    @property
    def steps(self) -> int:
        """Simulation steps of all edges."""
        return sum(self.edge_steps)

    def step(self) -> Floats:
        """All edges by `mj_step`: where the objects end [m], shape (M, k, 3); NaN: it diverged."""
        model, data, places = self.model, self.data, []
        bodies = [model.body(name).id for name in objects(self.scene)]
        shape = (len(bodies), 3)
        for start, steps in zip(self.wholes, self.edge_steps, strict=True):
            mujoco.mj_setState(model, data, start, WHOLE)
            before = self._diverged()
            mujoco.mj_step(model, data, steps)
            mujoco.mj_kinematics(model, data)
            whole = self._diverged() == before
            places.append(data.xpos[bodies] if whole else np.full(shape, np.nan))
        return np.array(places)

    def roll_out(self) -> None:
        """All edges by `mujoco.rollout`, on the calling thread."""
        for batch in self._batches:
            self._threads.rollout(
                [self.model] * len(batch.starts),
                [self.data],
                batch.starts,
                batch.controls,
                control_spec=CONTROLS | APPLIED,
                skip_checks=True,
                nstep=batch.steps,
                state=batch.states,
                sensordata=batch.sensors,
            )

    def rolled_out(self) -> Floats:
        """The states at the ends of the edges after `roll_out`, shape (M, n)."""
        order = np.argsort(self.edge_steps, kind="stable")
        ends = np.concatenate([batch.states[:, -1] for batch in self._batches])
        return np.asarray(ends[np.argsort(order)])

    def stepped(self) -> tuple[Floats, list[int], list[int]]:
        """`step` once more, step by step: the states at the ends of the edges, shape (M, n), and of
        each step the number of contacts and of the solver's iterations."""
        model, data = self.model, self.data
        states, contacts, iterations = [], [], []
        for start, steps in zip(self.wholes, self.edge_steps, strict=True):
            mujoco.mj_setState(model, data, start, WHOLE)
            for _ in range(steps):
                mujoco.mj_step(model, data)
                contacts.append(int(data.ncon))
                iterations.append(int(data.solver_niter.max()))
            states.append(self._state(PHYSICS))
        return np.array(states), contacts, iterations

    def _diverged(self) -> int:
        return sum(int(self.data.warning[kind].number) for kind in DIVERGENCE)

    @cached_property
    def _batches(self) -> list[Batch]:
        order = np.argsort(self.edge_steps, kind="stable")
        made = []
        for steps, group in groupby(order, lambda edge: self.edge_steps[edge]):
            chosen = list(group)
            starts = np.array([self.starts[edge] for edge in chosen])
            targets = np.tile(self.data.ctrl, (len(chosen), 1))
            controls = np.hstack([targets, self.applied[chosen]])[:, None].repeat(steps, axis=1)
            states = np.zeros((len(chosen), steps, starts.shape[1]))
            made.append(Batch(steps, starts, controls, states, np.zeros((len(chosen), steps, 0))))
        return made

    def _state(self, of: int) -> Floats:
        state = np.zeros(mujoco.mj_stateSize(self.model, of))
        mujoco.mj_getState(self.model, self.data, state, of)
        return state

    def _applied(self, edges: Sequence[Edge]) -> Floats:
        """On all bodies, shape (M, 6 bodies)."""
        wrenches = np.zeros((len(edges), self.model.nbody, 6))
        given = np.array([edge.wrenches for edge in edges])
        for number, name in enumerate(objects(self.scene)):
            wrenches[:, self.model.body(name).id] += given[:, number]
        return wrenches.reshape(len(edges), -1)
