"""Whether what leads out of the capture set here leads out in MuJoCo too, and at what work."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.base.checks import one_of, positive_number
from energymargin.base.reprs import Record
from energymargin.mujoco.simulation import Instant, Simulation, Ticks
from energymargin.mujoco.states import Names, servos

SCALE_STEP = 0.01  # between two strengths of the wrenches
SAME = 1e-6  # [m], [m/s], [rad], ...: data further off are at another state than the problem


@dataclass(frozen=True, eq=False, repr=False)
class Replay(Record):
    """What became of an escape, or of a plan, in MuJoCo."""

    escaped: bool
    """Whether it leads out unchanged."""
    time: float
    """Time of the first look outside, or of the end [s]."""
    effort: float
    """Until then, integral of |f . v + tau . omega| dt [J]."""
    work: float
    """Integral of f . v + tau . omega over the same time [J]."""
    state: Floats
    """State of the scene at that time, shape (n,)."""
    distance: float
    """From the objects' positions here to those in MuJoCo at the end of the path, the most [m]."""
    angle: float
    """Largest angle between an object's orientations here and in MuJoCo at the end [rad]."""
    least_scale: float | None
    """Least multiple of the wrenches, from 1 on, with which it leads out; None if none does."""
    least_effort: float | None
    """The effort with that [J]."""


