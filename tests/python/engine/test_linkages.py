"""Linkages: momenta, energy, and what holds their joints."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import energymargin as em

LINKS = {"base": (0.1, 0.08, 0.06), "upper": (0.02, 0.03, 0.1), "lower": (0.02, 0.03, 0.1)}


AT_HIP = {
    "stop": {"limits": (-0.3, 0.3)},
    "dry friction": {"friction": 0.02},
    "drive": {"stiffness": 1.0, "damping": 0.02, "target": 0.5},
    "weak drive": {"stiffness": 1.0, "damping": 0.02, "target": 0.5, "torque_limit": 0.05},
}
FEATURES = ("mimic", "tendon", "loop", *AT_HIP)


def linkage(*features: str) -> em.Scene:
    """A base and two links that fly and turn, and what acts on their joints."""
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(
        "base",
        em.Box(LINKS["base"]),
        mass=1.0,
        velocity=(0.3, -0.2, 0.1),
        angular_velocity=(2.0, -3.0, 1.0),
        role="object",
    )
    for name, mass in (("upper", 0.6), ("lower", 0.4)):
        scene.add_body(name, em.Box(LINKS[name]), mass=mass)
    below = (0.0, 0.0, 0.05)
    hip: dict[str, object] = {"axis": (0.0, 1.0, 0.0), "start_velocity": 6.0}
    knee: dict[str, object] = {"axis": (1.0, 0.0, 0.0)}
    knee |= {"mimic": em.Mimic("hip", -0.7)} if "mimic" in features else {"start_velocity": -4.0}
    for feature in features:
        hip |= AT_HIP.get(feature, {})
    scene.add_joint(
        "hip", parent="base", child="upper", origin=(0.06, 0.0, -0.05), child_origin=below, **hip
    )
    scene.add_joint(
        "knee", parent="upper", child="lower", origin=(0.0, 0.0, -0.05), child_origin=below, **knee
    )
    if "tendon" in features:
        scene.add_tendon("tendon", {"hip": 1.0, "knee": 0.6}, friction=0.02, stiffness=0.5)
    if "loop" in features:
        scene.add_body("towed", em.Box((0.03, 0.03, 0.03)), mass=0.3, position=(0.0, 0.0, 0.2))
        scene.add_loop("base", "towed", point_a=(0.0, 0.0, 0.1), point_b=(0.0, 0.0, -0.1))
    names = [body.name for body in scene.bodies]
    for i, name in enumerate(names):
        for other in names[i + 1 :]:
            scene.disable_collisions(name, other)
    return scene


def momenta(scene: em.Scene, state: np.ndarray) -> np.ndarray:
    """Of all boxes, linear and about the origin [kg m/s and kg m^2/s]."""
    bodies = scene.unpack(state)
    sizes = LINKS | {"towed": (0.03, 0.03, 0.03)}
    linear, angular = np.zeros(3), np.zeros(3)
    for body in scene.bodies:
        at = bodies[body.name]
        squares = np.square(sizes[body.name])
        moments = body.mass / 12.0 * (squares.sum() - squares)
        axes = Rotation.from_quat(at["orientation"]).as_matrix()
        linear += body.mass * at["velocity"]
        angular += body.mass * np.cross(at["position"], at["velocity"])
        angular += axes @ (moments * (axes.T @ at["angular_velocity"]))
    return np.concatenate([linear, angular])


SETS = [some for size in range(3) for some in itertools.combinations(FEATURES, size)]


@pytest.mark.parametrize("features", SETS, ids=" and ".join)
def test_a_free_linkage_keeps_its_momenta(features: tuple[str, ...]) -> None:
    scene = linkage(*features)
    played = em.World(scene).simulate(scene.pack(), steps=1201, record=list(range(1, 1202, 40)))
    start, *later = (momenta(scene, state) for state in played.states)
    change = np.max([np.abs(each - start) for each in later], axis=0)
    assert np.max(change[:3]) < 3e-6 * np.linalg.norm(start[:3])
    assert np.max(change[3:]) < 3e-6 * np.linalg.norm(start[3:])


def pendulum(feature: str) -> float:
    """How much the energy of an undamped double pendulum changes in 10 s, a share of its fall."""
    scene = em.Scene()
    scene.add_body("post", em.Box((0.02, 0.02, 0.02)), mass=0)
    for name, mass in (("upper", 0.5), ("lower", 0.3)):
        scene.add_body(name, em.Box((0.02, 0.02, 0.2)), mass=mass)
    joint = {"axis": (0.0, 1.0, 0.0), "child_origin": (0.0, 0.0, 0.1)}
    joint |= {"limits": (-10.0, 10.0)} if feature == "limits" else {}
    after = {"mimic": em.Mimic("upper", 0.8)} if feature == "mimic" else {"start": 0.5}
    scene.add_joint("upper", parent="post", child="upper", start=1.5, **joint)
    joint = {key: value for key, value in joint.items() if feature != "mimic" or key != "limits"}
    scene.add_joint(
        "lower", parent="upper", child="lower", origin=(0.0, 0.0, -0.1), **joint, **after
    )
    scene.disable_collisions("post", "lower")
    world = em.World(scene)
    states = world.simulate(scene.pack(), steps=2400, record=list(range(0, 2401, 8))).states
    energies = np.array([world.energy(state) for state in states])
    return float(np.max(np.abs(energies - energies[0]))) / 2.35


@pytest.mark.parametrize("feature", ["none", "mimic", "limits"])
def test_a_double_pendulum_keeps_its_energy(feature: str) -> None:
    assert pendulum(feature) < 1e-4


def slid(**control: object) -> float:
    """Where a slider gets in 1 s, on a base that spins at 20 rad/s, 0.1 m from its axis [m]."""
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(
        "base", em.Box((0.1, 0.1, 0.1)), mass=5.0, angular_velocity=(0.0, 0.0, 20.0), role="object"
    )
    scene.add_body("slider", em.Box((0.02, 0.02, 0.02)), mass=0.1)
    along = {"type": "prismatic", "axis": (1.0, 0.0, 0.0), "origin": (0.1, 0.0, 0.0)}
    scene.add_joint("slide", parent="base", child="slider", **along, **control)
    scene.disable_collisions("base", "slider")
    end = em.World(scene).simulate(scene.pack(), steps=240, record=[240]).states[0]
    return float(scene.unpack(end)["joints"]["slide"]["position"])


def test_what_holds_a_slider_on_a_spinning_base_holds() -> None:
    assert abs(slid(friction=500.0)) < 5e-6
    assert abs(slid(limits=(-0.01, 0.0))) < 1e-6
    drive = {"stiffness": 1e5, "damping": 100.0}
    assert slid(**drive) == pytest.approx(3.92e-5, rel=0.01)  # 0.1 kg at 0.098 m from the centre
    assert slid(**drive, torque_limit=1000.0) == pytest.approx(3.92e-5, rel=0.01)


def turned(turning: str, limit: float) -> float:
    """Where a driven arm stays on a base that turns at 10 rad/s [rad]."""
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    kind = {"kinematic": True} if turning == "kinematic" else {"role": "object"}
    spin = (0.0, 0.0, 10.0)
    scene.add_body("base", em.Box((1.0, 1.0, 1.0)), mass=3000.0, angular_velocity=spin, **kind)
    scene.add_body("arm", em.Box((0.2, 0.03, 0.03)), mass=0.3)
    scene.add_joint(
        "shoulder",
        parent="base",
        child="arm",
        axis=(0.0, 1.0, 0.0),
        origin=(0.05, 0.0, 0.0),
        child_origin=(-0.1, 0.0, 0.0),
        start=0.5,
        target=0.5,
        stiffness=2.0,
        damping=0.05,
        torque_limit=limit,
    )
    scene.disable_collisions("base", "arm")
    end = em.World(scene).simulate(scene.pack(), steps=960, record=[960]).states[0]
    return float(scene.unpack(end)["joints"]["shoulder"]["position"])


@pytest.mark.parametrize("turning", ["kinematic", "free"])
@pytest.mark.parametrize("limit", [math.inf, 3.0])
def test_a_drive_on_a_turning_base_gives_way_to_what_turns(turning: str, limit: float) -> None:
    def moment(angle: float) -> float:  # of the drive and of what pulls the arm outwards [N m]
        along, across = 0.3 / 12 * (0.2**2 + 0.03**2), 0.3 / 12 * 2 * 0.03**2
        about = -2 * 0.3 * (0.05 + 0.1 * math.cos(angle)) * 0.1 * math.sin(angle)
        about += (across - along) * math.sin(2 * angle)
        return 2.0 * (0.5 - angle) + 0.5 * 10.0**2 * about

    assert turned(turning, limit) == pytest.approx(brentq(moment, 0.0, 0.6), abs=0.003)


@pytest.mark.parametrize("share", [0.9, 0.97])
def test_dry_friction_holds_an_arm_whatever_comes_and_goes(share: float) -> None:
    length, mass = 0.3, 0.4
    scene = em.Scene()
    scene.add_body("base", em.Box((0.1, 0.1, 0.1)), mass=0)
    scene.add_body("arm", em.Box((length, 0.03, 0.03)), mass=mass, role="object")
    scene.add_joint(
        "shoulder",
        parent="base",
        child="arm",
        axis=(0.0, 1.0, 0.0),
        child_origin=(-length / 2, 0.0, 0.0),
        friction=mass * 9.81 * length / 2 / share,
    )
    scene.disable_collisions("base", "arm")
    pulls = np.zeros((480, 6))
    pulls[::2, 2] = 1e-9
    world = em.World(scene)
    end = world.simulate(scene.pack(), steps=480, record=[480], drives={"arm": pulls}).states[0]
    joint = scene.unpack(end)["joints"]["shoulder"]
    assert abs(joint["position"]) < 1e-5
    assert abs(joint["velocity"]) < 1e-5


def passed_by(seed: int, speed: float) -> float:
    """By how much the joints of a chain of three links, without gravity, pass their stops [rad]."""
    random = np.random.default_rng(seed)
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body("base", em.Box((0.1, 0.1, 0.1)), mass=0)
    names = ["base"]
    for mass in random.uniform(0.05, 1.0, 3):
        names.append(f"link {len(names)}")
        scene.add_body(names[-1], em.Box((0.02, 0.02, 0.1)), mass=mass)
    for parent, child in itertools.pairwise(names):
        axis = random.normal(size=3)
        scene.add_joint(
            child,
            parent=parent,
            child=child,
            axis=axis / np.linalg.norm(axis),
            origin=(0.0, 0.0, -0.05),
            child_origin=(0.0, 0.0, 0.05),
            start_velocity=speed * random.normal(),
            limits=(-0.8, 0.8),
        )
    for name, other in itertools.combinations(names, 2):
        scene.disable_collisions(name, other)
    states = em.World(scene).simulate(scene.pack(), steps=60).states
    joints = [scene.unpack(state)["joints"].values() for state in states]
    return max(abs(joint["position"]) - 0.8 for each in joints for joint in each)


def test_stops_are_not_passed_by_chains_that_swing_fast() -> None:
    assert max(passed_by(seed, speed=10.0) for seed in range(30)) < 1e-4


def box_thrown() -> em.Scene:
    scene = em.Scene()
    scene.add_plane("floor")
    scene.add_body(
        "box",
        em.Box((0.1, 0.12, 0.07)),
        mass=1.0,
        position=(0.0, 0.0, 0.3),
        velocity=(0.3, 0.1, 0.0),
        angular_velocity=(3.0, 1.0, 2.0),
        role="object",
    )
    return scene


@pytest.mark.parametrize("scene", [box_thrown(), linkage("mimic"), linkage("loop")])
def test_a_simulation_that_is_cut_goes_on_to_the_same_bits(scene: em.Scene) -> None:
    world = em.World(scene)
    whole = world.simulate(scene.pack(), steps=200, record=[77, 78, 200]).states
    rest = world.simulate(whole[0], steps=123, record=[1, 123]).states
    assert np.array_equal(rest[0], whole[1])
    assert np.array_equal(rest[1], whole[2])
