"""`em.stack_robustness`: what a stack can take, and which of its bodies is the weakest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin import CriticalValue, Plan, Problem, Scene, regions, scenes
from energymargin.base import checks
from energymargin.base.aliases import Floats
from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn
from energymargin.base.table_text import csv_text
from energymargin.disturbances import Uniform
from energymargin.executors import Executor
from energymargin.placing import boxes
from energymargin.placing.boxes import Asked, center_of, frame_of, movable, up_of
from energymargin.placing.pushes import Push, Pushes
from energymargin.placing.settling import settle
from energymargin.summary import Summarized

SUPPORT = {"tilt": ("rad", np.pi / 3), "acceleration": ("m/s^2", 15.0)}
"""What the support may do: unit, and the most that is asked."""
AZIMUTHS = 8
SPEEDS = (0.1, 10.0)  # of a plan
FINE, ROUGH = 0.005, 0.05  # of the range
QUIET = 16  # draws of a value without knocks
HOLD = 0.3  # s, of a knock at most


@dataclass(frozen=True, eq=False, repr=False)
class StackRobustness(Summarized):
    """What each body of a stack takes, and how much its support may move."""

    scene: Scene
    state: NDArray[np.float64]
    """The state at rest that was asked about, (n,)."""
    pushes: tuple[Push, ...]
    """The least push of each body, the weakest first."""
    tilt: CriticalValue | None
    """Of the support [rad], in the worst direction; None: it was not asked for."""
    acceleration: CriticalValue | None
    """Of the support [m/s^2], likewise."""
    speed: CriticalValue | None
    """How many times faster the support's plan may be played; None: there was no plan."""
    complete: bool = True
    """False if the timeout or the cancel came first."""

    @property
    def weakest(self) -> Push:
        """The push of the body that falls most easily."""
        return self.pushes[0]

    def __getitem__(self, body: str) -> Push:
        """The least push of a body; KeyError if it has none."""
        return checks.by_name(body, {push.body: push for push in self.pushes}, "body that is asked")

    def to_csv(self) -> str:
        """A line for each body, in full precision."""
        rows = [(p.body, p.effort, p.way, *p.direction, " ".join(p.takes)) for p in self.pushes]
        return csv_text(("body", "effort", "way", "x", "y", "z", "takes"), rows)