def replay(
    model: Any,
    data: Any,
    problem: em.Problem,
    escape: em.EscapeEffort | None = None,
    *,
    captured: str = "all",
    largest_scale: float = 1.2,
    cancel: em.Cancel | None = None,
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
    every = one_of("captured", captured, ("all", "any")) == "all"
    region = problem.captured if every else problem.captured_any
    if region is None:
        raise ValueError("captured is 'any', expected 'all' for a problem of one capture set")
    largest = positive_number("largest_scale", largest_scale)
    edges, ours = _undisturbed(problem) if escape is None else _path(escape)
    player = EscapePlayer(problem, region, model, data, cancel)
    _require_same(problem, player.start.state())
    _require_targets(problem, model, data)
    first = played = player.play(edges)
    scale, stronger = 1.0, 0 if escape is None else round((largest - 1.0) / SCALE_STEP)
    for number in range(1, stronger + 1):
        if not played.escaped:
            scale = 1.0 + number * SCALE_STEP
            played = player.play(Edge(scale * wrenches, held) for wrenches, held in edges)
    least = (scale, played.last.effort) if played.escaped else (None, None)
    distance, angle = _apart(problem.scene, first.end, ours)
    return Replay(first.escaped, *first.last, distance, angle, *least)


def _path(escape: em.EscapeEffort) -> tuple[list[Edge], Floats]:
    """Its edges, and the state to which they lead here."""
    if not len(escape.path):
        raise ValueError("escape has no path, expected one that leads out")
    tree = escape.tree
    rows = ((tree.controls[node].reshape(-1, 6), tree.durations[node]) for node in escape.path[1:])
    return [Edge(row, float(duration)) for row, duration in rows], tree.states[escape.path[-1]]


def _undisturbed(problem: em.Problem) -> tuple[list[Edge], Floats]:
    """The whole future, and where it ends here."""
    if problem.horizon is None:
        raise ValueError("escape is None, expected one for a problem without horizon and plan")
    scene, horizon = problem.scene, problem.horizon
    none = np.zeros((sum(body.role == "object" for body in scene.bodies), 6))
    steps = round(horizon / scene.step)
    here = em.World(scene, problem.plan).simulate(problem.state, steps, record=[steps])
    return [Edge(none, horizon)], here.states[-1]


def _require_same(problem: em.Problem, state: Floats) -> None:
    """Raises ValueError unless the data are at the problem's state."""
    found, wanted = problem.scene.unpack(state), problem.scene.unpack(problem.state)
    for name in wanted.keys() - {"joints"}:
        one, two = found[name], wanted[name]
        speeds = [np.abs(one[w] - two[w]).max() for w in ("velocity", "angular_velocity")]
        off = float(max(*_between(one, two), *speeds))
        if off > SAME:
            expected = "expected that state: problem.with_state(...) takes that of the data"
            raise ValueError(f"data has '{name}' off the problem's state by {off:.3g}, {expected}")


def _require_targets(problem: em.Problem, model: Any, data: Any) -> None:
    """Raises ValueError unless the controls ask for the scene's targets, or a plan has others."""
    planned = problem.plan.targets if problem.plan else {}
    for name, servo in servos(Names(problem.scene, model), model).items():
        asked, target = float(data.ctrl[servo.actuator.address]), servo.joint.target
        if name not in planned and abs(asked - servo.control(target)) > SAME:
            raise ValueError(
                f"data has the control {asked:.6g} for joint {name!r}, expected "
                f"{servo.control(target):.6g}, which asks for its target {target:.6g} in the "
                "problem's scene: em.mujoco.set_state(model, data, problem.scene, problem.state) "
                "sets it"
            )


def _apart(scene: em.Scene, state: Floats, other: Floats) -> tuple[float, float]:
    """How far the objects are apart: distance [m] and angle [rad], the most of each."""
    one, two = scene.unpack(state), scene.unpack(other)
    objects = [body.name for body in scene.bodies if body.role == "object"]
    distances, angles = zip(*(_between(one[name], two[name]) for name in objects), strict=True)
    return max(distances), max(angles)


def _between(one: dict[str, Floats], two: dict[str, Floats]) -> tuple[float, float]:
    """Distance [m] and angle [rad] between two poses of a body."""
    turn = Rotation.from_quat([one["orientation"], two["orientation"]])
    distance = np.linalg.norm(one["position"] - two["position"])
    return float(distance), float((turn[0].inv() * turn[1]).magnitude())


ALMOST = 1e-6  # of the time between two looks: so close to one, it is that one
CHECK = 1 / 60  # s between two looks, where a problem with a clock does not say


class Edge(NamedTuple):
    """Wrenches that are held for a while."""

    wrenches: Floats
    """On the k objects, shape (k, 6) [N, N m]."""
    duration: float
    """[s]."""


class Played(NamedTuple):
    """What became of the edges."""

    escaped: bool
    last: Instant
    """The exit, or the end."""
    end: Floats
    """State at the end of the edges, shape (n,)."""


class EscapePlayer:
    """Plays edges from the state of some data, as the search for an escape does.

    Without a clock a look at the capture set follows each step of the scene, and after the edges
    the objects go on without a wrench for as long as a longest edge. With a clock the robot follows
    its plan, a look follows each `check`, and all ends at the horizon. There an exit counts if,
    without a wrench from then on, all looks are outside until `dwell` is over. Each look, and each
    end of an edge, is at the step of MuJoCo that is nearest to its time.
    """

    def __init__(
        self,
        problem: em.Problem,
        captured: em.regions.Region,
        model: Any,
        data: Any,
        cancel: em.Cancel | None = None,
    ) -> None:
        """`captured`: the set that is left. Raises ValueError as `Simulation`."""
        self._cancel = cancel
        self._problem, self._captured, self._scene = problem, captured, problem.scene
        self.start = Simulation(self._scene, model, data, problem.plan)
        """At the state of the data."""
        self._timestep = float(model.opt.timestep)
        self._none = np.zeros((len(self.start.objects), 6))
        step = self._scene.step
        if problem.horizon is not None:
            step *= max(1, round((problem.check or CHECK) / step))
        self._between_looks = step
        self._looks = Ticks(step, self._timestep)

    def play(self, edges: Iterable[Edge]) -> Played:
        """Raises RuntimeError if MuJoCo diverges, Cancelled once `cancel` is set."""
        simulation, until, horizon = self.start.branch(), 0.0, self._problem.horizon
        first = self._exit(simulation)
        for edge in edges:
            until = min(until + edge.duration, math.inf if horizon is None else horizon)
            self._begin_edge(simulation, edge.wrenches)
            while self._go_to_look(simulation, until):
                first = first or self._exit(simulation)
        end = simulation.state()
        over = until + self._problem.duration if horizon is None else horizon
        self._begin_edge(simulation, self._none)
        while first is None and self._go_to_look(simulation, over):
            first = self._exit(simulation)
        return Played(first is not None, first or simulation.instant, end)

    def _go_to_look(self, simulation: Simulation, until: float) -> bool:
        """To the next look, or to a time [s]; False if it is there already."""
        if self._cancel and self._cancel.is_set:
            raise em.Cancelled("cancelled while an escape was played in MuJoCo")
        last = round(until / self._timestep)
        steps = min(self._looks.next(simulation.steps), last) - simulation.steps
        simulation.advance(steps)
        return steps > 0

    def _begin_edge(self, simulation: Simulation, wrenches: Floats) -> None:
        simulation.push(wrenches)
        if self._problem.effector == "drive":
            simulation.put(self._problem.edge_start(simulation.state()))

    def _exit(self, simulation: Simulation) -> Instant | None:
        """This instant, if it is one."""
        exits = self._outside(simulation) and self._stays_outside(simulation.branch())
        return simulation.instant if exits else None

    def _outside(self, simulation: Simulation) -> bool:
        """Whether this is a look, and outside."""
        look = self._is_look(simulation)
        return look and not self._captured.contains(self._scene, simulation.state())

    def _is_look(self, simulation: Simulation) -> bool:
        steps, looks, horizon = simulation.steps, self._looks, self._problem.horizon
        at_end = horizon is not None and steps == round(horizon / self._timestep)
        return at_end or steps == looks.step(looks.last(steps))

    def _stays_outside(self, simulation: Simulation) -> bool:
        horizon, between = self._problem.horizon, self._between_looks
        if horizon is None:
            return True
        dwell = math.ceil(self._problem.dwell / between - ALMOST)  # looks
        until = min((self._looks.last(simulation.steps) + dwell) * between, horizon)
        self._begin_edge(simulation, self._none)
        while self._go_to_look(simulation, until):
            if self._is_look(simulation) and not self._outside(simulation):
                return False
        return True
