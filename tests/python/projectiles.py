"""Random shots at walls: whatever flies, nothing is to come out on the other side.

A projectile flies at a fixed wall, or towards a wall that moves; or a fast turning paddle strikes
a projectile that lies before a wall. Walls are so wide that no shot gets around them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from cages import (
    GRAVITY,
    OBJECTS,
    corners,
    log_uniform,
    mesh_of,
    random_object,
)
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin._core import (
    Box,
    Cancel,
    Compound,
    ConvexHull,
    Cylinder,
    Part,
    Scene,
    World,
)
from energymargin.scenes import body_poses, shape_parts

__all__ = ["CASES", "PROJECTILES", "WALLS", "Barrier", "Shot", "depth", "random_shot"]

CASES = ("fixed", "moving", "paddle")
WALLS = ("box", "compound", "hull", "mesh")
PROJECTILES = (*OBJECTS, "plate", "rod")

SPEED = (1.0, 20.0)  # m/s
THICKNESS = (0.001, 0.01)  # m: of walls and paddles, evenly in the logarithm
LENGTH = (0.005, 0.04)  # m: of projectiles, evenly in the logarithm
DENSITY = (500.0, 8000.0)  # kg/m^3: wood to steel, evenly in the logarithm
STEEPEST = math.radians(88.0)  # from straight on
WIDTH = 1.2  # m: of walls
SEAM = 0.01  # m: by which the halves of a mesh overlap
WAY = (0.005, 0.15)  # m: to the wall
BEYOND = 0.1  # m: that it would fly on without the wall
FEWEST_STEPS = 8
WEIGHTS = 20.0  # at most, of the force that presses the projectile at the wall in a rollout
SPIN = 50.0  # rad/s, at most about each axis; rods turn faster

PADDLE = 0.3  # m: length and width
POST = 0.002  # m

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Barrier:
    """A flat body across the z axis of its frame."""

    body: str
    width: float
    """Along x and y [m]."""
    projectile: str
    """The body that starts on the side where z is positive, and is to stay there."""


@dataclass(frozen=True)
class Shot:
    """A scene as it starts, and what is not to be passed in it."""

    scene: Scene
    steps: int
    wrench: Vector
    """Of the rollout, shape (6,)."""
    barriers: tuple[Barrier, ...]
    case: str
    """One of CASES."""
    walls: str
    """One of WALLS."""
    object: str
    """One of PROJECTILES."""
    thickness: float
    """Of the wall [m]."""
    speed: float
    """Of the projectile, or of the paddle's tip [m/s]."""


def random_shot(seed: int) -> Shot:
    """A projectile and a wall, turned at random, with or without gravity.

    Walls of a mesh take the extra [urdf].
    """
    random = np.random.default_rng(seed)
    case = str(random.choice(CASES, p=(0.6, 0.2, 0.2)))
    shooter = _Shooter(
        random,
        walls=str(random.choice(WALLS)),
        object=str(random.choice(PROJECTILES)),
        thickness=log_uniform(random, *THICKNESS),
        speed=float(random.uniform(*SPEED)),
        turn=Rotation.random(random_state=random),
        weight=GRAVITY * float(random.integers(2)),
    )
    shoot: dict[str, Callable[[], Shot]] = {
        "fixed": shooter.fixed,
        "moving": shooter.moving,
        "paddle": shooter.paddle,
    }
    return shoot[case]()


def depth(shot: Shot, *, cancel: Cancel | None = None) -> float:
    """How far a projectile's centre gets beyond a barrier's middle plane, or a part of it [m].

    Negative if all of it stays before the plane. It is the most over all frames of a simulation
    and the end of a rollout with `shot.wrench`. Raises Cancelled once `cancel` is set.
    """
    world, start = World(shot.scene), shot.scene.pack()
    recorded = np.asarray(world.simulate(start, shot.steps, cancel=cancel).states)
    duration = shot.steps * shot.scene.step
    pressed = world.rollout(start, shot.wrench, duration, cancel=cancel).state
    return max(
        _beyond(shot.scene, states, barrier)
        for barrier in shot.barriers
        for states in (recorded, np.stack([start, pressed]))
    )


