"""Trials of a grasp: the hand closes, then it goes through the motions of a protocol.

Trial k of each grasp has draw k of what is not known, and disturbance k. `em.grasps.grip`: a hand
that has closed on an object, to be put into a scene.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, islice, pairwise, product, repeat
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin import Cancel, Cancelled, Plan, Problem, Scene, World, regions
from energymargin.base.aliases import Floats
from energymargin.base.checks import numbers_of
from energymargin.base.plausibility import kept_warnings
from energymargin.base.reprs import Record
from energymargin.disturbances import Disturbance, Uniform
from energymargin.grasps import outcomes
from energymargin.grasps.belief import GraspBelief, GraspDraw
from energymargin.grasps.grasp_object import GraspObject
from energymargin.grasps.grasp_set import GraspSet
from energymargin.grasps.hands import Fitted, Hand, preset
from energymargin.grasps.outcomes import NO_GRIP, Closed, Grasp, HandStart, Outcome, State
from energymargin.grasps.protocols import GRAVITY, Protocol, protocol_of
from energymargin.regions import Region
from energymargin.scenes import body_poses, pose

STEP = 1 / 960  # s; at a longer one a grip at its limit slips in whole steps, and holds too much
TOUCHING = 1e-3  # m; the gap between a finger and an object that it touches
DEEP = 1e-3  # m; an overlap that is not one of rounding
REDRAWS = 20  # poses that are drawn for one trial
BACK = 2e-3  # m; of each step back along the approach
FARTHEST_BACK = 0.04  # m
APPROACH = 0.1  # m/s
BUMP = 40.0  # N; an arm that meets more on its way stops
LOOK = 0.01  # s, between two looks at what it meets; an impact is over by the second
LARGEST = 2.0  # m; what a hand grips
FAR = 1.5  # sizes of the object
REACH = 0.1  # m
MOST_SCENES = 100  # that are kept
LEVER = 0.01  # m; a torque is a force at this distance

COLLIDING = ("lost", "redraw", "retreat")
COUNTS = ("steps", "unconverged", "lost_time")  # of simulations and of an Outcome


@dataclass(frozen=True)
class GraspTrials:
    """What all trials of the grasps of one object have in common."""

    hand: Hand
    object: GraspObject
    protocol: Protocol
    belief: GraspBelief = field(default_factory=GraspBelief)
    disturbance: Disturbance = field(default_factory=Uniform)
    colliding: str = "lost"
    seed: int = 0
    step: float = STEP
    """Of the simulation [s]."""

    def __getstate__(self) -> dict[str, Any]:
        """All but the scenes that were built."""
        return {name: one for name, one in vars(self).items() if name != "_scenes"}

    def draw(self, number: int) -> GraspDraw:
        """Draw `number` of what is not known, but for the pose; -1: what is believed most."""
        likely = {"friction": self.object.friction, "mass": self.object.mass}
        likely["force"] = self.hand.force
        if number < 0:
            return GraspDraw(number, **likely)
        return self.belief.draw(number, self.seed, **likely)

    def outcomes(
        self, grasp: Grasp, numbers: Sequence[int], cancel: Cancel | None = None
    ) -> list[Outcome]:
        """Some trials of a grasp, whose numbers rise. Where nothing is unknown the hand closes once
        for all that follow each other."""
        spans: Iterable[range] = (range(k, k + 1) for k in numbers)
        if not self.belief and isinstance(numbers, range):  # of any length
            spans = [numbers]
        elif not self.belief:
            parts = np.split(numbers, np.flatnonzero(np.diff(numbers) != 1) + 1)
            spans = [range(int(part[0]), int(part[-1]) + 1) for part in parts]
        return [one for span in spans for one in self._run(grasp, span, cancel)]

    def run(self, grasp: Grasp, number: int, cancel: Cancel | None = None) -> Outcome:
        """Trial `number` of a grasp; -1: with nothing unknown, and without a disturbance.

        Raises Cancelled if it is stopped before its end.
        """
        return self._run(grasp, range(number, number + 1), cancel)[0]

    def _run(self, grasp: Grasp, numbers: range, cancel: Cancel | None) -> list[Outcome]:
        """Trials of one draw; the first has the counts of all."""
        if cancel is not None and cancel.is_set:
            raise Cancelled("cancelled before a trial")
        draw = self.draw(numbers[0])
        closed = self.grip(grasp, draw, cancel)
        first = closed.outcome
        other = first._replace(steps=0, unconverged=0, lost_time=0.0)
        if first.ending:
            return [first] + [other] * (len(numbers) - 1)
        problem = self.problem(closed, draw)
        found = self._rollouts(problem, numbers, cancel)
        times, later = found.exit_times, found.exit_times
        if self.protocol.angle is not None and np.isfinite(times).any():
            alone = problem.replace(captured=self._place(closed))
            later = self._rollouts(alone, numbers, cancel).exit_times
        sums = {name: getattr(first, name) + getattr(found, name) for name in COUNTS}
        first = first._replace(**sums)
        endings = map(_ending, times.tolist(), later.tolist())
        ended = zip(chain([first], repeat(other)), endings, times.tolist(), strict=False)
        return [one._replace(ending=ending, time=time) for one, ending, time in ended]

    def likely_problem(self, grasp: Grasp, cancel: Cancel | None = None) -> Problem:
        """The problem of a grasp with what is believed most.

        Raises ValueError if the hand does not close on the object.
        """
        problem, why = self.likely(grasp, cancel)
        if problem is None:
            raise ValueError(f"number is {grasp.number}, a grasp whose hand {why}")
        return problem

    def likely(self, grasp: Grasp, cancel: Cancel | None = None) -> tuple[Problem | None, str]:
        """The problem of a grasp with what is believed most, or why the hand does not close."""
        draw = self.draw(-1)
        closed = self.grip(grasp, draw, cancel)
        if closed.ending:
            return None, NO_GRIP[closed.ending]
        with kept_warnings():  # the half turn of a hand from above is meant
            return self.problem(closed, draw), ""

    def open_problem(self, grasp: Grasp) -> Problem:
        """The open hand where the grasp says, to be seen: it passes through whatever is there."""
        draw = self.draw(-1)
        scene, hand = self._built(grasp.opening, draw.force, gravity=False)
        for one, other in product(hand.bodies, (body.name for body in scene.bodies)):
            if other not in hand.bodies:
                scene.disable_collisions(one, other)
        closed = self.closed(scene, hand, self.open_state(grasp, draw), "not gripped")
        place = regions.Ball("object", closed.thing[:3, 3], self.protocol.radius, hand.base)
        weight = (draw.mass * GRAVITY,) * 3
        bounds: Any = {"force": weight, "torque": weight, "duration": self.protocol.duration}
        return Problem(scene, closed.state, captured=place, **bounds)

    def check(self, grasps: GraspSet) -> None:
        """Raises ValueError if numbers do not go together: units, openings, a frame elsewhere."""
        wide = float(np.nanmax(grasps.openings, initial=0.0))
        self.scene(wide or np.nan, self.draw(-1), gravity=False)
        self.scene(np.nan, self.draw(0), gravity=False)
        size = float(np.ptp(self.object.corners, axis=0).max())
        way = "mesh in mm needs scale=0.001"
        if size > LARGEST:
            raise ValueError(
                f"object is {size:.3g} m large, expected at most {LARGEST:g} m: a {way}"
            )
        center = np.append(self.object.center, 1.0)
        away = np.linalg.norm((np.linalg.inv(grasps.poses) @ center)[:, :3], axis=1)
        if (far := float(np.median(away))) > FAR * size + REACH:
            said = f"grasps are {far:.3g} m from the object's centre of mass in the median"
            large = f"and the object is {size:.3g} m large: poses in another frame or unit? A"
            world = "poses in a world's frame need object= of em.grasps.read"
            raise ValueError(f"{said}, {large} {way}; {world}")

    def start(self, grasp: Grasp, draw: GraspDraw, deep: float = DEEP) -> HandStart:
        """Where the hand begins to close, by a draw of its pose, at most so `deep` in anything."""
        scene, hand = self.scene(grasp.opening, draw, gravity=False)
        world = World(scene)
        placed = self._placed(grasp)
        away = outcomes.stepped_back(self.protocol.approach)
        known = draw.number < 0 or self.belief.pose is None
        errors = [np.zeros(6)] if known else self.belief.poses(draw.number, self.seed)
        best, deepest, redrawn = placed, np.inf, -1
        for error in islice(errors, REDRAWS if self.colliding == "redraw" else 1):
            redrawn += 1
            pose = placed @ self._with_error(grasp.pose, error) @ away
            state = outcomes.state_of(scene, hand, pose, placed)
            depth = -outcomes.clearance(world, hand, state)
            if depth <= deep:
                return HandStart(outcomes.above_table(world, hand, state), redrawn)
            if depth < deepest:
                best, deepest = pose, depth
        back = 0.0
        while self.colliding != "lost" and back < FARTHEST_BACK:
            back += BACK
            state = outcomes.state_of(scene, hand, best @ outcomes.stepped_back(back), placed)
            if -outcomes.clearance(world, hand, state) <= deep:
                return HandStart(outcomes.above_table(world, hand, state), redrawn, back)
        return HandStart(None, redrawn)

    def open_state(self, grasp: Grasp, draw: GraspDraw) -> State:
        """The open hand where the grasp says, whatever is there."""
        scene, hand = self.scene(grasp.opening, draw, gravity=False)
        placed = self._placed(grasp)
        return outcomes.state_of(scene, hand, placed @ grasp.pose, placed)

    def grip(self, grasp: Grasp, draw: GraspDraw, cancel: Cancel | None = None) -> Closed:
        """The hand after it has closed where a draw of the pose puts it."""
        start = self.start(grasp, draw)
        if start.state is None:
            scene, hand = self.scene(grasp.opening, draw, gravity=False)
            closed = self.closed(scene, hand, self.open_state(grasp, draw), "collided")
        else:
            closed = self.close(grasp.opening, start.state, draw, cancel)
        outcome = closed.outcome._replace(redrawn=start.redrawn, back=start.back)
        return closed._replace(outcome=outcome)

    def close(
        self, opening: float, start: State, draw: GraspDraw, cancel: Cancel | None = None
    ) -> Closed:
        """The hand after it has closed."""
        scene, hand = self.scene(opening, draw, gravity=self.protocol.gravity == "always")
        rows = max(2, round(self.hand.closing / self.step))
        coming = round(self.protocol.approach / APPROACH / self.step)
        ways = dict[str, NDArray[np.float64]]()
        for name, ends in hand.targets.items():
            ways[name] = np.r_[np.full(coming, ends[0]), np.linspace(*ends, rows)]
        moves = np.zeros((coming + rows, 6))
        moves[:coming, :3] = APPROACH * outcomes.approach_of(scene, hand, start)
        world = World(scene, Plan(step=self.step, targets=ways, velocities={hand.base: moves}))
        steps = coming + rows + round(self.protocol.settle / self.step)
        looks = range(1, coming + 1, max(1, round(LOOK / self.step)))
        try:
            done = world.simulate(start, steps=steps, record=[*looks, steps], cancel=cancel)
        except Cancelled:
            raise
        except RuntimeError:  # what a simulation raises once its numbers are not finite
            return self.closed(scene, hand, start, "diverged")
        state = done.states[-1]
        pairs = [{c.body_a, c.body_b} for c in done.contacts[-1] if c.normal_force > 0]
        pressed = set[str]().union(*(pair for pair in pairs if "object" in pair))
        met = [outcomes.hand_force(contacts, hand) > BUMP for contacts in done.contacts[:-1]]
        ending = self.ending(world, hand, state, pressed)
        if any(one and other for one, other in pairwise(met)):
            ending = "collided"
        outcome = Outcome(ending, **{name: getattr(done, name) for name in COUNTS})
        return self.closed(scene, hand, state, ending)._replace(outcome=outcome)

    def ending(self, world: World, hand: Fitted, state: State, pressed: set[str]) -> str:
        """That of a hand which has closed, as of Closed: `pressed` are what touches the object."""
        if not pressed >= set(hand.fingers):
            return "not gripped"
        return "collided" if outcomes.is_sunk(world, hand, state) else ""

    def closed(self, scene: Scene, hand: Fitted, state: State, ending: str) -> Closed:
        """A state of a scene as that of a hand that has closed."""
        bodies = scene.unpack(state)
        places = (bodies[name] for name in (hand.base, "object"))
        base, thing = (pose(place["position"], place["orientation"]) for place in places)
        thing[:3, 3] += thing[:3, :3] @ self.object.center
        return Closed(hand, state, base, np.linalg.inv(base) @ thing, Outcome(ending))

    def problem(self, closed: Closed, draw: GraspDraw) -> Problem:
        """Whether a closed grasp holds through the protocol."""
        protocol, hand = self.protocol, closed.hand
        scene, _ = self.scene(np.nan, draw, gravity=protocol.gravity != "never")
        rows = protocol.rows(closed.base[:3, :3] @ hand.frame[:3, :3], self.step)
        shares = protocol.shares(self.step)
        kept = {name: shut + shares * (wide - shut) for name, (wide, shut) in hand.targets.items()}
        captured, angle, base = self._place(closed), protocol.angle, hand.base
        if angle is not None:
            ways = [(e, closed.thing[:3, :3] @ e) for e in np.eye(3)[[0, 2]]]
            tilts = [regions.Tilt("object", own, there, angle, base) for own, there in ways]
            captured = captured & (tilts[0] & tilts[1])
        weight = draw.mass * GRAVITY
        plan = Plan(step=self.step, targets=kept, velocities={hand.base: rows})
        bounds: Any = {"force": (protocol.force * weight,) * 3}
        bounds["torque"] = (protocol.torque * weight * LEVER,) * 3
        times: Any = {"duration": protocol.duration, "dwell": protocol.dwell}
        return Problem(scene, closed.state, captured=captured, plan=plan, **bounds, **times)

    def scene(self, opening: float, draw: GraspDraw, *, gravity: bool) -> tuple[Scene, Fitted]:
        """The hand at the world's origin and the object at its own; with a table at height 0."""
        key = (None if np.isnan(opening) else opening, draw.force, gravity)
        found = self._scenes.get(key)
        if found is None:
            if len(self._scenes) >= MOST_SCENES:
                self._scenes.clear()
            found = self._scenes[key] = self._built(opening, draw.force, gravity)
        scene, hand = found
        if (draw.friction, draw.mass) != (self.object.friction, self.object.mass):
            scene = scene.with_body("object", friction=draw.friction, mass=draw.mass)
        return scene, hand

    @cached_property
    def _scenes(self) -> dict[Any, tuple[Scene, Fitted]]:
        """Some that were built, by opening, force and gravity."""
        return {}

    def _built(self, opening: float, force: float, gravity: bool) -> tuple[Scene, Fitted]:
        down = (0, 0, -GRAVITY if gravity else 0)
        scene = Scene(gravity=down, step=self.step, friction_rule=self.hand.friction_rule)
        hand = self.hand.add_to(scene, force=force, opening=opening)
        thing = self.object
        known: Any = {"mass": thing.mass, "friction": thing.friction, "inertial": thing.inertial}
        scene.add_body("object", thing.shape, **known, role="object")
        if self.protocol.table:
            scene.add_plane("table", friction=0.5)
        return scene, hand

    def _placed(self, grasp: Grasp) -> Floats:
        """The object's frame in the world's: on the table, if there is one."""
        placed = np.array(grasp.placed, dtype=float)
        if self.protocol.table:
            placed[2, 3] = -float((self.object.corners @ placed[2, :3]).min())
        return placed

    def _with_error(self, pose: Floats, error: NDArray[np.float64]) -> Floats:
        """A grasp's pose with an error, which turns it about the grasp or the centre of mass."""
        around, moved = np.eye(4), np.eye(4)
        moved[:3, 3], moved[:3, :3] = error[:3], Rotation.from_rotvec(error[3:]).as_matrix()
        if self.belief.about == "center_of_mass":
            around[:3, 3] = (np.linalg.inv(pose) @ [*self.object.center, 1.0])[:3]
        return np.asarray(pose @ around @ moved @ np.linalg.inv(around))

    def _place(self, closed: Closed) -> Region:
        """The set in which the object is where it was gripped, in the hand's frame."""
        rules, hand, center = self.protocol, closed.hand, closed.thing[:3, 3]
        at: Any = {"point": "center_of_mass"}
        place: Region = regions.Ball("object", center, rules.radius, hand.base, **at)
        for one in hand.fingers if rules.touching else ():
            place = place & regions.Touching("object", one, gap=TOUCHING)
        return place

    def _rollouts(
        self, problem: Problem, numbers: range, cancel: Cancel | None
    ) -> em.CaptureProbability:
        pushed = self.disturbance if numbers[0] >= 0 else Uniform(0.0)
        which: Any = {"rollouts": len(numbers), "first": max(numbers[0], 0), "seed": self.seed}
        plain: Any = {"undisturbed": False, "most_diverged": 1.0, "warn": False, "threads": 1}
        found = em.capture_probability(problem, disturbance=pushed, cancel=cancel, **which, **plain)
        if not found.complete:
            raise Cancelled("cancelled within the trials of a grasp")
        return found


