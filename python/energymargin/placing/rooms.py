"""Where a body has room in a scene: candidates of its pose, what is in their way, and a hand that
lets it go there: the body is gripped, and let go as a protocol says.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from energymargin import Plan, Plane, Scene, World, scenes
from energymargin.base import checks
from energymargin.base.aliases import Floats
from energymargin.base.limits import Limit
from energymargin.grasps import GraspObject, Hand, Protocol, grip
from energymargin.placing.boxes import Asked, frame_of, moved

INSIDE = 1e-4  # m; a thing or a hand that is deeper in another one has no room
LEVEL = 1e-3  # m, of the top of a part
DROP = 0.02  # m, by which a thing is lowered at most onto a top that is not flat
ABOVE = 1e-3  # m, from where it is lowered
ROUNDED = 1e-3  # of a pose that is written with few digits
MOST = 10_000  # places of a grid on a top


class Room:
    """Where a body has room in a scene."""

    def __init__(self, scene: Scene, body: str, state: Floats) -> None:
        """The others are where they are in a state (n,)."""
        self._scene, self._body, self._state = scene, body, state
        self._world, self._frame = World(scene), frame_of(scene)
        self._shapes = {one.name: one.shape for one in scene.bodies}
        self._others = [name for name in self._shapes if name != body]
        if not self._others:
            raise ValueError(f"scene has no body but {body!r}, expected a support beside it")

    def state(self, pose: Floats, lift: Floats) -> Floats:
        """The state with the body at a pose (4, 4), lifted by (3,), at rest."""
        state = self._state.copy()
        own = state[self._scene.slice(self._body)]
        own[:3] = pose[:3, 3] + lift
        own[3:7] = Rotation.from_matrix(pose[:3, :3]).as_quat()
        own[7:] = 0.0
        return state

    def nearest(self, state: Floats) -> tuple[float, str]:
        """How far it is from the nearest body, which is named [m]."""
        return nearest_to([self._body], self._world, state, self._others)

    def blocked_by(self, state: Floats) -> str | None:
        """The body that it is in most deeply, if it is in one."""
        distance, nearest = self.nearest(state)
        return nearest if distance < -INSIDE else None

    def grid(
        self, on: Sequence[str], spacing: float, yaws: Sequence[float], limit: Limit
    ) -> dict[str, Floats]:
        """Candidates on the tops of supports, by name, the farthest from edges first: it counts if
        several stay alike. Raises ValueError if there is no top."""
        for name in checks.names_of("on", on):
            checks.one_of("on", name, self._others)
            if isinstance(self._shapes[name], Plane):
                raise ValueError(f"on is {name!r}, a plane without an end: give poses, or a box")
        checks.numbers_of("yaws", yaws, "turns in rad", (np.size(yaws),))
        if len(yaws) == 0:
            raise ValueError("yaws is empty, expected one turn at least, such as 0")
        found: list[tuple[float, str, Floats]] = []
        turned = Rotation.from_quat(self._scene.unpack(self._state)[self._body]["orientation"])
        spots = [(*spot, yaw) for spot in self._tops(dict.fromkeys(on)) for yaw in yaws]
        for number, (name, top, lean, yaw) in enumerate(spots):
            turn = lean * Rotation.from_rotvec(yaw * self._frame[2]) * turned
            frame = lean.apply(self._frame)
            for margin, place in points_in(top, frame, spacing):
                limit.require("the candidates were looked at")
                pose = self._standing(turn, place, frame[2])
                x, y, z = pose[:3, 3]
                found.append((margin, f"{name}.{number} ({x:.3f}, {y:.3f}, {z:.3f})", pose))
        checks.require(found, "on", list(on), "supports with a top, or give poses")
        return {name: pose for _, name, pose in sorted(found, key=lambda one: -one[0])}

    def _standing(self, turn: Rotation, place: Floats, up: Floats) -> Floats:
        """The pose in which it stands at a place, lowered until it touches something."""
        corners = turn.apply(np.concatenate(scenes.shape_parts(self._shapes[self._body])))
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        pose = np.eye(4)
        pose[:3, :3] = turn.as_matrix()
        pose[:3, 3] = place - middle + (up @ middle - (corners @ up).min() + ABOVE) * up
        left = DROP
        while left > 0 and (gap := self.nearest(self.state(pose, np.zeros(3)))[0]):
            if gap < INSIDE:
                break
            step = min(gap - INSIDE / 2, left)
            pose[:3, 3] -= step * up
            left -= step
        return pose

    def _tops(self, on: Iterable[str]) -> Iterator[tuple[str, Floats, Rotation]]:
        """Corners of the top of each convex part, (N, 3), of supports, and how that leans."""
        there = scenes.body_poses(self._scene, self._state)
        for name in on:
            for part in scenes.shape_parts(self._shapes[name]):
                yield name, *_top_of(moved(part, *there[name]), self._frame[2])


def nearest_to(
    bodies: Sequence[str], world: World, state: Floats, others: Sequence[str]
) -> tuple[float, str]:
    """How far some bodies are from the nearest other, which is named [m]; inf without others."""
    gaps = {o: min(world.distance(state, body, o) for body in bodies) for o in others}
    nearest = min(gaps, key=gaps.__getitem__, default="")
    return gaps.get(nearest, np.inf), nearest


def _top_of(corners: Floats, up: Floats) -> tuple[Floats, Rotation]:
    """The corners of a part's top, and the turn from level to how it leans."""
    hull = ConvexHull(corners)
    face = hull.equations[int(np.argmax(hull.equations[:, :3] @ up))]
    top = corners[corners @ face[:3] + face[3] > -LEVEL]
    heights = corners @ up
    level = corners[heights > heights.max() - LEVEL]
    if len(level) >= len(top):
        return level, Rotation.identity()
    across = np.cross(up, face[:3])
    lean, _ = Rotation.align_vectors([face[:3], across], [up, across])
    return top, lean


