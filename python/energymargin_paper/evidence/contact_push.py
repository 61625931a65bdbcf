"""A box on three feet that a smooth ball pushes: its way follows from Coulomb's law alone.

Three feet bear the box in one way only, and friction at each opposes the slip of that foot. On four
feet, or with friction at the ball, the law does not say what bears how much, and has many answers.
`coulomb` integrates Newton's and Euler's equations of the box in its plane, apart from any engine.
MuJoCo and version 0.13.0, without friction at the feet and with Coulomb's there as a wrench anew in
each step, end within .1 mm of it; with their own friction 20 to 30 mm from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from energymargin._core import Box, Compound, Inertial, Part, Scene, Sphere
from energymargin.base.aliases import Floats
from energymargin_paper.evidence.contact_traces import GRAVITY, MILLI, simulated

__all__ = ["SIZE", "Push", "corners", "coulomb", "push_error", "push_scene", "random_push"]

SIZE = (0.1, 0.1, 0.04)  # m, of the box without its feet
FOOT, BALL = 0.01, 0.02  # m, radii
MASS, HEIGHT, MOMENTS = 0.5, 0.03, (5e-4, 5e-4, 8e-4)  # kg, m of its centre, kg m^2
GAP = 0.001  # m, from ball to box at the start
SPEED, DAMPING = 0.2, 100.0  # m/s and N s/m, of the drive of the ball, which weighs 1 kg
DURATION = 1.0  # s

STEP = 1e-4  # s, of the integration
CREEP = 1e-3  # m/s, below which friction fades there, instead of sticking
STIFF, SOFT = 2e5, 600.0  # N/m and N s/m, of the ball against the box there


@dataclass(frozen=True)
class Push:
    """Where the box is pushed and on what it stands."""

    aside: float = 0.02
    """Place of the ball, from the middle of the box [m]."""
    friction: float = 0.48
    """Friction of a foot on the floor."""
    feet: tuple[tuple[float, float], ...] = ((0.04, 0.0), (-0.03, 0.04), (-0.03, -0.04))
    """Three, seen from above [m]."""


def random_push(seed: int) -> Push:
    """Another place to push at, friction and feet; seed 0 is the default."""
    if seed == 0:
        return Push()
    random = np.random.default_rng(seed)
    feet = np.array(Push.feet) + random.uniform(-0.006, 0.006, (3, 2))
    aside, friction = random.uniform((-0.025, 0.2), (0.025, 0.6))
    return Push(float(aside), float(friction), tuple((float(x), float(y)) for x, y in feet))


def push_error(seed: int) -> float:
    """The largest distance of a corner of the box, after 1 s, from where it is on paper [mm]."""
    push = random_push(seed)
    trace = simulated(push_scene(push), DURATION)
    pose = np.append(trace.position("box")[-1], trace.of("box", "orientation")[-1])
    ways = corners(pose) - corners(coulomb(push))
    return float(MILLI * np.linalg.norm(ways, axis=1).max())


def push_scene(push: Push, step: float | None = None) -> Scene:
    """The box at the origin, and the ball on a rail along x."""
    scene = Scene() if step is None else Scene(step=step)
    scene.add_plane("floor", friction=1.0)
    feet = [Part(Sphere(FOOT), (x, y, FOOT)) for x, y in push.feet]
    body = Part(Box(SIZE), (0.0, 0.0, 1.5 * FOOT + SIZE[2] / 2))
    scene.add_body(
        "box",
        Compound([body, *feet]),
        mass=MASS,
        inertial=Inertial((0.0, 0.0, HEIGHT), inertia=MOMENTS),
        friction=push.friction,
        role="object",
    )
    scene.add_body("post", Box((0.02,) * 3), mass=0.0, position=(-0.5, 0.0, 0.5))
    scene.add_body("ball", Sphere(BALL), mass=1.0, friction=0.0, role="effector")
    scene.add_joint(
        "rail",
        type="prismatic",
        parent="post",
        child="ball",
        origin=(0.5 + _start(), push.aside, HEIGHT - 0.5),
        axis=(1, 0, 0),
        target_velocity=SPEED,
        damping=DAMPING,
        start_velocity=SPEED,
    )
    return scene


def coulomb(push: Push, duration: float = DURATION) -> Floats:
    """Where the box is by Coulomb's law: position and quaternion, shape (7,)."""
    place, turn, velocity, spin = np.zeros(2), 0.0, np.zeros(2), 0.0
    ball, speed = np.array((_start(), push.aside)), SPEED
    local = np.array(push.feet)
    for _ in range(round(duration / STEP)):
        axes = np.array(((math.cos(turn), -math.sin(turn)), (math.sin(turn), math.cos(turn))))
        force, torque = _floor(push.friction, local @ axes.T, velocity, spin)
        pressed, arm = _ball(axes, ball - place, np.array((speed, 0.0)) - velocity, spin)
        velocity = velocity + STEP * (force + pressed) / MASS
        spin += STEP * (torque + arm[0] * pressed[1] - arm[1] * pressed[0]) / MOMENTS[2]
        speed += STEP * (DAMPING * (SPEED - speed) - pressed[0])
        place, turn = place + STEP * velocity, turn + STEP * spin
        ball[0] += STEP * speed
    return np.array((*place, 0.0, 0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2)))


def corners(pose: Floats) -> Floats:
    """Corners of the box at a pose (7,), about its frame, shape (4, 3): it stands upright."""
    x, y, z = pose[:3]
    turn = 2.0 * math.atan2(pose[5], pose[6])
    half = SIZE[0] / 2
    places = [(a * half, b * half) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    c, s = math.cos(turn), math.sin(turn)
    return np.array([(x + c * a - s * b, y + s * a + c * b, z) for a, b in places])


def _start() -> float:
    return -SIZE[0] / 2 - GAP - BALL


def _floor(friction: float, feet: Floats, velocity: Floats, spin: float) -> tuple[Floats, float]:
    """Force and torque of friction at the feet, which bear the weight and what tips the box."""
    slips = velocity + spin * np.stack((-feet[:, 1], feet[:, 0]), axis=1)
    shares = -friction * slips / np.sqrt((slips**2).sum(axis=1) + CREEP**2)[:, None]
    balance = np.array(
        (np.ones(3), feet[:, 1] + HEIGHT * shares[:, 1], -HEIGHT * shares[:, 0] - feet[:, 0])
    )
    forces = np.linalg.solve(balance, (MASS * GRAVITY, 0.0, 0.0))[:, None] * shares
    torque = (feet[:, 0] * forces[:, 1] - feet[:, 1] * forces[:, 0]).sum()
    return forces.sum(axis=0), float(torque)


def _ball(axes: Floats, apart: Floats, closing: Floats, spin: float) -> tuple[Floats, Floats]:
    """The force of the ball on the box, and where it acts, from the middle of the box."""
    local = axes.T @ apart
    nearest = np.clip(local, -SIZE[0] / 2, SIZE[0] / 2)
    distance = float(np.linalg.norm(local - nearest))
    arm = axes @ nearest
    if not 0.0 < distance < BALL:
        return np.zeros(2), arm
    normal = axes @ (local - nearest) / distance
    rate = float((closing - spin * np.array((-arm[1], arm[0]))) @ normal)
    return min(0.0, SOFT * rate - STIFF * (BALL - distance)) * normal, arm
