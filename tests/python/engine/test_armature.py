"""Armature, the inertia of a drive's rotor: by hand, against MuJoCo, in files, and refused."""

import json
import re

import jsonschema
import mujoco
import numpy as np
import pytest
from mjcf_models import MASS, joint, link, model

import energymargin as em
from energymargin.scenes import from_mjcf

FREE = '<body name="base" pos="0 0 1"><freejoint/>{}<geom size="0.05"/>{}</body>'
DRIVEN = '<joint name="{0}" axis="1 2 2" armature="0.02" stiffness="3" springref="60"/>'


def rod(armature=0.25, **options):
    """On a fixed post, horizontal: 0.3 kg, 0.5 m from the hinge about y to its centre."""
    scene = em.Scene()
    scene.add_body("post", em.Box((0.1, 0.1, 0.1)), mass=0.0, position=(0, 0, 1))
    inertial = em.Inertial((0.5, 0, 0), inertia=np.diag((0.01, 0.02, 0.02)))
    scene.add_body("rod", em.Sphere(0.05), mass=0.3, inertial=inertial)
    turned = {"parent": "post", "child": "rod", "axis": (0, 1, 0), "armature": armature, **options}
    scene.add_joint("hinge", **turned)
    return scene


def problem(scene):
    scene.add_body("cup", em.Sphere(0.1), mass=1.0, position=(0, 0, 1.15), role="object")
    return em.Problem(
        scene,
        scene.pack(),
        force=(1, 0, 0),
        torque=(0, 0, 0),
        duration=0.1,
        captured=em.regions.Ball("cup", (0, 0, 1.15), 1.0),
    )


@pytest.mark.parametrize("armature", [0.0, 0.25])
def test_a_rod_falls_by_its_weight_over_its_inertia_and_the_rotor_s(armature):
    scene = rod(armature)
    (end,) = em.World(scene).simulate(scene.pack(), 1, record=[1]).states
    inertia = 0.02 + 0.3 * 0.5**2 + armature
    velocity = end[scene.joint_slice("hinge").start + 1]
    assert velocity / scene.step == pytest.approx(0.3 * 9.81 * 0.5 / inertia, rel=1e-8)


def compared(of, velocities, seconds=0.2, step=2e-5):
    """States of a model after so long: the library's, MuJoCo's."""
    of.opt.timestep, of.opt.integrator = step, mujoco.mjtIntegrator.mjINT_RK4
    gravity = from_mjcf(of).gravity
    fine = em.Scene(gravity, step=step, friction_rule="max")
    from_mjcf(of, fine)
    data = mujoco.MjData(of)
    data.qvel[:] = velocities
    steps = round(seconds / step)
    start = em.mujoco.state(fine, of, data)
    (end,) = em.World(fine).simulate(start, steps, record=[steps]).states
    mujoco.mj_step(of, data, steps)
    return end, em.mujoco.state(fine, of, data)


def test_a_hinge_with_armature_swings_as_in_mujoco():
    ours, theirs = compared(model(link("a", joint='<joint axis="0 1 0" armature="0.01"/>')), [0.5])
    assert ours == pytest.approx(theirs, abs=1e-3)
    other, _ = compared(model(link("a", joint='<joint axis="0 1 0"/>')), [0.5])
    assert np.abs(other - theirs).max() > 0.01


def test_a_free_tree_that_a_spring_with_a_rotor_drives_moves_as_in_mujoco():
    of = model(FREE.format(MASS, link("a", joint=DRIVEN, at="0.2 0 0")))
    ours, theirs = compared(of, [0.3, -0.2, 0.1, 0.5, -1.0, 0.8, 2.0])
    assert ours == pytest.approx(theirs, abs=5e-3)
    of.dof_armature[-1] = 0.0
    other, _ = compared(of, [0.3, -0.2, 0.1, 0.5, -1.0, 0.8, 2.0])
    assert np.abs(other - theirs).max() > 0.1


def test_armature_of_a_free_joint_is_named():
    inside = f'<body name="a"><joint type="free" armature="1"/>{MASS}<geom size="0.1"/></body>'
    with pytest.raises(ValueError, match=r"not simulated: joint\.armature \(1\)"):
        from_mjcf(model(inside))


def test_the_twin_in_mujoco_has_it():
    assert em.mujoco.model_of(rod()).dof_armature == pytest.approx([0.25], abs=0)


def test_files_keep_it():
    fields = json.loads(problem(rod()).to_json())
    assert fields["version"] == 6
    assert em.Problem.from_json(json.dumps(fields)).scene.joints[0].armature == 0.25
    assert jsonschema.Draft7Validator(em.Problem.schema()).is_valid(fields)
    fields["version"] = 4
    with pytest.raises(
        ValueError, match=re.escape('scene.joints[0] has "armature", expected only')
    ):
        em.Problem.from_json(json.dumps(fields))
    assert not jsonschema.Draft7Validator(em.Problem.schema()).is_valid(fields)
    without = json.loads(problem(rod(0.0)).to_json())
    assert without["version"] == 6
    assert "armature" not in without["scene"]["joints"][0]


@pytest.mark.parametrize("armature", [-1.0, float("nan"), float("inf")])
def test_an_armature_that_cannot_be_is_refused(armature):
    with pytest.raises(ValueError, match="armature"):
        rod(armature)


def test_a_joint_that_is_fixed_has_none():
    with pytest.raises(ValueError, match=r"armature is 0\.25, expected 0: the joint is fixed"):
        rod(type="fixed")


def test_a_held_joint_may_have_one():
    assert joint(rod(held=True), "hinge").armature == 0.25