def stack_robustness(
    scene: Scene,
    state: ArrayLike | None = None,
    *,
    bodies: Sequence[str] | None = None,
    support: Sequence[str] = ("tilt", "acceleration"),
    plan: Plan | None = None,
    radius: float = 0.02,
    angle: float = 0.35,
    knock: float = 0.0,
    horizon: float = 2.0,
    probability: float = 0.95,
    seed: int = 0,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: em.Cancel | None = None,
) -> StackRobustness:
    """Which body of a stack falls most easily, whom it takes along, what the support may do.

    Args:
        scene: the bodies. Those with the role "object" are asked about.
        state: at rest, as of `em.settle`, shape (n,); None: as the scene has it.
        bodies: those that are pushed, by name; None: all objects that hang on no joint.
        support: "tilt", "acceleration", or both: how much of it, in the worst of eight directions
            and of those across the edges on which objects stand, until an object leaves its place.
            () asks for neither.
        plan: of the support, a kinematic body, as a tray that is carried: how many times faster
            may it be played? There the places are those on the support.
        radius: within which, along each axis, the centre of mass of each object stays [m].
        angle: by which it may lean [rad].
        knock: random forces on the objects meanwhile, as a share of their mean weight.
        horizon: for how long the support leans or accelerates [s]. What slides may go beyond its
            friction by 2 radius / horizon^2 until then.
        probability: with which all objects stay, up to the critical value.
        seed: of the knocks.
        threads: None takes all cores. Nothing depends on them.
        executor: in place of threads, of `em.executors`.
        progress: progress(done, total) counts bodies and motions of the support.
        timeout: after so many seconds what is known counts.
        cancel: the same once it is set.

    A push is a kick about an edge on which a body stands, or along it, of the body alone or with
    all that it carries. Its effort is the least energy found of one that makes the body fall: an
    upper bound, and exact for a body that topples alone. To lean and to accelerate act as a
    constant force on each body.

    Raises ValueError on bad arguments and a scene without objects, TimeoutError or Cancelled if
    nothing is known.
    """
    limit = Limit(timeout, cancel)
    up_of(scene)
    objects = [body.name for body in scene.bodies if body.role == "object"]
    if not objects:
        raise ValueError("scene has no object, expected role='object' of those that may fall")
    for name in checks.names_of("support", support):
        checks.one_of("support", name, tuple(SUPPORT))
    start = np.array(scene.pack() if state is None else state, float)
    boxes.require_contacts(scene, "stack_robustness is asked")
    pushing = Pushes(scene, start, limit)
    free = [body for body in objects if body in pushing.names]
    asked = free if bodies is None else list(checks.names_of("bodies", bodies))
    for body in asked:
        checks.one_of("bodies", body, pushing.names)
    place = checks.positive_number("radius", radius), checks.positive_number("angle", angle)
    checks.not_negative_number("knock", knock)
    checks.positive_number("horizon", horizon)
    checks.open_share("probability", probability)
    options: Any = {"probability": probability, "threads": threads, "executor": executor}
    options["seed"] = checks.seed_number(seed)
    _check_rest(scene, start, limit)
    ways = np.concatenate([np.zeros((0, 3)), *map(pushing.ways, free)])
    asking = _Support(scene, start, ways, horizon, place, knock, options, limit)
    carrier, done = carrier_of(scene, plan), list[Any]()
    questions: list[Callable[[], Any]] = [partial(pushing.least, body) for body in asked]
    questions += [partial(asking.most, name) for name in support]
    questions += [] if plan is None else [partial(asking.fastest, plan, carrier)]
    try:
        for question in questions:
            done.append(question())
            if progress is not None:
                progress(len(done), len(questions))
    except (TimeoutError, em.Cancelled):
        if not done:
            raise
    pushes = tuple(sorted(done[: len(asked)], key=lambda push: push.effort))
    found = dict(zip([*support, "speed"], done[len(asked) :], strict=False))
    tilt, acceleration, speed = (found.get(name) for name in (*SUPPORT, "speed"))
    whole = len(done) == len(questions) and all(one.complete for one in found.values())
    return StackRobustness(scene, start, pushes, tilt, acceleration, speed, whole)


def _check_rest(scene: Scene, start: Floats, limit: Limit) -> None:
    """Warns of bodies that move by themselves."""
    moves = settle(scene, start, time=1.0, **limit.rest())
    gone = ", ".join(body.name for body in moves.bodies if np.isfinite(body.moved_at))
    if gone:
        told = f"state is not at rest: {gone} moves by itself. Ask from em.settle(...).state."
        warn([("state", told)], None)


@dataclass(frozen=True, eq=False)
class _Support:
    """Problems in which the support leans or accelerates."""

    scene: Scene
    state: Floats
    ways: Floats
    """Horizontal directions in which it moves, beside eight even ones, (N, 3)."""
    horizon: float
    place: tuple[float, float]
    knock: float
    options: dict[str, Any]
    limit: Limit

    def most(self, name: str) -> CriticalValue:
        """The critical value of the worst direction."""
        unit, most = SUPPORT[name]
        angles = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
        even = np.stack([np.cos(angles), np.sin(angles)], axis=1) @ frame_of(self.scene)[:2]
        worst, least = even[0], most
        for way in (*even, *np.unique(np.round(self.ways, 6), axis=0)):
            low, high = 0.0, least * (1.0 - FINE)
            if self._holds(name, way, high):
                continue
            while high - low > ROUGH * FINE * most:
                middle = 0.5 * (low + high)
                low, high = (middle, high) if self._holds(name, way, middle) else (low, middle)
            worst, least = way, high
        problem_of = partial(self._problem, name, worst)
        return em.critical_value(problem_of, name, (0.0, most), unit=unit, **self._asked())

    def fastest(self, plan: Plan, carrier: str | None) -> CriticalValue:
        """How many times faster a plan of the support may be played."""
        problem = self._asks(plan, plan.duration, carrier)
        return em.critical_values(problem, {"speed": SPEEDS}, **self._asked())[0]

    def _asked(self) -> dict[str, Any]:
        alike = {} if self.knock else {"draws": QUIET, "probability": 0.5}  # as all draws are
        return {**self.options, **self.limit.rest(), "disturbance": Uniform(self.knock), **alike}

    def _holds(self, name: str, way: Floats, value: float) -> bool:
        problem = self._problem(name, way, value)
        asked: dict[str, Any] = {"rollouts": 1, "disturbance": Uniform(0.0), "undisturbed": False}
        found = em.capture_probability(problem, threads=1, **asked, **self.limit.rest())
        return found.captured > 0.5

    def _problem(self, name: str, way: Floats, value: float) -> Problem:
        """Each body of mass m feels m times the change of gravity, in the support's frame."""
        change = value * way
        if name == "tilt":
            gravity = float(np.linalg.norm(self.scene.gravity))
            change = gravity * (np.sin(value) * way + (1.0 - np.cos(value)) * up_of(self.scene))
        masses = {body.name: body.mass for body in self.scene.bodies}
        way = np.append(change, np.zeros(3))[None]
        rows = {body: masses[body] * way for body in movable(self.scene)}
        return self._asks(Plan(self.horizon, wrenches=rows), self.horizon, None)

    def _asks(self, plan: Plan, horizon: float, carrier: str | None) -> Problem:
        there, places = (self.scene, self.state), Places(*self.place, carrier)
        return staying(there, (*there, plan, horizon), places, min(HOLD, horizon))


