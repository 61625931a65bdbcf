"""`em.settle`: is this at rest? What moves, how far, when, and where it ends.

`Drops` let a body fall on a plane, and say how it comes to lie.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from energymargin import Cancel, Cancelled, Inertial, Scene, World, scenes
from energymargin.base.aliases import Floats
from energymargin.base.checks import by_name, positive_number, require
from energymargin.base.limits import Limit
from energymargin.base.plausibility import kept_warnings
from energymargin.base.table_text import csv_text
from energymargin.placing import boxes
from energymargin.placing.boxes import Boxes, farthest, movable, up_of
from energymargin.summary import Summarized

LOOKS = 10  # within the time for which nothing may move
DEEP = 1e-4  # m; overlaps that are told
GAIN, FAINT = 2.1, 1e-6  # ways of a body that begins to fall: of a window and its first half; m
GRAVITY = 9.81  # m/s^2
ROCKING = 2e-3  # of the reach; a body that moves less within REST is at rest after a drop
REST, LONGEST = 0.15, 5.0  # s


@dataclass(frozen=True)
class RestingBody:
    """What became of a body."""

    name: str
    distance: float
    """Of the point that is farthest from where it was, at the end [m]."""
    turned: float
    """Angle between the start and the end [rad]."""
    dropped: float
    """How far its centre is lower [m]."""
    moved_at: float
    """When a point of it was farther than the tolerance for the first time [s]; inf: never."""
    rest_at: float
    """When it came to rest [s]; inf: not within the time."""
    out: bool
    """Whether it fell below all that there is."""
    on: tuple[str, ...]
    """What it touches in the end."""

    @property
    def verdict(self) -> str:
        """One of "stays", "moved", "never at rest", "fell out"."""
        if self.out or np.isinf(self.rest_at):
            return "fell out" if self.out else "never at rest"
        return "stays" if np.isinf(self.moved_at) else "moved"


@dataclass(frozen=True, eq=False, repr=False)
class Settled(Summarized):
    """How a scene came to rest."""

    scene: Scene
    start: NDArray[np.float64]
    """The state that was asked about, (n,)."""
    state: NDArray[np.float64]
    """The state at the end, (n,)."""
    bodies: tuple[RestingBody, ...]
    """Those that forces move, in the order of the scene."""
    overlaps: tuple[tuple[str, str, float], ...]
    """Bodies that overlap at the start, and how deep they do [m]."""
    tolerance: float
    """A body has moved if a point of it is farther from where it was [m]."""
    time: float
    """That was simulated [s]."""
    steps: int
    """Simulation steps."""
    unconverged: int
    """Of these, steps whose contact solver did not converge."""
    complete: bool = True
    """False if the timeout or the cancel came first."""

    @property
    def stays(self) -> bool:
        """Whether the start is at rest: no body has moved, nor is one moving."""
        return all(body.verdict == "stays" for body in self.bodies)

    @property
    def at_rest(self) -> bool:
        """Whether the end is at rest."""
        return all(np.isfinite(body.rest_at) and not body.out for body in self.bodies)

    @property
    def moved(self) -> tuple[str, ...]:
        """Names of the bodies that do not stay, the farthest first."""
        gone = [body for body in self.bodies if body.verdict != "stays"]
        return tuple(body.name for body in sorted(gone, key=lambda body: -body.distance))

    def __getitem__(self, name: str) -> RestingBody:
        """A body by its name; KeyError if there is none that moves."""
        return by_name(name, {body.name: body for body in self.bodies}, "body that moves")

    def to_csv(self) -> str:
        """A line for each body, in full precision."""
        names = ("name", "verdict", "distance", "turned", "dropped", "moved_at", "rest_at")
        rows = [[*(getattr(b, name) for name in names), " ".join(b.on)] for b in self.bodies]
        return csv_text((*names, "on"), rows)


def settle(
    scene: Scene,
    state: ArrayLike | None = None,
    *,
    time: float = 10.0,
    still: float = 1e-4,
    during: float = 0.25,
    tolerance: float = 1e-3,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Settled:
    """Let a scene come to rest, and say what moved.

    It ends as soon as no point of any body has moved by more than `still` for the time `during`,
    and none gets faster, as a body does that begins to topple.
    Joints keep their drives; bodies that are fixed or kinematic do not count, nor does what has
    fallen out of the scene.

    Args:
        scene: the bodies, under gravity.
        state: where they are, shape (n,); None: where the scene has them.
        time: after which it ends at the latest [s].
        still: the most by which a point of a body at rest may move [m].
        during: the time for which it may not [s].
        tolerance: a body has moved if a point of it is farther from where it was [m].
        progress: progress(done, total) counts simulation steps; it may need fewer than the total.
        timeout: after so many seconds the state of then counts.
        cancel: the same once it is set.

    Raises ValueError on bad arguments, without gravity or a body that can move, TimeoutError or
    Cancelled if nothing was simulated, and DivergedError.
    """
    limit = Limit(timeout, cancel)
    asked = {"tolerance": tolerance, "time": time, "still": still, "during": during}
    for name, value in asked.items():
        positive_number(name, value)
    require(time >= during, "time", time, f"at least during, {during:g}")
    up_of(scene)
    boxes.require_contacts(scene, "settle is asked")
    if not movable(scene):
        raise ValueError("scene has no body that can move: is its base meant to be free?")
    start = np.array(scene.pack() if state is None else state, float)
    settling = _Settling(scene, start, still, tolerance)
    every = max(round(during / LOOKS / scene.step), 1)
    most, rows = max(round(time / scene.step), 1), every * LOOKS
    while settling.steps < most and not settling.is_still(during):
        left = min(rows, most - settling.steps)
        if not settling.advance(left, sorted({*range(every, left, every), left}), limit):
            break
        if progress is not None:
            progress(settling.steps, most)
    return settling.result(during, limit)


class _Settling:
    """A simulation that is watched. A body is at rest since its anchor, a time and a place: once it
    is farther from there than `still`, it gets another."""

    def __init__(self, scene: Scene, start: Floats, still: float, tolerance: float) -> None:
        self._world, self._scene, self._start = World(scene), scene, start
        self._names = movable(scene)
        self._boxes, self._still, self._tolerance = Boxes(scene, self._names), still, tolerance
        self._bottom = boxes.lowest(scene, start)
        moving = [body.name for body in scene.bodies if body.kinematic]  # as a lift, which descends
        self._carriers = Boxes(scene, moving)
        self._first = self._anchor = self._boxes.at(start)
        self._looks = deque([self._first], maxlen=LOOKS + 1)
        self._up = up_of(scene)
        count = len(self._names)
        self._since, self._moved_at = np.zeros(count), np.full(count, np.inf)
        self._out = np.zeros(count, bool)
        self._complete, self._unconverged = True, 0
        self.state, self.steps = start, 0
        deep = [c for c in self._world.contacts(start) if c.distance < -DEEP]
        pairs = {(c.body_a, c.body_b): -c.distance for c in sorted(deep, key=lambda c: -c.distance)}
        self._overlaps = tuple((a, b, depth) for (a, b), depth in pairs.items())

    @property
    def _time(self) -> float:
        return self.steps * self._scene.step

    def is_still(self, during: float) -> bool:
        """Whether each body has been at rest for so long, or is out."""
        return bool((self._rests(during) | self._out).all()) and self.steps > 0

    def _rests(self, during: float) -> NDArray[np.bool_]:
        """Whether each body has been at rest for so long, and has not begun to move."""
        rest = self._time - self._since >= during - self._scene.step / 2
        begun, middle, now = (self._looks[k] for k in (0, len(self._looks) // 2, -1))
        way = farthest(now, begun)
        return rest & ~((way > FAINT) & (way > GAIN * farthest(middle, begun)))

    def advance(self, steps: int, record: list[int], limit: Limit) -> bool:
        """Simulates so many steps; False if the limit came first."""
        try:
            found = self._world.simulate(self.state, steps, record=record, **limit.rest())
        except (RuntimeError, TimeoutError):
            self._complete = False
            if not limit.reached:
                raise
            return False
        begun = self._time
        for after, state in zip(found.times, found.states, strict=True):
            self._look(begun + after, state)
        self.state, self.steps = found.states[-1], self.steps + steps
        self._unconverged += found.unconverged
        return True

    def _look(self, now: float, state: Floats) -> None:
        corners = self._boxes.at(state)
        self._looks.append(corners)
        gone = farthest(corners, self._anchor) > self._still
        self._anchor = np.where(gone[:, None, None], corners, self._anchor)
        self._since[gone] = now
        first = np.isinf(self._moved_at) & (farthest(corners, self._first) > self._tolerance)
        self._moved_at[first] = now
        bottom = (self._carriers.at(state) @ self._up).min(initial=self._bottom)
        self._out |= (corners @ self._up).max(axis=1, initial=-np.inf) < bottom

    def result(self, during: float, limit: Limit) -> Settled:
        if self.steps == 0:
            limit.require("a step was simulated")
        here, there = (scenes.body_poses(self._scene, s) for s in (self._start, self.state))
        corners = self._boxes.at(self.state)
        ways = farthest(corners, self._first)
        touching: dict[str, set[str]] = {name: set() for name in self._names}
        for c in self._world.contacts(self.state):
            for one, other in ((c.body_a, c.body_b), (c.body_b, c.body_a)):
                if one in touching and c.normal_force > 0:
                    touching[one].add(other)
        turned = [angle_between(here[name][1], there[name][1]) for name in self._names]
        dropped = [float(self._up @ way.mean(axis=0)) for way in self._first - corners]
        rest_at = np.where(self._rests(during), self._since, np.inf)
        moved_at, out = self._moved_at.tolist(), self._out.tolist()
        on = [tuple(sorted(touching[name])) for name in self._names]
        columns = (self._names, ways.tolist(), turned, dropped, moved_at, rest_at.tolist(), out, on)
        bodies = [RestingBody(*row) for row in zip(*columns, strict=True)]
        counts = (self._time, self.steps, self._unconverged, self._complete)
        places = (self._start, self.state, tuple(bodies), self._overlaps)
        return Settled(self._scene, *places, self._tolerance, *counts)


def angle_between(one: ArrayLike, other: ArrayLike) -> float:
    """Angle between two orientations, unit quaternions [rad]."""
    return 2.0 * float(np.arccos(min(abs(float(np.dot(one, other))), 1.0)))


@dataclass(frozen=True, eq=False)
class Drops:
    """Drops of a body on a plane, by their numbers."""

    shape: Any
    mass: float
    friction: float
    inertial: Inertial | None
    slope: float
    height: float
    seed: int
    normals: Floats
    """Of its faces, (N, 3)."""
    reach: float
    """From its centre of mass [m]."""

    def ends(self, numbers: Sequence[int], cancel: Cancel) -> list[int]:
        """The face that is down in the end, of each; once it is cancelled, of those that ended."""
        down = GRAVITY * np.array([np.sin(self.slope), 0, -np.cos(self.slope)])
        scene = Scene(down, friction_rule="max")
        scene.add_plane("plane", friction=self.friction)
        body: dict[str, Any] = {"mass": self.mass, "inertial": self.inertial}
        scene.add_body("object", self.shape, friction=self.friction, **body)
        points = np.concatenate(scenes.shape_parts(self.shape))
        rule: dict[str, Any] = {"still": ROCKING * self.reach, "during": REST}
        found = list[int]()
        for number in numbers:
            turn = Rotation.random(random_state=np.random.default_rng([self.seed, number]))
            start = {"position": (0, 0, self.height - turn.apply(points)[:, 2].min())}
            state = scene.pack(object=start | {"orientation": turn.as_quat()})
            try:
                with kept_warnings():  # which each of many drops would repeat
                    end = settle(scene, state, time=LONGEST, **rule, cancel=cancel)
            except Cancelled:
                break
            if not end.complete:
                break
            there = Rotation.from_quat(scene.unpack(end.state)["object"]["orientation"])
            found.append(int(np.argmax(self.normals @ there.inv().apply([0, 0, -1.0]))))
        return found