def _ending(time: float, of_place: float) -> str:
    """How a trial ended: when it left the set, and when its place in the hand alone."""
    if np.isnan(time):
        return "diverged"
    if np.isinf(time):
        return "held"
    return "turned" if of_place > time else "slipped"


@dataclass(frozen=True, eq=False, repr=False)
class Grip(Record):
    """An object in a hand."""

    hand: Hand
    protocol: Protocol
    """What the hand does from now on."""
    base: NDArray[np.float64]
    """The frame of the hand's base in that of the object, (4, 4)."""
    joints: dict[str, float]
    """Where the hand's joints are that move by themselves [m] or [rad]."""


def grip(
    hand: Hand | str,
    object: GraspObject,
    grasp: ArrayLike,
    protocol: Protocol | str = "release",
    *,
    step: float = STEP,
) -> Grip:
    """Closes a hand on an object that floats, and says where its base and its fingers then are.

    Args:
        hand: as of `em.grasps.score`.
        object: what is gripped.
        grasp: the grasp frame in the object's frame, (4, 4).
        protocol: what the hand is to do with it, or a preset.
        step: of the simulation [s].

    Raises ValueError on bad arguments, and if the hand does not close on the object there.
    """
    found = preset(hand) if isinstance(hand, str) else hand
    does = protocol_of(protocol)
    trials = GraspTrials(found, object, does, step=step)
    where = numbers_of("grasp", grasp, "a pose (4, 4) of the hand", (4, 4))
    closed = trials.grip(Grasp(0, where, np.nan, np.eye(4)), trials.draw(-1))
    if closed.ending:
        raise ValueError(f"grasp is one whose hand {NO_GRIP[closed.ending]}")
    scene, _ = trials.scene(np.nan, trials.draw(-1), gravity=False)
    thing = pose(*body_poses(scene, closed.state)["object"])
    moving = [one.name for one in scene.joints if one.type != "fixed" and one.mimic is None]
    there = scene.unpack(closed.state)["joints"]
    joints = {name: float(there[name]["position"]) for name in moving}
    return Grip(found, does, np.linalg.inv(thing) @ closed.base, joints)
