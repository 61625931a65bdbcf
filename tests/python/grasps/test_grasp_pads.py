"""Soft fingers: what a grip of nearly parallel faces holds, at any step; who has pads."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from urdf_files import BOX, INERTIAL, built, chain, joint, link

import energymargin as em
from energymargin.cli.grasp_words import chosen_hand
from energymargin.grasps import GraspObject, GraspSet, Motion, ParallelGripper, Protocol, score
from energymargin.grasps.hands import PANDA, PRESETS

HAND = ParallelGripper(opening=0.08, pad=(0.02, 0.02), force=20.0, pads=em.Pad())
TURNING = Protocol([Motion("hold", 0.5)], angle=0.15)
STEPS = (1 / 240, 1 / 960, 1 / 3840)


def can(degrees):
    """A box whose two faces are off by an angle: it is gripped off its middle."""
    slope = np.tan(np.radians(degrees) / 2)
    corners = [
        (x * (0.02 + slope * (y + 0.7 * z)), y, z)
        for x, y, z in product([-1, 1], [-0.05, 0.05], [-0.03, 0.03])
    ]
    return GraspObject(em.ConvexHull(corners), mass=0.35, friction=0.8)


def held(hand, step):
    """The share of trials that hold, of grasps at several places."""
    poses = np.array([np.diag([1.0, -1.0, -1.0, 1.0])] * 3)
    poses[:, 1, 3], poses[:, 2, 3] = (0.02, 0.025, 0.03), 0.01
    belief = em.grasps.GraspBelief(pose=[1e-3] * 3 + [5e-3] * 3)
    scores = score(GraspSet(poses), hand, can(0.13), TURNING, belief=belief, rollouts=4, step=step)
    assert scores.lost_time.sum() == 0
    assert scores.unconverged.sum() <= 1e-3 * scores.steps.sum()
    return scores.probabilities


def test_soft_fingers_hold_nearly_parallel_faces_alike_at_any_step():
    soft = [held(HAND, step) for step in STEPS]
    assert np.mean(soft[0]) > 0.9
    for other in soft[1:]:
        assert other == pytest.approx(soft[0], abs=0.02)
    assert np.mean(held(replace(HAND, pads=None), STEPS[1])) < 0.7


def test_presets_are_soft_and_a_pad_is_that_of_the_grip_s_force():
    assert all(hand.pads == em.Pad() for hand in PRESETS.values())
    for force, radius in ((40.0, 5.81e-3), (10.0, 4.11e-3)):
        scene = em.Scene()
        replace(PANDA, pads=em.Pad()).add_to(scene, force=force, opening=np.nan)
        finger = next(body for body in scene.bodies if body.name == "left")
        assert finger.surface.patch_radius == pytest.approx(radius, abs=5e-6)


def test_a_patch_is_no_larger_than_the_finger():
    scene = em.Scene()
    replace(HAND, pad=(0.006, 0.02)).add_to(scene, force=20, opening=np.nan)
    assert scene.bodies[1].surface.patch_radius == 0.003


def test_rigid_fingers_are_another_hand_and_say_so():
    rigid = replace(HAND, pads=None)
    assert "pads" not in rigid.text
    assert HAND.text["pads"]["thickness"] == 0.002
    with pytest.raises(ValueError, match=r"pads is 0\.002, expected an em\.Pad, or None"):
        ParallelGripper(opening=0.08, pads=0.002)


def test_a_command_takes_pads():
    assert chosen_hand('{"preset": "panda", "pads": null}').pads is None
    assert chosen_hand('{"preset": "panda", "pads": {"thickness": 0.003}}').pads == em.Pad(0.003)
    file = {"path": "hand.urdf", "close": {"j": [0, 1]}, "fingers": ["tip"]}
    assert chosen_hand(json.dumps(file | {"pads": {"tip": {}}})).pads == {"tip": em.Pad()}
    assert chosen_hand(json.dumps(file | {"pads": None})).pads is None
    with pytest.raises(ValueError, match=r"--hand pads is \[1\]"):
        chosen_hand(json.dumps(file | {"pads": [1]}))
    with pytest.raises(ValueError, match=r"--hand pads has 'depth'"):
        chosen_hand('{"preset": "panda", "pads": {"depth": 0.003}}')


def test_links_of_a_file_have_the_pads_that_are_named(tmp_path):
    soft = "<contact><stiffness value='3000'/><damping value='10'/></contact>"
    text = chain(joint("slides", "a", "b"), links="a") + link("b", INERTIAL + BOX + soft)
    text = text.replace("</robot>", "") + "</robot>"
    scene = built(tmp_path, text, prefix="my/", pads={"b": em.Pad(load=30)})
    a, b = scene.bodies
    assert a.surface is None
    assert b.surface.patch_radius == em.Pad(load=30).radius
    assert b.surface.stiffness == 3000
    with pytest.raises(ValueError, match=r"pads is \['b'\], expected links and their em\.Pad"):
        built(tmp_path, text, pads=["b"])
    with pytest.raises(ValueError, match="pads has 'c', expected one of a, b"):
        built(tmp_path, text, prefix="my/", pads={"c": em.Pad()})


def test_bodies_of_a_model_have_the_pads_that_are_named():
    model = """<mujoco><worldbody><body name="tip"><joint type="slide"/><geom size=".01"/>
        <geom size=".01" pos=".1 0 0" contype="2" conaffinity="2" friction=".3"/></body>
        <geom type="box" size="1 1 .1" pos="0 0 -1" contype="3" conaffinity="3"/>
        </worldbody></mujoco>"""
    scene = em.scenes.from_mjcf(model, pads={"tip": em.Pad()})
    tips = [body for body in scene.bodies if body.name.startswith("tip")]
    assert len(tips) == 2
    assert all(body.surface.patch_radius == em.Pad().radius for body in tips)