def _beyond(scene: Scene, states: Vector, barrier: Barrier) -> float:
    """The most of all states, shape (K, n), before the projectile leaves the barrier's outline."""
    shapes = {body.name: body.shape for body in scene.bodies}
    points = np.concatenate([np.zeros((1, 3)), *shape_parts(shapes[barrier.projectile])])
    reach = float(np.linalg.norm(points, axis=1).max())
    most = -math.inf
    for state in states:
        poses = body_poses(scene, state)
        seen = _seen_from(poses[barrier.body], poses[barrier.projectile], points)
        if np.abs(seen[0, :2]).max() + reach > 0.5 * barrier.width:
            break
        most = max(most, -float(seen[:, 2].min()))
    return most


def _seen_from(frame: Any, pose: Any, points: Vector) -> Vector:
    """Points of a body with this pose in a frame, each a position and a quaternion."""
    position, orientation = pose
    in_world = Rotation.from_quat(orientation).apply(points) + position
    origin, axes = frame
    return np.asarray(Rotation.from_quat(axes).inv().apply(in_world - origin))


@dataclass(frozen=True)
class _Shooter:
    """What was drawn for all cases. Vectors are in the frame of the wall, which `turn` turns."""

    random: np.random.Generator
    walls: str
    object: str
    thickness: float
    speed: float
    turn: Rotation
    weight: float
    """Gravity [m/s^2]."""

    def fixed(self) -> Shot:
        """At a wall that stands, from straight on to grazing."""
        scene = Scene(gravity=(0.0, 0.0, -self.weight))
        self._add_wall(scene, mass=0)
        start, flight, time = self._flight()
        self._add_projectile(scene, start, flight * self.speed)
        return self._shot("fixed", scene, time)

    def moving(self) -> Shot:
        """Towards a free wall that comes nearer."""
        scene = Scene(gravity=(0.0, 0.0, -self.weight))
        start, flight, time = self._flight()
        speed = float(self.random.uniform(*SPEED))
        start[2] += speed * time
        self._add_projectile(scene, start, flight * self.speed)
        self._add_wall(
            scene,
            mass=scene.bodies[0].mass * log_uniform(self.random, 1.0, 1000.0),
            velocity=tuple(self.turn.apply((0.0, 0.0, speed))),
        )
        return self._shot("moving", scene, time)

    def paddle(self) -> Shot:
        """A paddle on a joint strikes a projectile that lies before a wall."""
        random = self.random
        down = self.turn.apply((0.0, 0.0, -self.weight))
        scene = Scene(gravity=tuple(down))
        self._add_wall(scene, mass=0)
        away = random.uniform(-0.9, -0.4) * PADDLE, 0.3 * random.uniform(-1.0, 1.0) * PADDLE
        self._add_projectile(scene, np.array([*away, random.uniform(0.0, 0.002)]), np.zeros(3))
        thickness = log_uniform(random, *THICKNESS)
        height = 0.5 * (self.thickness + thickness) + random.uniform(0.003, 0.03)
        angle, rate = float(random.uniform(0.6, 1.2)), self.speed / PADDLE
        scene.add_body(
            "post",
            Box((POST, POST, POST)),
            mass=0,
            position=tuple(self.turn.apply((0.0, 0.0, height))),
            orientation=tuple(self.turn.as_quat()),
        )
        scene.add_body(
            "paddle", Box((PADDLE, PADDLE, thickness)), density=2700.0, friction=random.uniform()
        )
        scene.add_joint(
            "hinge",
            parent="post",
            child="paddle",
            orientation=(0.0, 1.0, 0.0, 0.0),  # its z axis points to the wall, its x axis to -x
            child_origin=(-0.5 * PADDLE, 0.0, 0.0),
            axis=(0.0, 1.0, 0.0),
            start=angle,
            start_velocity=-rate,
            target_velocity=-rate,
            damping=float(random.integers(2)) * random.uniform(0.0, 20.0) / rate,
            torque_limit=20.0,  # N m
        )
        barriers = (
            Barrier("wall", WIDTH, "object"),
            Barrier("wall", WIDTH, "paddle"),
            Barrier("paddle", PADDLE, "object"),
        )
        return self._shot("paddle", scene, 1.5 * angle / rate, barriers)

    def _flight(self) -> tuple[Vector, Vector, float]:
        """Where it starts, if it had no extent [m], its direction, and when it arrives [s]."""
        steep, around = self.random.uniform((0.0, 0.0), (STEEPEST, 2.0 * math.pi))
        flight = np.array(
            [
                math.sin(steep) * math.cos(around),
                math.sin(steep) * math.sin(around),
                -math.cos(steep),
            ]
        )
        way = self.random.uniform(*WAY)
        target = np.append(self.random.uniform(-0.05, 0.05, 2), 0.0)
        return target - way * flight, flight, way / self.speed

    def _add_projectile(self, scene: Scene, start: Vector, velocity: Vector) -> None:
        """`start` is how far its sphere is from the wall's surface."""
        random = self.random
        shape = _projectile(self.object, 0.5 * log_uniform(random, *LENGTH), random)
        points = np.concatenate(shape_parts(shape))
        reach = float(np.linalg.norm(points, axis=1).max())
        position = start + np.array([0.0, 0.0, 0.5 * self.thickness + 1.01 * reach])
        spin = random.uniform(-SPIN, SPIN, 3)
        turn = Rotation.random(random_state=random)
        if self.object == "rod":
            spin = turn.apply((random.uniform(*SPEED) / reach, 0.0, 0.0))  # across its axis
        scene.add_body(
            "object",
            shape,
            density=log_uniform(random, *DENSITY),
            position=tuple(self.turn.apply(position)),
            orientation=tuple((self.turn * turn).as_quat()),
            velocity=tuple(self.turn.apply(velocity)),
            angular_velocity=tuple(self.turn.apply(spin)) if velocity.any() else (0.0, 0.0, 0.0),
            friction=float(random.uniform()),
            role="object",
        )

    def _add_wall(self, scene: Scene, **motion: Any) -> None:
        shape = _wall(self.walls, self.thickness)
        turned = tuple(self.turn.as_quat())
        friction = float(self.random.uniform())
        scene.add_body("wall", shape, orientation=turned, friction=friction, **motion)

    def _shot(
        self,
        case: str,
        scene: Scene,
        time: float,
        barriers: tuple[Barrier, ...] = (Barrier("wall", WIDTH, "object"),),
    ) -> Shot:
        """Until the projectile would have arrived, and some time more."""
        steps = math.ceil((time + BEYOND / self.speed) / scene.step)
        mass = next(body.mass for body in scene.bodies if body.name == "object")
        press = (0.0, 0.0, -mass * GRAVITY * self.random.uniform(0.0, WEIGHTS))
        return Shot(
            scene,
            max(steps, FEWEST_STEPS),
            np.concatenate([self.turn.apply(press), np.zeros(3)]),
            barriers,
            case,
            self.walls,
            self.object,
            self.thickness,
            self.speed,
        )


