"""What moves: by the laws of free motion, and as it slides, spins and rolls on a floor."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin._core import Box, Cylinder, Inertial, Scene, World
from energymargin.base.aliases import Floats
from energymargin_paper.evidence.contact_traces import GRAVITY, MILLI, Trace, simulated

__all__ = [
    "FLOORS",
    "Kept",
    "Slide",
    "braking",
    "linkage",
    "momenta",
    "pendulum",
    "rolling_drift",
    "slide",
    "tumbling",
]

FLOORS = ("plane", "box")
STILL = 1e-3  # m/s, below which a box has stopped


class Kept(NamedTuple):
    """Shares by which what is to be kept changes, at most."""

    energy: float
    """Kinetic energy."""
    angular: float
    """Angular momentum about the centre of mass."""
    linear: float = 0.0
    """Linear momentum."""


class Slide(NamedTuple):
    """What a sliding box does."""

    lift: float
    """Largest lift of its centre [mm]."""
    steps: float
    """Steps until it stops, over those on paper."""


def tumbling(seed: int = 0, rate: float = 10.0, duration: float = 10.0) -> Kept:
    """A box that turns about its middle axis, which is unstable, without gravity."""
    random = np.random.default_rng(seed)
    size = (0.06, 0.1, 0.2) if seed == 0 else np.sort(random.uniform(0.05, 0.25, 3))
    turn = Rotation.identity() if seed == 0 else Rotation.random(random_state=random)
    moments = np.array([(size[1] ** 2 + size[2] ** 2), (size[0] ** 2 + size[2] ** 2), 0.0]) / 12
    moments[2] = (size[0] ** 2 + size[1] ** 2) / 12
    scene = Scene(gravity=(0, 0, 0))
    scene.add_body(
        "box",
        Box(size),
        mass=1.0,
        inertial=Inertial(inertia=moments),
        orientation=turn.as_quat(),
        angular_velocity=turn.apply((0.01 * rate, rate, 0.01 * rate)),
    )
    trace = simulated(scene, duration)
    turns = Rotation.from_quat(trace.of("box", "orientation"))
    spin = turns.inv().apply(trace.of("box", "angular_velocity"))  # in the box's axes
    energy = (moments * spin**2).sum(axis=1) / 2
    momentum = turns.apply(moments * spin)
    return Kept(_change(energy), _change(momentum))


def pendulum(seed: int = 0, duration: float = 10.0) -> float:
    """How far the energy of a double pendulum without friction goes from its start.

    It is released from the horizontal (another seed: from a random pose, other links). The share
    is of the energy between the horizontal and hanging down.
    """
    random, scene = np.random.default_rng(seed), Scene()
    scene.add_body("post", Box((0.02,) * 3), mass=0.0, position=(0, 0, 1))
    lengths = (0.3, 0.3) if seed == 0 else random.uniform(0.1, 0.5, 2)
    masses = (1.0, 1.0) if seed == 0 else random.uniform(0.2, 2.0, 2)
    starts = (0.0, 0.0) if seed == 0 else random.uniform(-1.5, 1.5, 2)
    parent, origin = "post", np.zeros(3)
    for number in range(2):
        name, length = f"link{number}", lengths[number]
        scene.add_body(name, Box((length, 0.02, 0.02)), mass=masses[number])
        scene.add_joint(
            f"joint{number}",
            parent=parent,
            child=name,
            origin=origin,
            child_origin=(-length / 2, 0, 0),
            axis=(0, 1, 0),
            start=starts[number],
        )
        parent, origin = name, np.array((length / 2, 0.0, 0.0))
    scene.disable_collisions("post", "link1")
    trace, world = simulated(scene, duration), World(scene)
    energy = np.array([world.energy(state) for state in trace.states])
    drop = GRAVITY * (masses[0] * lengths[0] / 2 + masses[1] * (lengths[0] + lengths[1] / 2))
    return float(np.abs(energy - energy[0]).max() / drop)


def linkage(seed: int, duration: float = 5.0, faster: float = 1.0) -> Kept:
    """Two to four bodies on revolute joints that fly freely: no gravity, drives or contacts.

    `faster`: than up to 3 rad/s of the base and 4 rad/s of the joints at the start.
    """
    scene, inertias = _linkage(np.random.default_rng(seed), faster)
    trace = simulated(scene, duration)
    linear, angular, kinetic = momenta(trace, inertias)
    return Kept(_change(kinetic), _change(angular), _change(linear))


def momenta(trace: Trace, inertias: dict[str, Floats]) -> tuple[Floats, Floats, Floats]:
    """Linear and angular momentum, shape (K, 3), and kinetic energy, shape (K,), of all bodies.

    `inertias`: of bodies whose centre of mass is their frame's origin, the moments about the
    frame's axes, shape (3,). The angular momentum is about the centre of mass of all.
    """
    bodies = {body.name: body for body in trace.scene.bodies}
    masses = np.array([bodies[name].mass for name in inertias])
    places = np.array([trace.position(name) for name in inertias])
    speeds = np.array([trace.of(name, "velocity") for name in inertias])
    middle = np.tensordot(masses, places, 1) / masses.sum()
    linear = np.tensordot(masses, speeds, 1)
    angular, kinetic = np.zeros_like(linear), np.zeros(len(linear))
    for number, (name, moments) in enumerate(inertias.items()):
        turns = Rotation.from_quat(trace.of(name, "orientation"))
        spin = turns.inv().apply(trace.of(name, "angular_velocity"))
        angular += turns.apply(moments * spin)
        angular += masses[number] * np.cross(places[number] - middle, speeds[number])
        kinetic += (moments * spin**2).sum(axis=1) / 2
        kinetic += masses[number] * (speeds[number] ** 2).sum(axis=1) / 2
    return linear, angular, kinetic


def slide(seed: int = 0, speed: float = 0.3, friction: float = 0.5) -> Slide:
    """A box of 10 cm x 10 cm x 5 cm that slides to a stop, along x (another seed: anywhere)."""
    random, scene = np.random.default_rng(seed), Scene()
    heading = float(random.uniform(0, 2 * math.pi)) if seed else 0.0
    yaw = float(random.uniform(0, 2 * math.pi)) if seed else 0.0
    scene.add_plane("floor", friction=1.0)
    scene.add_body(
        "box",
        Box((0.1, 0.1, 0.05)),
        mass=1.0,
        position=(0, 0, 0.025),
        yaw=yaw,
        velocity=speed * np.array((math.cos(heading), math.sin(heading), 0.0)),
        friction=friction,
    )
    trace = simulated(scene, 0.5)
    lift = MILLI * (trace.height("box") - trace.height("box")[0]).max()
    moving = np.linalg.norm(trace.of("box", "velocity"), axis=1) > STILL
    last = int(np.flatnonzero(moving).max()) + 1
    return Slide(float(lift), last - speed / (friction * GRAVITY) / scene.step)


def braking(floor: str = "plane", seed: int = 0, friction: float = 0.5) -> float:
    """The torque that brakes an upright spinning disc, over 2/3 mu m g R, that of even pressure."""
    random = np.random.default_rng(seed)
    radius, height = (0.1, 0.05) if seed == 0 else random.uniform((0.05, 0.03), (0.15, 0.1))
    scene = Scene()
    if floor == "plane":
        scene.add_plane("floor", friction=1.0)
    else:
        scene.add_body("floor", Box((1, 1, 0.1)), mass=0.0, position=(0, 0, -0.05), friction=1.0)
    wanted = 2.0 / 3.0 * friction * GRAVITY * radius / (radius**2 / 2)  # rad/s^2
    rate = wanted * 0.5  # it stops after half a second
    scene.add_body(
        "disc",
        Cylinder(radius, height),
        mass=1.0,
        position=(0, 0, height / 2),
        angular_velocity=(0, 0, rate),
        friction=friction,
    )
    trace = simulated(scene, 0.4)
    spin = trace.of("disc", "angular_velocity")[:, 2]
    first = trace.at(0.05)  # after it has settled
    return float((spin[first] - spin[-1]) / (trace.times[-1] - trace.times[first]) / wanted)


def rolling_drift(heading: float, radius: float = 0.05, way: float = 1.6) -> float:
    """How far a lying cylinder that rolls 1.6 m goes aside [mm]. `heading` [rad], of its way."""
    speed, scene = 0.8, Scene()
    along = np.array((math.cos(heading), math.sin(heading), 0.0))
    aside = np.array((-math.sin(heading), math.cos(heading), 0.0))
    scene.add_plane("floor", friction=1.0)
    turn = Rotation.from_euler("z", heading) * Rotation.from_euler("x", -math.pi / 2)
    scene.add_body(
        "cylinder",
        Cylinder(radius, 0.1),
        mass=1.0,
        position=(0, 0, radius),
        orientation=turn.as_quat(),
        velocity=speed * along,
        angular_velocity=speed / radius * aside,
        friction=0.5,
    )
    trace = simulated(scene, 2.0 * way / speed)
    path = trace.position("cylinder")
    until = int(np.argmax(path @ along >= way)) or len(path) - 1
    return float(MILLI * np.abs(path[: until + 1] @ aside).max())


def _linkage(random: np.random.Generator, faster: float) -> tuple[Scene, dict[str, Floats]]:
    """Boxes on each other's ends, a free base first, and their moments of inertia."""
    scene, inertias = Scene(gravity=(0, 0, 0)), {}
    count = int(random.integers(2, 5))
    for number in range(count):
        size = random.uniform(0.05, 0.2, 3)
        mass = float(np.exp(random.uniform(math.log(0.05), math.log(5.0))))
        moments = mass * (np.sum(size**2) - size**2) / 12
        inertias[f"body{number}"] = moments
        motion: dict[str, Any] = {}
        if number == 0:
            motion["velocity"] = random.uniform(-0.5, 0.5, 3)
            motion["angular_velocity"] = faster * random.uniform(-3, 3, 3)
            motion["orientation"] = Rotation.random(random_state=random).as_quat()
        scene.add_body(
            f"body{number}", Box(size), mass=mass, inertial=Inertial(inertia=moments), **motion
        )
    for number in range(1, count):
        axis = random.normal(size=3)
        scene.add_joint(
            f"joint{number}",
            parent=f"body{int(random.integers(number))}",
            child=f"body{number}",
            origin=random.uniform(-0.15, 0.15, 3),
            child_origin=random.uniform(-0.15, 0.15, 3),
            axis=axis / np.linalg.norm(axis),
            start=float(random.uniform(-1, 1)),
            start_velocity=faster * float(random.uniform(-4, 4)),
        )
        for other in range(number):
            scene.disable_collisions(f"body{other}", f"body{number}")
    return scene, inertias


def _change(of: Floats) -> float:
    """The largest change from the start, over its size there."""
    values = of.reshape(len(of), -1)
    return float(np.linalg.norm(values - values[0], axis=1).max() / np.linalg.norm(values[0]))