def points_in(top: Floats, frame: Floats, spacing: float) -> list[tuple[float, Floats]]:
    """Points of a grid on a top, from its middle on, and how far each is from the edges [m]."""
    flat, height = top @ frame[:2].T, float((top @ frame[2]).max())
    try:
        hull = ConvexHull(flat).equations
    except (QhullError, ValueError):
        return []
    low, high = flat.min(axis=0), flat.max(axis=0)
    count = float(np.prod(1.0 + (high - low) / spacing))
    larger = f"a larger one: it makes {count:.0f} candidates of a top, more than {MOST}"
    checks.require(count <= MOST, "spacing", spacing, larger)
    ways = [np.arange(0.0, (b - a) / 2 + 1e-9, spacing) for a, b in zip(low, high, strict=True)]
    sides = [np.unique(np.concatenate([-way, way])) for way in ways]
    points = 0.5 * (low + high) + np.stack(np.meshgrid(*sides, indexing="ij"), -1).reshape(-1, 2)
    margins = -(points @ hull[:, :2].T + hull[:, 2]).max(axis=1)
    inside = margins > -1e-9
    places = points[inside] @ frame[:2] + height * frame[2]
    return list(zip(np.round(margins[inside], 6).tolist(), places, strict=True))


def named(poses: Mapping[str, ArrayLike] | ArrayLike) -> dict[str, Floats]:
    """Poses (4, 4) by name. Raises ValueError on what is none."""
    given: Any = poses
    expected = "poses (4, 4), a dict of them by name, or (n, 4, 4)"
    try:
        items = list(given.items() if isinstance(given, Mapping) else enumerate(given))
    except TypeError as error:
        raise TypeError(f"poses is {checks.shown(given)}, expected {expected}") from error
    found = {str(name): checks.numbers_of("poses", pose, expected, (4, 4)) for name, pose in items}
    if len(found) < len(items):
        raise ValueError(f"poses has names {list(given)}, expected different ones as texts")
    for name, pose in found.items():
        turn = pose[:3, :3]
        skew = np.abs(turn @ turn.T - np.eye(3)).max() + np.abs(pose[3] - [0, 0, 0, 1]).max()
        right = skew <= ROUNDED and np.linalg.det(turn) >= 0
        said = "a rotation and a place, with the last row 0, 0, 0, 1, and a scale of 1"
        checks.require(right, f"poses[{name!r}]", pose, said)
    return found


