"""Soft pads: the torque of an even pressure over a patch, however the load is spread on it."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import energymargin as em
from energymargin.mujoco import to_mjcf

FORCE, FRICTION = 15.0, 0.5
SIDE = 0.02  # m, of a square pad
PAD = em.Pad(load=FORCE)
SQUARE = (
    math.sqrt(2) + math.asinh(1)
) / 6  # mean distance from the middle of a square, by its side


def add_fingers(scene, tip, surface, *, mass, **drive):
    """Two fingers below the palm that close along x."""
    for name, side in (("left", -1), ("right", 1)):
        scene.add_body(name, tip, mass=mass, friction=1.0, surface=surface)
        ends = {"parent": "palm", "child": name, "origin": (side * 0.05, 0, -0.2)}
        way = {"type": "prismatic", "axis": (-side, 0, 0), "target": 0.045}
        scene.add_joint(name, **ends, **way, **drive)


def spin(torque, held, surface, tip=None, step=1 / 240):
    """Spin [rad/s] of what two fingers hold, after a torque about the line between them."""
    tip = tip or em.Box((0.01, SIDE, SIDE))
    scene = em.Scene(gravity=(0, 0, 0), step=step)
    scene.add_body("palm", em.Box((0.02,) * 3), mass=0, position=(0, 0, 0.4))
    scene.add_body("held", held, mass=1.0, position=(0, 0, 0.2), role="object", friction=FRICTION)
    drives = {"stiffness": 5000, "damping": 20, "torque_limit": FORCE}
    add_fingers(scene, tip, surface, mass=0.1, start=0.02, **drives)
    count = round(0.5 / step)
    drive = np.zeros((count, 6))
    drive[count // 4 :, 3] = torque
    end = em.World(scene).simulate(scene.pack(), count, drives={"held": drive}).states[-1]
    return np.linalg.norm(scene.unpack(end)["held"]["angular_velocity"])


def in_frame(shape, turn):
    return em.Compound([em.Part(shape, orientation=turn)])


ACROSS = (0, math.sin(math.pi / 4), 0, math.cos(math.pi / 4))  # z along x
BAR = em.Box((0.05, 0.2, 0.2))
NARROW = em.Box((0.05, 0.2, 0.01))  # on half of the pads
LEVERS = {
    "square": (BAR, SQUARE * SIDE),
    "half": (NARROW, 0.01 * 0.5932),  # of 1 by 2, by its shorter side
    "disc": (in_frame(em.Cylinder(radius=0.009, length=0.05), ACROSS), 0.009 * 2 / 3),
    "line": (em.Cylinder(radius=0.025, length=0.2), SIDE / 4),
    "point": (em.Sphere(0.025), PAD.radius * 2 / 3),
}


@pytest.mark.parametrize("held", LEVERS)
@pytest.mark.parametrize("step", [1 / 240, 1 / 960])
def test_a_pad_resists_a_turn_as_an_even_pressure_does(held, step):
    shape, lever = LEVERS[held]
    most = 2 * FRICTION * FORCE * lever
    within = 0.02
    assert spin((1 - within) * most, shape, PAD.surface(), step=step) < 2e-2
    assert spin((1 + within) * most, shape, PAD.surface(), step=step) > 0.05


def test_a_square_pad_of_two_centimetres_holds_115_mN_m_and_a_rigid_one_its_corners_212():
    assert pytest.approx(0.1148, abs=1e-4) == 2 * FRICTION * FORCE * SQUARE * SIDE
    assert spin(0.117, BAR, PAD.surface()) > 0.05
    assert spin(0.205, BAR, em.Surface()) < 2e-2


def test_a_pad_slides_at_coulomb_s_limit():
    for share, slides in ((0.97, False), (1.03, True)):
        scene = em.Scene()
        scene.add_plane("floor")
        block = em.Box((0.04, 0.04, 0.02))
        scene.add_body("block", block, mass=0.2, position=(0, 0, 0.01), surface=PAD.surface())
        scene.set_friction("block", "floor", 0.4)
        push = np.zeros((120, 6))
        push[:, 0] = share * 0.4 * 0.2 * 9.81
        end = em.World(scene).simulate(scene.pack(), 120, drives={"block": push}).states[-1]
        assert (scene.unpack(end)["block"]["position"][0] > 1e-3) == slides


def swung(degrees, surface, step):
    """By how much [rad] a bar swings between pads in a second whose faces are off by an angle."""
    slope, corners = math.tan(math.radians(degrees) / 2), []
    for x, y, z in product([-1, 1], [-0.05, 0.05], [-0.03, 0.03]):
        corners.append((x * (0.02 + slope * (y + 0.7 * z)), y, z))
    scene = em.Scene(step=step)
    scene.add_body("palm", em.Box((0.02,) * 3), mass=0, position=(0, 0, 0.4))
    bar, at = em.ConvexHull(corners), (0, 0.02, 0.2)  # held off its middle
    scene.add_body("bar", bar, mass=0.4, position=at, role="object", friction=0.8)
    drives = {"stiffness": 4e4, "damping": 90, "torque_limit": 40}
    add_fingers(scene, em.Box((0.012, 0.02, 0.02)), surface, mass=0.05, start=0.0238, **drives)
    done = em.World(scene).simulate(scene.pack(), round(1 / step))
    assert done.lost_time == 0
    assert done.unconverged <= 1e-3 * done.steps
    turned = scene.unpack(done.states[-1])["bar"]["orientation"]
    return 2 * math.asin(min(1.0, abs(turned[0])))


@pytest.mark.parametrize("degrees", [0.13, 0.5])
def test_a_face_that_is_off_by_a_little_is_held_at_any_step(degrees):
    for step in (1 / 240, 1 / 960, 1 / 3840):
        assert swung(degrees, replace(PAD, load=40).surface(), step) < 2e-3
    assert swung(degrees, em.Surface(), 1 / 960) > 0.3  # about its two corners


def test_the_patch_of_something_round_is_that_of_a_bed_of_springs():
    pad, depth = em.Pad(thickness=0.003, modulus=2e6, load=30, curvature=0.04), 1e-9
    bed, rest = 2e6 / 0.003, 0.0
    while rest < 30:  # of a sphere that is pressed in by a depth
        depth += 1e-6
        rest = math.pi * bed * 0.04 * depth**2
    assert pad.radius == pytest.approx(0.8 * math.sqrt(2 * 0.04 * depth), rel=2e-3)


def test_a_pad_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match="modulus is 0"):
        em.Pad(modulus=0)
    with pytest.raises(ValueError, match="patch_radius is -1"):
        em.Scene().add_body("tip", em.Sphere(0.01), mass=1, surface=em.Surface(patch_radius=-1))


def test_mujoco_has_the_torsional_friction_of_the_smallest_patch():
    scene = em.Scene()
    scene.add_plane("floor", friction=1.0)
    scene.add_body("ball", em.Sphere(0.02), mass=0.1, friction=0.5, surface=PAD.surface())
    text = to_mjcf(scene)
    assert 'condim="4"' in text
    assert f"{0.5 * 2 / 3 * PAD.radius:.6g}"[:6] in text
