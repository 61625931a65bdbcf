"""A trial of a grasp in MuJoCo: the same scene, start, motions and disturbance.

The hand's base is so heavy that nothing but its motor moves it. Its velocities change with each
step of MuJoCo, so that no step has the whole change of one of ours.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Scene, World, capture_probability
from energymargin.grasps.belief import GraspDraw
from energymargin.grasps.hands import Fitted, Hand
from energymargin.grasps.outcomes import Closed, Grasp
from energymargin.grasps.protocols import GRAVITY
from energymargin.grasps.trials import LEVER, GraspTrials
from energymargin.model.scenes.mjcf_model import name_of
from energymargin.mujoco import model_of
from energymargin.mujoco.replay import Edge, EscapePlayer
from energymargin.mujoco.simulation import Simulation

__all__ = ["SOFTNESSES", "End", "Engine", "Trial"]

STEP = 1 / 240  # s; pieces of a disturbance last for so many of these
HEAVY = 1e4  # kg and kg m^2, of the hand's base
FREE = 1e-6  # m, of an overlap at the start: contacts of MuJoCo throw off what begins in one


@dataclass(frozen=True)
class Engine:
    """How MuJoCo computes."""

    step: float
    """[s]"""
    solimp: tuple[float, float, float]
    """Share of a contact's force that is rigid, at its first touch and from a depth [m] on."""
    impratio: float
    """How much stiffer friction is than a contact's normal force."""


SOFTNESSES = (((0.9, 0.95, 1e-3), 10.0), ((0.99, 0.999, 1e-4), 100.0))
"""`solimp` and `impratio`: MuJoCo's own with friction that creeps less, and far stiffer."""


class End(NamedTuple):
    """What became of a trial."""

    gripped: bool
    held: bool


NOT_GRIPPED = End(False, False)


class Movable(Hand):
    """A hand whose base is no kinematic body, which MJCF does not have, but one that moves."""

    def __init__(self, hand: Hand) -> None:
        """`hand`: the one that it is but for its base."""
        self.hand, self.closing, self.friction_rule = hand, hand.closing, hand.friction_rule

    def add_to(self, scene: Scene, *, force: float, opening: float) -> Fitted:
        """As Hand.add_to."""
        return self.hand.add_to(_Movable(scene), force=force, opening=opening)  # type: ignore[arg-type]

    @property
    def force(self) -> float:
        """As Hand.force."""
        return self.hand.force

    @property
    def text(self) -> dict[str, Any]:
        """As Hand.text."""
        return self.hand.text


class _Movable:
    """A scene that makes usual bodies of kinematic ones."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def __getattr__(self, name: str) -> Any:
        return getattr(self._scene, name)

    def add_body(self, name: str, shape: Any, *, kinematic: bool = False, **more: Any) -> None:
        self._scene.add_body(name, shape, **more)


class Trial(NamedTuple):
    """A trial of a grasp, here or in MuJoCo."""

    trials: GraspTrials
    grasp: Grasp
    number: int
    """-1: with nothing unknown."""
    strength: float = 0.0
    """Of the disturbance, as a share of the protocol's bounds."""

    @property
    def draw(self) -> GraspDraw:
        """What is not known, but for the pose."""
        return self.trials.draw(self.number)

    def there(self, how: Engine, cancel: Cancel) -> End:
        """In MuJoCo."""
        trials, draw = replace(self.trials, hand=Movable(self.trials.hand)), self.draw
        start = self.trials.start(self.grasp, draw, FREE).state
        if start is None:
            return NOT_GRIPPED
        closed = _close(trials, self.grasp.opening, start, draw, how)
        if closed.ending:
            return NOT_GRIPPED
        problem = trials.problem(closed, draw)
        twin = _twin(problem.scene, closed.state, how)
        player = EscapePlayer(problem, problem.captured, *twin, cancel)
        player.start = Moved(problem.scene, *twin, _motion(trials, closed, how.step))
        played = player.play(self.pieces(draw.mass))
        return End(True, not played.escaped)

    def here(self, cancel: Cancel) -> End:
        """With our own engine."""
        trials, draw = self.trials, self.draw
        start = trials.start(self.grasp, draw, FREE).state
        if start is None:
            return NOT_GRIPPED
        closed = trials.close(self.grasp.opening, start, draw, cancel)
        if closed.ending:
            return NOT_GRIPPED
        problem, pieces = trials.problem(closed, draw), self.pieces(draw.mass)
        steps = [round(piece.duration / trials.step) for piece in pieces]
        rows = np.repeat([piece.wrenches[0] for piece in pieces], steps, axis=0)
        found = capture_probability(
            problem,
            disturbance=lambda random, times: rows,
            rollouts=1,
            threads=1,
            cancel=cancel,
        )
        return End(True, bool(found.captured == 1))

    def pieces(self, mass: float) -> list[Edge]:
        """Pieces of the disturbance: even within the bounds, each held for an even time of whole
        steps of ours."""
        protocol = self.trials.protocol
        if self.strength == 0:
            return [Edge(np.zeros((1, 6)), protocol.horizon)]
        random = np.random.default_rng([self.trials.seed, self.number, 2])
        per_weight = np.repeat([protocol.force, LEVER * protocol.torque], 3)
        bounds = self.strength * mass * GRAVITY * per_weight
        left, longest = round(protocol.horizon / STEP), round(protocol.duration / STEP)
        pieces = []
        while left > 0:
            steps = min(left, int(random.integers(1, longest + 1)))
            pieces.append(Edge(random.uniform(-1.0, 1.0, (1, 6)) * bounds, steps * STEP))
            left -= steps
        return pieces