class Release:
    """A hand that holds a body of a scene, and what it does to let it go."""

    def __init__(
        self, scene: Scene, body: str, hand: Hand | str, grasp: ArrayLike, protocol: Protocol | str
    ) -> None:
        """`grasp`: the grasp frame in the body's frame, (4, 4). Raises ValueError if the hand does
        not close on the body there, and on names that the scene has already."""
        own = next(one for one in scene.bodies if one.name == body)
        thing = GraspObject(own.shape, own.mass, own.friction, own.inertial)
        self._grip = grip(hand, thing, grasp, protocol, step=scene.step)
        self._body, self._old = body, scene
        self.scene = scene.with_body(body)  # a copy
        """With the hand."""
        held = self._grip.hand
        self.fitted = held.add_to(self.scene, force=held.force, opening=np.nan)
        self._world = World(self.scene)

    def begin(self, state: Floats, after: float) -> tuple[str | None, Asked]:
        """From a state without the hand: what is in the hand's way; and the scene, the state, the
        plan and the duration, `after` [s] it has let go."""
        held = self.state(state)
        plan = self.plan(held, after)
        return self.blocked_by(held), (self.scene, held, plan, plan.duration)

    def state(self, state: Floats) -> Floats:
        """A state of the scene without the hand, with the hand where it holds the body."""
        found = self.scene.pack()
        links = {joint.child for joint in self._old.joints}
        for one in self._old.bodies:
            if one.name not in links and (one.kinematic or not one.fixed):
                found[self.scene.slice(one.name)] = state[self._old.slice(one.name)]
        for joint in self._old.joints:
            if joint.type != "fixed" and joint.mimic is None:
                at = self.scene.joint_slice(joint.name)
                found[at] = state[self._old.joint_slice(joint.name)]
        for name, position in self._grip.joints.items():
            found[self.scene.joint_slice(name)] = position, 0.0
        base = pose_of(self._old, state, self._body) @ self._grip.base
        row = found[self.scene.slice(self.fitted.base)]
        turn = Rotation.from_matrix(base[:3, :3]).as_quat()
        turn = -turn if turn[0] > 0 else turn  # (1, 0, 0, 0) would look like one in another order
        row[:3], row[3:7], row[7:] = base[:3, 3], turn, 0.0
        return np.asarray(found)

    def plan(self, state: Floats, after: float) -> Plan:
        """What the hand does from a state on, and `after` [s] it has let go."""
        step = self.scene.step
        base = pose_of(self.scene, state, self.fitted.base)
        rows = self._grip.protocol.rows((base @ self.fitted.frame)[:3, :3], step)
        still = np.zeros((max(round(after / step), 1), 6))
        shares = np.append(self._grip.protocol.shares(step), np.ones(len(still)))
        ends = self.fitted.targets
        targets = {name: shut + shares * (wide - shut) for name, (wide, shut) in ends.items()}
        rows = np.concatenate([rows, still])
        return Plan(step=step, targets=targets, velocities={self.fitted.base: rows})

    def blocked_by(self, state: Floats) -> str | None:
        """What the hand is in, if it is in something else than the body."""
        others = [one.name for one in self._old.bodies if one.name != self._body]
        distance, nearest = nearest_to(self.fitted.bodies, self._world, state, others)
        return nearest if distance < -INSIDE else None


def pose_of(scene: Scene, state: Floats, name: str) -> Floats:
    """A body's pose, (4, 4)."""
    return np.asarray(scenes.pose(*scenes.body_poses(scene, state)[name]))
