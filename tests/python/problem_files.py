"""A problem with everything that a problem file can hold, and the executable that reads it."""

import itertools
import subprocess
import sysconfig
from pathlib import Path

import numpy as np

import energymargin as em

EXECUTABLE = Path(sysconfig.get_path("scripts")) / "energymargin_score"


def brick(size, center=(0.0, 0.0, 0.0)):
    corners = list(itertools.product((-0.5, 0.5), repeat=3))
    return em.ConvexHull(np.array(corners) * size + center)


def arm(scene):
    """A held rail, a driven hinge, two joints that follow it, and a weld, on a fixed post."""
    scene.add_body("post", em.Box((0.04, 0.04, 0.04)), mass=0, position=(0.0, 0.4, 0.3))
    for name in ("slider", "upper", "lower", "thumb", "tip"):
        scene.add_body(name, em.Capsule(0.01, 0.05), mass=0.1 / 3, role="effector", friction=0.7)
    scene.add_joint(
        "rail",
        type="prismatic",
        parent="post",
        child="slider",
        axis=(0.6, 0, 0.8),
        limits=(-0.1, 0.2),
        held=True,
        start=0.1 / 3,
        orientation=(0.6, 0, 0, 0.8),
        child_orientation=(0, 0.6, 0, 0.8),
    )
    scene.add_joint(
        "hinge",
        type="revolute",
        parent="slider",
        child="upper",
        origin=(0, 0, -0.05),
        child_origin=(0, 0, 0.05),
        axis=(1, 0, 0),
        target=0.1,
        stiffness=1 / 3,
        damping=0.01,
        torque_limit=0.7,
    )
    scene.add_joint(
        "follower",
        type="revolute",
        parent="upper",
        child="lower",
        axis=(1, 0, 0),
        origin=(0, 0, -0.05),
        child_origin=(0, 0, 0.05),
        mimic=em.Mimic("hinge", multiplier=-1 / 3, offset=0.1),
    )
    scene.add_joint(
        "echo",
        type="prismatic",
        parent="upper",
        child="thumb",
        axis=(0, 0, 1),
        origin=(0.1, 0, 0),
        mimic=em.Mimic("hinge", multiplier=0.01),
    )
    scene.add_joint("weld", type="fixed", parent="lower", child="tip", origin=(0, 0, -0.06))


def regions():
    """One of every type, true at the start."""
    r = em.regions
    return (
        r.Ball("cup", center=(0, 0, 0.03), radius=0.3)
        & r.Box("cup", center=(0, 0, 0), size=(np.inf, 1, np.inf), frame="table")
        & ~r.Disc("dice", center=(0, 0), radius=0.1, frame="cup")
        & r.HalfSpace("dice", normal=(0.6, 0, 0.8), offset=1)
        & r.Speed("dice", limit=1 / 3, point=(0.01, 0, 0))
        & r.Tilt("cup", axis=(0, 0, 1), reference=(0, 0, 1), limit=0.5)
        & (
            r.AnnularSector(
                "cup",
                center=(0.5, 0),
                radius=0.5,
                half_width=0.2,
                start_angle=2,
                sweep=2,
                frame="tip",
            )
            | r.Swept(
                "cup",
                by="tip",
                half_width=0.1,
                behind=0.1,
                ahead=0.5,
                least_speed=0.01,
                disc_radius=2,
            )
        )
    )


def full_problem():
    """Everything that a problem file can hold, in one that can be scored."""
    scene = em.Scene(gravity=(0.01, 0, -9.81), friction_rule="max")
    scene.add_plane("table", friction=0.5)
    mug = em.Compound(
        [brick((0.06, 0.06, 0.02), (0, 0, 0.01)), brick((0.02, 0.06, 0.06), (0.1 / 3, 0, 0.05))],
        solid=em.mass_properties(em.Cylinder(0.03, 0.06)),
    )
    scene.add_body("cup", mug, mass=0.2, position=(0, 0, 0), friction=0.6, role="object")
    dice = em.Compound(
        [
            em.Part(em.Box((0.03, 0.03, 0.03)), position=(0, 0, 0.02)),
            em.Part(em.Sphere(0.01), position=(0.01, 0, 0.04), orientation=(0, 0, 0.6, 0.8)),
        ]
    )
    scene.add_body(
        "dice",
        dice,
        mass=0.1,
        position=(0.2, 0, -0.005),
        friction=0.4,
        role="object",
        inertial=em.Inertial(center=(0, 0, 0.02), inertia=(1e-5, 1.1e-5, 4e-5 / 3)),
    )
    scene.add_body("wall", em.Cylinder(0.1, 0.2), mass=0, position=(0.5, 0.5, 0.1))
    scene.add_body("weight", brick((0.02, 0.03, 0.04)), mass=0.05, position=(-0.4, 0, 0.02))
    arm(scene)
    scene.add_spring(
        "weight", "tip", stiffness=0.5, rest_length=0.1, damping=0.01, point_a=(0.01, 0, 0.1 / 3)
    )
    scene.disable_collisions("weight", "tip")
    scene.set_friction("weight", "table", 1 / 3)
    scene.set_friction("dice", "cup", 0.0)
    contact = em.Contact(
        body_a="cup",
        body_b="tip",
        position=(0, 0.03, 0.02),
        normal=(0, 1, 0),
        distance=-1e-4,
        normal_force=1 / 3,
        tangential_force=(0.1, 0, 0),
        friction=0.42,
    )
    near = {
        "cup": em.regions.Ball("cup", center=(0, 0, 0), radius=0.002),
        "dice": em.regions.Ball("dice", center=(0.2, 0, -0.005), radius=0.002),
    }
    return em.Problem(
        scene,
        scene.pack(cup={"velocity": (0, 0.01, 0)}),
        force=(1, 0.5, 1 / 3),
        torque=(0, 0, 0.01),
        duration=0.1,
        captured=near,
        succeeded=regions(),
        within=em.regions.Ball("cup", center=(0, 0, 0), radius=2),
        rate=1 / 3,
        force_weights=em.ForceWeights(0.1, 1 / 3, 7, 0.01, 0.02),
        contacts=[contact],
    )


ROWS = 9


def rows(seed, *columns):
    """Rows of a plan whose numbers have many digits."""
    return np.random.default_rng(seed).normal(scale=0.01, size=(ROWS, *columns))


def planned_problem():
    """The same with a horizon, and a plan of all that a plan can have."""
    step = full_problem().scene.step
    plan = em.Plan(
        step=2 * step,
        wrenches={"weight": rows(1, 6), "upper": rows(2, 6)},
        targets={"hinge": rows(3)},
        velocities={"cup": rows(4, 6), "weight": rows(5, 6)},
        limits={"weight": (1 / 3, 0.01)},
    )
    return full_problem().replace(horizon=13 * step, plan=plan, check=4 * step, dwell=5 * step)


def run(*arguments):
    command = [EXECUTABLE, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def at_path(json_value, path):
    for key in path:
        json_value = json_value[key]
    return json_value