def _close(
    there: GraspTrials, opening: float, start: NDArray[np.float64], draw: GraspDraw, how: Engine
) -> Closed:
    """The hand after it has closed in MuJoCo."""
    scene, hand = there.scene(opening, draw, gravity=there.protocol.gravity == "always")
    rows = max(2, round(there.hand.closing / how.step))
    steps = rows + round(there.protocol.settle / how.step)
    ways = {j: np.linspace(*ends, rows) for j, ends in hand.targets.items()}
    ways = {j: np.append(way, np.full(steps - rows, way[-1])) for j, way in ways.items()}
    motion = Motion(hand.base, np.zeros((steps, 6)), ways)
    simulation = Moved(scene, *_twin(scene, start, how), motion)
    simulation.advance(steps)
    state = simulation.state()
    ending = there.ending(World(scene), hand, state, simulation.pressed)
    return there.closed(scene, hand, state, ending)


class Motion(NamedTuple):
    """What a hand does, step by step of MuJoCo."""

    base: str
    velocities: NDArray[np.float64]
    """Of the base, along the world's axes, (K, 6)."""
    targets: dict[str, NDArray[np.float64]]
    """By joint, (K,)."""


def _motion(there: GraspTrials, closed: Closed, step: float) -> Motion:
    """That of a closed hand through the protocol."""
    hand = closed.hand
    rows = there.protocol.rows(closed.base[:3, :3] @ hand.frame[:3, :3], step)
    targets = {joint: np.full(len(rows), shut) for joint, (_, shut) in hand.targets.items()}
    return Motion(hand.base, rows, targets)


class Moved(Simulation):
    """A simulation whose hand has a motion."""

    def __init__(self, scene: Scene, model: Any, data: Any, motion: Motion) -> None:
        """Makes the hand's base heavy in the model."""
        super().__init__(scene, model, data)
        self.live = copy(data)
        self._base, self._motion = self.states.body_id(motion.base), motion
        first = model.jnt_dofadr[model.body_jntadr[self._base]]
        self._free = slice(first, first + 6)
        model.dof_armature[self._free] = HEAVY
        mujoco.mj_setConst(model, copy(data))

    @property
    def pressed(self) -> set[str]:
        """Bodies that press on the object or on which it presses."""
        bodies, force = set(), np.zeros(6)
        for k, contact in enumerate(self.live.contact[: self.live.ncon]):
            mujoco.mj_contactForce(self.model, self.live, k, force)
            ends = self.model.geom_bodyid[[contact.geom1, contact.geom2]]
            if force[0] > 0 and set(ends) & set(self.objects):
                bodies |= {name_of(self.model, "body", int(end)) for end in ends}
        return bodies

    def advance(self, steps: int) -> None:
        """As Simulation.advance, without the work."""
        model, data, gain = self.model, self.live, HEAVY / self.model.opt.timestep
        data.xfrc_applied[self.objects] = self._wrenches
        velocity, force = data.qvel[self._free], data.qfrc_applied[self._free]
        turn, wanted = data.xmat[self._base].reshape(3, 3), np.zeros(6)
        velocities, last = self._motion.velocities, len(self._motion.velocities) - 1
        before = data.time
        for step in range(self.steps, self.steps + steps):
            row = min(step, last)
            for joint, targets in self._motion.targets.items():
                data.actuator(joint).ctrl = targets[row]
            wanted[:3] = velocities[row, :3]
            wanted[3:] = velocities[row, 3:] @ turn  # in the body's frame
            force[:] = gain * (wanted - velocity)
            mujoco.mj_step(model, data)
        if steps and not data.time > before:
            raise RuntimeError(f"MuJoCo diverged after {self.time:.3g} s")
        self.steps += steps
        mujoco.mj_getState(model, data, self.row, mujoco.mjtState.mjSTATE_INTEGRATION.value)

    def branch(self) -> Moved:
        """As of Simulation."""
        other = super().branch()
        assert isinstance(other, Moved)
        other.live = copy(self.live)
        return other


def _twin(scene: Scene, state: NDArray[np.float64], how: Engine) -> tuple[Any, Any]:
    """The scene's model, as stiff as is asked for, and the data at a state."""
    model = model_of(scene, state, step=how.step)
    model.opt.impratio = how.impratio
    model.pair_solimp[:, :3] = how.solimp
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data
