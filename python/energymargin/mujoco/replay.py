"""Whether what leads out of the capture set here leads out in MuJoCo too, and at what work."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin._core import Cancel, EscapeEffort, Problem, Region, Scene, World
from energymargin.checks import one_of, positive_number
from energymargin.mujoco.names import Names
from energymargin.mujoco.playing import Edge, Player
from energymargin.mujoco.servos import servos
from energymargin.reprs import short_repr

__all__ = ["Replay", "replay"]

Vector = NDArray[np.float64]

SCALE_STEP = 0.01  # between two strengths of the wrenches
SAME = 1e-6  # [m], [m/s], [rad], ...: data further off are at another state than the problem


@dataclass(frozen=True, eq=False)
class Replay:
    """What became of an escape, or of a plan, in MuJoCo."""

    __repr__ = short_repr

    escaped: bool
    """Whether it leads out unchanged."""
    time: float
    """Of the first look outside, or of the end [s]."""
    effort: float
    """Until then, integral of |f . v + tau . omega| dt [J]."""
    work: float
    """The same with its sign [J]."""
    state: Vector
    """Of the scene at that time, shape (n,)."""
    distance: float
    """From the objects' positions here to those in MuJoCo at the end of the path, the most [m]."""
    angle: float
    """The same of their orientations [rad]."""
    least_scale: float | None
    """Of the wrenches, the least from 1 on with which it leads out; None if there is none."""
    least_effort: float | None
    """The effort with that [J]."""


def replay(
    model: Any,
    data: Any,
    problem: Problem,
    escape: EscapeEffort | None = None,
    *,
    captured: str = "all",
    largest_scale: float = 1.2,
    cancel: Cancel | None = None,
) -> Replay:
    """Plays an escape, or the robot's plan alone, in MuJoCo.

    Args:
        model: a `mujoco.MjModel` with the scene's bodies and joints, as `model_of` makes one.
        data: a `mujoco.MjData` at the problem's state, with its controls. It is copied.
        problem: the one that the escape is of.
        escape: whose wrenches are played; None plays the undisturbed future.
        captured: 'all' or 'any', as in `escape_effort`.
        largest_scale: if the escape does not lead out, its wrenches are tried stronger by one
            percent each time, up to this.
        cancel: Cancelled is raised once it is set.

    Looks at the capture set follow each step of the scene, or the problem's clock, each at the step
    of MuJoCo that is nearest; the model's timestep may be any. Without a clock the objects go on
    without a wrench for as long as a longest edge. Joints keep the controls of the data.

    Raises ValueError on an escape without a path, on data at another state, or whose controls ask
    joints for other targets than the scene's (`set_state` puts both), on a model that lacks a body,
    a joint or an actuator of the plan, and on a problem without a clock if there is no
    escape; RuntimeError if MuJoCo diverges; ImportError without the extra `mujoco`.
    """
    region = _region(problem, one_of("captured", captured, ("all", "any")))
    largest = positive_number("largest_scale", largest_scale)
    edges, ours = _undisturbed(problem) if escape is None else _path(escape)
    player = Player(problem, region, model, data, cancel)
    _require_same(problem, player.start)
    _require_targets(problem, model, data)
    played = player.play(edges, stop=False)
    distance, angle = _apart(problem.scene, played.end, ours)
    scale, effort = (1.0, played.effort) if played.escaped else (None, None)
    if escape is not None and scale is None:
        scale, effort = _least_scale(player, edges, largest)
    result = (played.escaped, played.time, played.effort, played.work, played.state)
    return Replay(*result, distance, angle, scale, effort)


def _region(problem: Problem, captured: str) -> Region:
    region = problem.captured if captured == "all" else problem.captured_any
    if region is None:
        raise ValueError("captured is 'any', expected 'all' for a problem of one capture set")
    return region


def _path(escape: EscapeEffort) -> tuple[list[Edge], Vector]:
    """Its edges, and the state to which they lead here."""
    if not len(escape.path):
        raise ValueError("escape has no path, expected one that leads out")
    tree = escape.tree
    edges = [
        Edge(tree.controls[node].reshape(-1, 6), float(tree.durations[node]))
        for node in escape.path[1:]
    ]
    return edges, tree.states[escape.path[-1]]


def _undisturbed(problem: Problem) -> tuple[list[Edge], Vector]:
    """The whole future, and where it ends here."""
    if problem.horizon is None:
        raise ValueError("escape is None, expected one for a problem without horizon and plan")
    scene, horizon = problem.scene, problem.horizon
    none = np.zeros((sum(body.role == "object" for body in scene.bodies), 6))
    steps = round(horizon / scene.step)
    here = World(scene, problem.plan).simulate(problem.state, steps, record=[steps])
    return [Edge(none, horizon)], here.states[-1]


def _least_scale(
    player: Player, edges: list[Edge], largest: float
) -> tuple[float | None, float | None]:
    for number in range(1, round((largest - 1.0) / SCALE_STEP) + 1):
        scale = 1.0 + number * SCALE_STEP
        played = player.play(Edge(scale * wrenches, held) for wrenches, held in edges)
        if played.escaped:
            return scale, played.effort
    return None, None


def _require_same(problem: Problem, state: Vector) -> None:
    """Raises ValueError unless the data are at the problem's state."""
    found, wanted = problem.scene.unpack(state), problem.scene.unpack(problem.state)
    for name in wanted.keys() - {"joints"}:
        one, two = found[name], wanted[name]
        turn = Rotation.from_quat([one["orientation"], two["orientation"]])
        off = float((turn[0].inv() * turn[1]).magnitude())
        for what in ("position", "velocity", "angular_velocity"):
            off = max(off, float(np.abs(one[what] - two[what]).max()))
        if off > SAME:
            raise ValueError(
                f"data has '{name}' off the problem's state by {off:.3g}, expected that state: "
                "problem.with_state(...) takes that of the data"
            )


def _require_targets(problem: Problem, model: Any, data: Any) -> None:
    """Raises ValueError unless the controls ask for the scene's targets, or a plan has others."""
    planned = problem.plan.targets if problem.plan else {}
    for name, servo in servos(Names(problem.scene, model), model).items():
        asked, target = float(data.ctrl[servo.address]), servo.joint.target
        if name not in planned and abs(asked - servo.control(target)) > SAME:
            raise ValueError(
                f"data has the control {asked:.6g} for joint {name!r}, expected "
                f"{servo.control(target):.6g}, which asks for its target {target:.6g} in the "
                "problem's scene: em.mujoco.set_state(model, data, problem.scene, problem.state) "
                "sets it"
            )


def _apart(scene: Scene, state: Vector, other: Vector) -> tuple[float, float]:
    """How far the objects are apart: distance [m] and angle [rad], the most of each."""
    one, two = scene.unpack(state), scene.unpack(other)
    objects = [body.name for body in scene.bodies if body.role == "object"]
    distances = [np.linalg.norm(one[name]["position"] - two[name]["position"]) for name in objects]
    turns = [Rotation.from_quat([one[o]["orientation"], two[o]["orientation"]]) for o in objects]
    angles = [(turn[0].inv() * turn[1]).magnitude() for turn in turns]
    return float(max(distances)), float(max(angles))
