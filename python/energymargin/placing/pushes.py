"""The least push that makes a body fall: kicks about each edge that it stands on, and along it.

A kick gives a body, alone or with all that it carries, the velocities of a turn about an edge, or
of a slide. Its energy is the work of the push: an upper bound of the least work. Where a kick
topples bodies with hardly more than m g times the rise of their centre of mass, that is the work.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from energymargin import Scene, World, scenes
from energymargin.base.aliases import Floats
from energymargin.base.limits import Limit
from energymargin.base.plausibility import kept_warnings
from energymargin.placing.boxes import Boxes, center_of, frame_of, movable, moved, up_of
from energymargin.placing.settling import settle

UPWARDS = 0.2  # of a contact's normal, from where on it carries
AROUND = 8  # directions at most
RIM, LEVEL = 0.1, 1e-3  # shares: corners so far beside contacts, and above, are stood on too
CLOSE = 0.01  # relative, of an effort
LOSS = 0.12  # share of a kick that a turn about an edge loses, by steps of finite length; small
# bodies, which fall within fewer steps, lose more
MOST = 2.0**8  # times the work of statics; a push that takes more is none
FALLEN = np.radians(30.0)  # of a tilt
SUNK = 0.1  # of the height of a body
LONGEST, FALLS = 3.0, 20.0  # after a push: s, and times that of a fall of the tallest body
LOCKED = 1e-9  # of a kick's speeds along axes that are locked; more is none


@dataclass(frozen=True)
class Push:
    """The least push found that makes a body fall."""

    body: str
    effort: float
    """Work of the push [J]; inf: none makes it fall; 0: it falls by itself."""
    way: str
    """"topples" or "slides", and with what it carries; "" if none makes it fall; "by itself"."""
    direction: tuple[float, ...]
    """Horizontal unit vector (3,): where it is pushed."""
    takes: tuple[str, ...]
    """Names of the others that fall with it."""


class Kick(NamedTuple):
    """Velocities of bodies at unit speed, for a push."""

    way: str
    direction: Floats
    bodies: tuple[str, ...]
    turn: Floats
    """Angular velocity, (3,)."""
    shift: Floats
    """Velocity of the pivot, (3,)."""
    pivot: Floats
    work: float
    """Work of statics, to begin with [J]."""


class Pushes:
    """Pushes of the bodies of a scene that is at rest in a state."""

    def __init__(self, scene: Scene, state: Floats, limit: Limit) -> None:
        """Raises ValueError on a scene without gravity."""
        self._scene, self._world, self._limit = scene, World(scene), limit
        self._up, self._names = up_of(scene), movable(scene)
        links = {joint.child for joint in scene.joints}
        self.names = [name for name in self._names if name not in links]
        self._state = np.array(state)
        for name in self.names:
            self._state[scene.slice(name)][7:] = 0.0
        self._plane = frame_of(scene)[:2]
        axes = {b.name: (*b.linear_factor, *b.angular_factor) for b in scene.bodies}
        self._free = {name: np.array(axes[name]) > 0 for name in self.names}
        self._corners = Boxes(scene, self._names).at(self._state)
        self._heights = np.ptp(self._corners @ self._up, axis=1)
        self._longest = max(LONGEST, FALLS * self._fall(self._heights.max(initial=0.0)))
        self._there = scene.unpack(self._state)
        self._points: dict[str, list[Floats]] = {name: [] for name in self._names}
        self._carries: dict[str, set[str]] = {body.name: set() for body in scene.bodies}
        for c in self._world.contacts(self._state):
            upwards = float(c.normal @ self._up)
            if c.normal_force > 0 and abs(upwards) > UPWARDS:
                low, high = (c.body_b, c.body_a) if upwards > 0 else (c.body_a, c.body_b)
                self._carries[low].add(high)
                if high in self._points:
                    self._points[high].append(np.array(c.position))

    def carried(self, body: str) -> tuple[str, ...]:
        """A body and all that rests on it, directly or not."""
        found, left = [body], [body]
        while left:
            new = sorted(self._carries[left.pop()] - set(found))
            found, left = found + new, left + new
        return tuple(name for name in found if name in self.names)

    def ways(self, body: str) -> Floats:
        """Directions across the edges that a body stands on, horizontal unit vectors (N, 3)."""
        return self._directions(self._area(body)) if self._points[body] else np.zeros((0, 3))

    def least(self, body: str) -> Push:
        """The least push that makes a body fall. Raises TimeoutError or Cancelled."""
        best = Push(body, np.inf, "", (0.0, 0.0, 0.0), ())
        fall = self._fall(self._heights[self._names.index(body)]) or np.inf
        most = 1.0 + max(LOSS, 2.0 * self._scene.step / fall)
        for kick in sorted(filter(self._is_free, self._kicks(body)), key=lambda kick: kick.work):
            energy = self._effort(body, kick, best.effort)
            if energy < best.effort:
                fallen = self.fallen(kick, energy)
                turns = kick.way.startswith("topples") and energy <= most * kick.work
                effort = min(energy, kick.work) if turns else energy
                direction = tuple(float(v) for v in kick.direction)
                others = tuple(name for name in fallen if name != body)
                best = replace(best, effort=effort, way=kick.way, direction=direction, takes=others)
        return best

    def fallen(self, kick: Kick, energy: float) -> list[str]:
        """Names of the bodies that fall after a kick of so much energy [J]."""
        unit = self._kicked(kick, 1.0)
        kinetic = self._world.energy(unit) - self._world.energy(self._state)
        start = self._kicked(kick, float(np.sqrt(energy / kinetic)))
        with kept_warnings():
            found = settle(
                self._scene, start, time=self._longest, during=0.15, **self._limit.rest()
            )
        if not found.complete:
            self._limit.require("a push has ended")
        ends = self._scene.unpack(found.state)
        down = zip(found.bodies, self._heights, strict=True)
        lower = [body for body, height in down if body.out or body.dropped > SUNK * height]
        return [b.name for b in found.bodies if b in lower or self._tilt(b.name, ends) > FALLEN]

    def _fall(self, height: float) -> float:
        """The time of a fall of so far, but for a factor [s]."""
        return float(np.sqrt(height / np.linalg.norm(self._scene.gravity)))

    def _tilt(self, name: str, ends: dict[str, dict[str, Floats]]) -> float:
        was, now = (Rotation.from_quat(s[name]["orientation"]) for s in (self._there, ends))
        return float(np.arccos(np.clip((now * was.inv()).apply(self._up) @ self._up, -1.0, 1.0)))

    def _effort(self, body: str, kick: Kick, best: float) -> float:
        """Least energy of a kick by which a body falls; inf if that is not below the best one."""

        def falls(energy: float) -> bool:
            return body in self.fallen(kick, energy)

        most = min(best * (1.0 - CLOSE), MOST * kick.work)
        low, high = 0.0, min(kick.work, most) if np.isinf(best) else most
        while not falls(high):
            if high >= most:
                return np.inf
            low, high = high, min(2.0 * high, most)
        while high - low > CLOSE * high:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if falls(middle) else (middle, high)
        return high

    def _kicked(self, kick: Kick, speed: float) -> Floats:
        state = self._state.copy()
        for name in kick.bodies:
            own = state[self._scene.slice(name)]
            own[7:] = speed * self._free[name] * _twist(kick, own[:3])
        return state

    def _is_free(self, kick: Kick) -> bool:
        """Whether no locked axis of a body is in the way."""
        twists = {name: _twist(kick, self._there[name]["position"]) for name in kick.bodies}
        return all(np.abs(twist * ~self._free[n]).max() < LOCKED for n, twist in twists.items())

    def _kicks(self, body: str) -> Iterator[Kick]:
        if not self._points[body]:
            return
        points = self._area(body)
        for direction in self._directions(points):
            pivot = points[np.argmax(points @ direction)]
            turn, still = np.cross(self._up, direction), np.zeros(3)
            for bodies in dict.fromkeys(((body,), self.carried(body))):
                others = " with what it carries" * (len(bodies) > 1)
                mass, center = self._center(bodies)
                weight = mass * float(np.linalg.norm(self._scene.gravity))
                height = float((center - pivot) @ self._up)
                away = max(float((pivot - center) @ direction), 0.0)
                rise = max(float(np.hypot(height, away)) - height, 1e-3 * abs(height))
                given = direction, bodies
                yield Kick(f"topples{others}", *given, turn, still, pivot, weight * rise)
                yield Kick(f"slides{others}", *given, still, direction, pivot, weight * rise)

    def _center(self, bodies: Sequence[str]) -> tuple[float, Floats]:
        """Mass [kg] and centre of mass of some bodies."""
        total, moment = 0.0, np.zeros(3)
        for body in self._scene.bodies:
            if body.name in bodies:
                total += body.mass
                moment = moment + body.mass * center_of(body, self._there[body.name])
        return total, moment / total

    def _area(self, body: str) -> Floats:
        """Points that a body stands on, (N, 3): its contacts, and the corners of its shape beside
        them, since a round rim has few contacts."""
        points = np.array(self._points[body]).reshape(-1, 3)
        shape = next(one.shape for one in self._scene.bodies if one.name == body)
        there = self._there[body]["position"], self._there[body]["orientation"]
        corners = moved(np.concatenate(scenes.shape_parts(shape)), *there)
        hull = _hull(points @ self._plane.T)
        if hull is None:
            return points
        middle = points.mean(axis=0)
        level = np.abs((corners - middle) @ self._up) < LEVEL * np.ptp(corners @ self._up)
        inwards = (middle + (corners - middle) / (1.0 + RIM)) @ self._plane.T
        near = (inwards @ hull.equations[:, :2].T + hull.equations[:, 2] <= 0.0).all(axis=1)
        return np.concatenate([points, corners[level & near]])

    def _directions(self, points: Floats) -> Floats:
        """Across the edges of the area between points, (N, 3), outwards and horizontal, at most
        AROUND of them, evenly; if there is no area, around."""
        hull = _hull(points @ self._plane.T)
        if hull is None:
            angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
            return np.stack([np.cos(angles), np.sin(angles)], axis=1) @ self._plane
        normals = np.unique(np.round(hull.equations[:, :2], 6), axis=0)
        normals = normals[np.argsort(np.arctan2(normals[:, 1], normals[:, 0]))]
        chosen = np.arange(AROUND) * len(normals) // AROUND
        return (normals[chosen] if len(normals) > AROUND else normals) @ self._plane


def _twist(kick: Kick, position: Floats) -> Floats:
    """Velocity and angular velocity of a body by a kick at unit speed, (6,)."""
    return np.concatenate([kick.shift + np.cross(kick.turn, position - kick.pivot), kick.turn])


def _hull(points: Floats) -> Any:
    """Of points of a plane, (N, 2); None if they are on a line."""
    try:
        return ConvexHull(points)
    except (QhullError, ValueError):
        return None