class Places(NamedTuple):
    """Where each object is to stay."""

    radius: float
    """Of the centre of mass along each axis [m]."""
    angle: float
    """By which it may lean [rad]."""
    carrier: str | None
    """The body that carries the objects, from which they are seen."""
    above: Mapping[str, float] = {}
    """By object, how much farther up it may be [m]."""

    def of(self, scene: Scene, state: Floats, body: Any) -> regions.Region:
        """The states in which a body stays where it is in this one."""
        frame, there = frame_of(scene), scene.unpack(state)[body.name]
        center, up = center_of(body, there), frame[2]
        own_up = Rotation.from_quat(there["orientation"]).inv().apply(up)
        if self.carrier is not None:
            position, orientation = scenes.body_poses(scene, state)[self.carrier]
            back = Rotation.from_quat(orientation).inv()
            frame, center, up = back.apply(frame), back.apply(center - position), back.apply(up)
        region = regions.Tilt(body.name, own_up, up, self.angle, self.carrier)
        more = (0.0, 0.0, self.above.get(body.name, 0.0), 0.0, 0.0, 0.0)
        for axis, further in zip((*frame, *-frame), more, strict=True):
            reach = float(axis @ center) + self.radius + further
            half = (body.name, axis, reach, self.carrier)
            region &= regions.HalfSpace(*half, point="center_of_mass")
        return region


def staying(meant: tuple[Scene, Floats], asked: Asked, places: Places, hold: float) -> Problem:
    """Do all objects stay in their places, from a scene and a state on, for a plan and a horizon?

    Their places are about where they are in the state that is `meant`, whose scene may be without
    the hand. `hold`: how long one draw of the disturbance acts [s].
    """
    scene, state, plan, horizon = asked
    bodies = [body for body in meant[0].bodies if body.role == "object"]
    gravity = float(np.linalg.norm(meant[0].gravity))
    weight = gravity * float(np.mean([body.mass for body in bodies]))
    free = np.min([body.linear_factor for body in bodies], axis=0) > 0  # axes that none has locked
    sets: Any = {"captured": {one.name: places.of(*meant, one) for one in bodies}}
    bounds: Any = {"force": np.where(free, weight, 0.0), "torque": (0.0,) * 3}
    return Problem(scene, state, **sets, **bounds, duration=hold, horizon=horizon, plan=plan)


def carrier_of(scene: Scene, plan: Plan | None) -> str | None:
    """The body that a plan moves; ValueError unless it is one, a kinematic one."""
    if plan is None:
        return None
    moved = sorted(plan.velocities)
    kinematic = [body.name for body in scene.bodies if body.kinematic]
    if len(moved) != 1 or moved[0] not in kinematic:
        there = f"the support: {', '.join(kinematic) or 'the scene has none'}"
        expected = f"expected velocities of one kinematic body, {there}"
        raise ValueError(f"plan moves {', '.join(moved) or 'nothing'}, {expected}")
    return str(moved[0])
