"""Grips that go on: of several solutions of a step the one that the state is in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import energymargin as em

HALF = 0.02  # of what is gripped, across [m]
STEP = 1 / 240


def leaning_grip(
    gravity: float,
    *,
    lean: float,
    force: float,
    armature: float,
    joints: int = 1,
    wrist: dict[str, object] | None = None,
    jaw_friction: float = 0.0,
    step: float = STEP,
) -> em.Scene:
    """Two jaws on rails press a body whose sides lean [rad] so that gravity would take it out."""
    scene = em.Scene(gravity=(0, 0, gravity), step=step, friction_rule="max")
    scene.add_body("base", em.Box((0.02,) * 3), mass=0, position=(-0.3, 0, 0.1))
    parent = "base"
    servo = {"stiffness": 50.0, "damping": 4.6, "armature": 0.1}
    for i in range(joints):
        scene.add_body(f"arm{i}", em.Box((0.02,) * 3), mass=0.07)
        scene.add_joint(
            f"a{i}",
            parent=parent,
            child=f"arm{i}",
            axis=(0, 1, 0),
            child_origin=(-0.3 / joints, 0, 0),
            **servo | (wrist or {}),
        )
        parent = f"arm{i}"
    slope = np.tan(lean)
    corners = [
        (x, way * (HALF - z * slope), z)
        for x in (-HALF, HALF)
        for way in (-1, 1)
        for z in (-0.03, 0.03)
    ]
    scene.add_body("thing", em.ConvexHull(corners), mass=0.1, friction=1.0, role="object")
    at = np.array([0.0 if joints else 0.3, 0.0, -0.1])
    for way, name in ((1, "left"), (-1, "right")):
        scene.add_body(name, em.Box((0.03, 0.01, 0.03)), mass=0.012, friction=1.0)
        scene.add_joint(
            name,
            type="prismatic",
            parent=parent,
            child=name,
            axis=(0, -way, 0),
            origin=(at[0], way * (HALF + 0.005 / np.cos(lean)), at[2]),
            child_orientation=(-np.sin(way * lean / 2), 0, 0, np.cos(lean / 2)),
            stiffness=1e4,
            damping=50.0,
            torque_limit=force,
            target=0.05,
            armature=armature,
            friction=jaw_friction,
        )
    scene.disable_collisions("left", "right")
    return scene


def way_of_the_thing(
    joints: int = 1, step: float = STEP, pressed_before: bool = True, **settings: object
) -> float:
    """How far it sinks against the wrist in a second, after the jaws pressed it, or only touched it
    [m]."""
    before = leaning_grip(0.0, joints=joints, step=step, **settings)
    after = leaning_grip(-9.81, joints=joints, step=step, **settings)
    second = round(1.0 / step)
    first = after.pack()
    if pressed_before:
        first = em.World(before).simulate(before.pack(), second // 2).states[-1]
    run = em.World(after).simulate(first, second, record=[0, second])
    assert run.unconverged == 0
    start, end = (after.unpack(state) for state in run.states)
    ways = [
        end[name]["position"][2] - start[name]["position"][2]
        for name in ("thing", *([f"arm{joints - 1}"] if joints else []))
    ]
    return float(abs(ways[0] - sum(ways[1:])))


@pytest.mark.parametrize(
    "wrist",
    [
        {},
        {"friction": 0.01},
        {"friction": 0.1},
        {"friction": 1.0},
        {"torque_limit": 0.3, "limits": (-0.05, 0.05)},
        {"limits": (-0.05, 0.005)},
    ],
)
def test_what_stops_in_the_wrist_does_not_open_a_grip(wrist: dict[str, object]) -> None:
    assert way_of_the_thing(lean=0.1, force=10.0, armature=20.0, wrist=wrist) < 1e-3


@pytest.mark.parametrize("lean", [0.03, 0.1, 0.2])
@pytest.mark.parametrize("armature", [0.0, 10.0, 100.0])
@pytest.mark.parametrize("joints", [0, 3])
def test_heavy_jaws_hold_what_leans_away_from_them(
    lean: float, armature: float, joints: int
) -> None:
    settings = {"lean": lean, "force": 30.0, "armature": armature, "joints": joints}
    assert way_of_the_thing(**settings, wrist={"friction": 0.05}, jaw_friction=0.3) < 1e-3


@pytest.mark.parametrize("joints", [0, 1, 2])
@pytest.mark.parametrize("armature", [10.0, 50.0])
def test_a_grip_that_is_handed_over_without_a_preload_holds(joints: int, armature: float) -> None:
    """Jaws of 50 kg that touch what leans away from them press it, as statics says."""
    settings = {"lean": 0.16, "force": 30.0, "armature": armature, "joints": joints}
    assert way_of_the_thing(**settings, pressed_before=False) < 1e-3


@pytest.mark.parametrize("step", [1 / 120, 1 / 960])
def test_a_grip_stays_at_any_step(step: float) -> None:
    settings = {"lean": 0.1, "force": 10.0, "armature": 50.0, "wrist": {"friction": 0.1}}
    assert way_of_the_thing(step=step, **settings) < 1e-3


def test_a_grip_that_is_too_weak_lets_go() -> None:
    settings = {"lean": 0.1, "force": 0.3, "armature": 20.0, "wrist": {"friction": 0.1}}
    assert way_of_the_thing(**settings) > 0.1


def hand(links: int, friction: float, torsion: float = 0.0) -> em.Scene:
    """Three fingers whose joints have dry friction [N m] close on a cylinder."""
    scene = em.Scene()
    radius, length = 0.03, 0.14 / links
    scene.add_body("palm", em.Box((0.1, 0.1, 0.02)), mass=0, position=(0, 0, 0.3))
    scene.add_body(
        "can",
        em.Cylinder(radius=radius, length=0.2),
        mass=0.5,
        position=(0, 0, 0.289 - radius),
        orientation=(0.5**0.5, 0, 0, 0.5**0.5),
        friction=1,
        role="object",
        surface=em.Surface(torsional_friction=torsion),
    )
    for finger, (side, y) in enumerate(((-1, -0.04), (1, 0), (-1, 0.04))):
        parent = "palm"
        for i in range(links):
            name = f"{finger} {i}"
            shape = em.Box((0.008, 0.012, length - 0.002))
            scene.add_body(name, shape, mass=0.07 / links, friction=0.8, role="effector")
            first = i == 0
            scene.add_joint(
                f"joint {name}",
                parent=parent,
                child=name,
                axis=(0, 1, 0),
                origin=(side * (radius + 0.012), y, -0.01) if first else (0, 0, -length / 2),
                child_origin=(0, 0, length / 2),
                target=0 if first else side * 5.4 / (links - 1),
                stiffness=2,
                damping=0.02,
                torque_limit=0.4,
                start=0 if first else side * 0.05,
                friction=friction,
            )
            parent = name
    return scene


@pytest.mark.parametrize("friction", [1e-4, 1e-3, 1e-2, 0.05])
@pytest.mark.parametrize("links", [3, 4, 7])
def test_hands_whose_joints_rub_converge(links: int, friction: float) -> None:
    scene = hand(links, friction)
    assert em.World(scene).simulate(scene.pack(), 240, record=[240]).unconverged == 0


def test_pads_that_twist_converge() -> None:
    scene = hand(4, 1e-3, torsion=0.003)
    assert em.World(scene).simulate(scene.pack(), 240, record=[240]).unconverged == 0


def test_a_hand_of_24_joints_makes_and_opens_a_fist_in_steps_that_converge() -> None:
    robotics = pytest.importorskip("gymnasium_robotics")
    mujoco = pytest.importorskip("mujoco")
    file = Path(robotics.__file__).parent / "envs/assets/adroit_hand/adroit_pen.xml"
    scene = em.scenes.from_mjcf(mujoco.MjModel.from_xml_path(str(file)), mimic_limits="leader")
    driven = {joint.name: joint.limits for joint in scene.joints if joint.stiffness > 0}
    assert len(driven) == 24
    there, still = np.linspace(0, 1, 240), np.ones(60)
    way = np.concatenate([there, still, 1 - there, 0 * still])
    starts = {name: np.clip(0, *ends) for name, ends in driven.items()}
    fist = {name: at + way * (driven[name][1] - at) for name, at in starts.items()}
    world = em.World(scene, em.Plan(scene.step, targets=fist))
    assert world.simulate(scene.pack(), len(way)).unconverged == 0  # 11 without softer contacts


def tower_in_a_hurry(mass: float) -> em.Scene:
    """Five cubes, a little in each other, and a solver that may hardly iterate."""
    scene = em.Scene(solver_iterations=1)
    scene.add_plane("floor")
    for i in range(5):
        place = (0.0, 0.0, 0.05 + 0.0999 * i)
        scene.add_body(f"cube {i}", em.Box((0.1,) * 3), mass=mass, position=place, role="object")
    return scene


def test_a_simulation_and_a_rollout_warn_of_steps_that_did_not_converge() -> None:
    scene = tower_in_a_hurry(1.0)
    with pytest.warns(em.PlausibilityWarning, match="did not converge in"):
        em.World(scene).simulate(scene.pack(), 30)
    scene = tower_in_a_hurry(2.0)  # each scene warns once
    with pytest.warns(em.PlausibilityWarning, match="did not converge in"):
        em.World(scene).rollout(scene.pack(), np.zeros((5, 6)), 30 * scene.step)