def _wall(kind: str, thickness: float) -> Any:
    """A flat body across the z axis, with seams in its middle if it has parts."""
    size = np.array([WIDTH, WIDTH, thickness])
    if kind == "box":
        return Box(tuple(size))
    if kind == "hull":
        return ConvexHull(corners(np.zeros(3), size))
    if kind == "mesh":
        half = size - [0.5 * WIDTH - SEAM, 0.0, 0.0]
        side = np.array([0.25 * WIDTH - 0.5 * SEAM, 0.0, 0.0])
        return mesh_of([(-side, half), (side, half)])
    quarter = Box((0.5 * WIDTH, 0.5 * WIDTH, thickness))
    places = [(x * WIDTH, y * WIDTH, 0.0) for x in (-0.25, 0.25) for y in (-0.25, 0.25)]
    return Compound([Part(quarter, position=place) for place in places])


def _projectile(kind: str, size: float, random: np.random.Generator) -> Any:
    """About 2 * size long."""
    if kind == "plate":
        wide, thin = random.uniform((0.4, 0.03), (1.0, 0.1))
        return Box((2.0 * size, 2.0 * size * wide, 2.0 * size * thin))
    if kind == "rod":
        return Cylinder(radius=size * random.uniform(0.05, 0.12), length=2.0 * size)
    return random_object(kind, size, random)
