"""Scenes as models of MuJoCo: the same poses, masses, friction and motion, or an error."""

import mujoco
import numpy as np
import pytest

import energymargin as em
from energymargin.mujoco.states import States

TASKS = ("push", "balance", "topple", "grasp", "push-multi", "scoop", "push-real")


def at_start(scene, state=None, **options):
    model = em.mujoco.model_of(scene, state, **options)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data


def with_object(**body):
    scene = em.Scene()
    scene.add_plane("floor", friction=0.5)
    scene.add_body("box", em.Box((0.2,) * 3), mass=1.0, position=(0, 0, 0.1), role="object", **body)
    return scene


@pytest.mark.parametrize("task", TASKS)
def test_every_task_is_a_model_that_begins_at_the_state_with_the_same_masses(task):
    made = em.tasks.make(task)
    trajectory = made.rollout(0, frames=4)
    problem = made.problem(trajectory.states[1], trajectory.params)
    model, data = at_start(problem.scene, problem.state)
    state = States(problem.scene, model).read(data)
    one, two = problem.scene.unpack(state), problem.scene.unpack(problem.state)
    for name in one.keys() - {"joints"}:
        for what in ("position", "velocity", "angular_velocity"):
            assert one[name][what] == pytest.approx(two[name][what], abs=1e-9)
        assert abs(one[name]["orientation"] @ two[name]["orientation"]) == pytest.approx(1.0)
    masses = sum(body.mass for body in problem.scene.bodies)
    assert model.body_mass.sum() == pytest.approx(masses, rel=1e-12)


def test_a_state_that_is_written_is_read_again():
    problem = em.tasks.make("balance").problem(em.tasks.make("balance").rollout(0).states[1])
    model, data = at_start(problem.scene, problem.state)
    states = States(problem.scene, model)
    other = problem.scene.pack(
        object={"position": (5.4, 5.2, 0), "yaw": 0.4, "velocity": (1, 2, 0)}
    )
    states.write(data, other)
    assert states.read(data) == pytest.approx(other, abs=1e-9)


def test_what_sticks_creeps_by_no_more_than_microns():
    """At MuJoCo's own impratio, 1, this box creeps by 0.2 mm/s, and a gripper's load slips out."""
    model, data = at_start(with_object(friction=0.9, force=(2.0, 0, 0)))
    mujoco.mj_step(model, data, 60)
    before = data.qpos[0]
    mujoco.mj_step(model, data, 240)
    assert 0 < data.qpos[0] - before < 1e-5


def test_both_engines_see_one_friction():
    """The larger of the two, MuJoCo's own rule, would be 0.5."""
    scene = with_object(friction=0.4)
    start = scene.pack(box={"velocity": (1.0, 0, 0)})
    model, data = at_start(scene, start, step=scene.step / 4)  # where contacts chatter less
    mujoco.mj_step(model, data, 96)
    before = data.qvel[0]
    mujoco.mj_step(model, data, 192)
    rate = (before - data.qvel[0]) / (192 * model.opt.timestep)
    assert rate == pytest.approx(0.4 * 0.5 * 9.81, rel=0.1)


def test_capsules_hulls_joints_drives_springs_and_mimics_have_their_place():
    scene = em.Scene(gravity=(0, 0, 0))
    hull = em.ConvexHull(np.array([(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)]))
    scene.add_body("base", em.Capsule(0.05, 0.2), mass=0)
    for name in ("left", "right"):
        scene.add_body(name, hull, mass=0.1)
    scene.add_body("box", em.Box((0.1,) * 3), mass=0.2, position=(1, 0, 0), role="object")
    drive = {"stiffness": 2.0, "damping": 0.1, "torque_limit": 0.5, "target": 0.3}
    scene.add_joint(
        "left", parent="base", child="left", origin=(0, 0.2, 0), limits=(-1, 1), **drive
    )
    mimic = em.Mimic("left", -1.0, 0.1)
    scene.add_joint("right", parent="base", child="right", origin=(0, -0.2, 0), mimic=mimic)
    scene.add_spring("base", "box", stiffness=5.0, rest_length=0.8)
    model, data = at_start(scene)
    assert data.ctrl == pytest.approx([0.3])
    mujoco.mj_step(model, data, 480)
    left, right = (data.joint(name).qpos[0] for name in ("left", "right"))
    assert left == pytest.approx(0.3, abs=0.01)
    assert right == pytest.approx(-left + 0.1, abs=0.01)
    here = em.World(scene).rollout(scene.pack(), np.zeros(6), 480 * scene.step).state
    x = scene.slice("box").start
    assert data.body("box").xpos[0] == pytest.approx(here[x], abs=0.01)


def test_a_constant_force_and_gravity_hold_each_other_along_locked_axes():
    scene = em.Scene()
    locked = {"linear_factor": (0, 0, 1), "angular_factor": (0, 0, 0)}
    scene.add_body("lift", em.Sphere(0.1), mass=2.0, force=(0, 0, 19.62), **locked)
    model, data = at_start(scene)
    mujoco.mj_step(model, data, 100)
    assert data.body("lift").xpos == pytest.approx([0, 0, 0], abs=1e-9)


def test_what_mjcf_cannot_express_is_named():
    with pytest.raises(ValueError, match="'box' turns about 2 axes, expected 0, 1 or 3"):
        em.mujoco.to_mjcf(with_object(angular_factor=(1, 1, 0)))


def test_a_held_joint_is_a_weld_whose_state_is_read_and_whose_other_states_are_refused():
    scene = em.Scene()
    scene.add_body("base", em.Sphere(0.1), mass=0.0)
    scene.add_body("arm", em.Sphere(0.1), mass=1.0)
    turned = {"axis": (0, 0, 1), "origin": (0.2, 0, 0), "child_origin": (-0.1, 0, 0)}
    scene.add_joint("elbow", parent="base", child="arm", held=True, **turned)
    start = scene.pack(joints={"elbow": 0.4})
    model, data = at_start(scene, start)
    assert model.njnt == 0
    assert em.mujoco.state(scene, model, data) == pytest.approx(start, abs=1e-9)
    em.mujoco.set_state(model, data, scene, start)
    with pytest.raises(ValueError, match=r"'arm' is .* in the model, whose joints do not reach"):
        em.mujoco.set_state(model, data, scene, scene.pack(joints={"elbow": 0.5}))


def test_a_held_joint_is_where_a_mocap_body_carries_its_child():
    scene = em.Scene()
    scene.add_body("base", em.Sphere(0.1), mass=0.0)
    scene.add_body("arm", em.Sphere(0.1), mass=1.0)
    scene.add_joint("rail", parent="base", child="arm", type="prismatic", axis=(1, 0, 0), held=True)
    xml = """<mujoco><worldbody><body name="base"><geom size=".1"/></body>
<body name="arm" mocap="true"><geom size=".1"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    for way in (0.1, 0.3):
        data.mocap_pos[0] = way, 0, 0
        there = scene.unpack(em.mujoco.state(scene, model, data))
        assert there["joints"]["rail"]["position"] == pytest.approx(way)


@pytest.mark.parametrize("angular", [(0, 0, 0), (0, 0, 1), (1, 1, 1)])
def test_a_body_with_locked_axes_goes_to_mujoco_and_back(angular):
    scene = with_object(linear_factor=(1, 1, 0), angular_factor=angular)
    model, data = at_start(scene)
    spin = 2.0 * np.array(angular)
    moved = {"position": (0.3, -0.2, 0.1), "velocity": (1, 2, 0), "angular_velocity": spin}
    state = scene.pack(box={**moved, "yaw": 0.4 * angular[2]})
    em.mujoco.set_state(model, data, scene, state)
    assert em.mujoco.state(scene, model, data) == pytest.approx(state, abs=1e-9)
    above = scene.pack(box={"position": (0, 0, 0.2)})
    before = data.qpos.copy()
    with pytest.raises(ValueError, match=r"'box' is 0\.1 m and 0 rad"):
        em.mujoco.set_state(model, data, scene, above)
    assert np.array_equal(data.qpos, before)


def test_boxes_in_a_plane_whose_faces_are_flush_are_not_thrown_off():
    """MuJoCo 3.11 finds contacts between boxes of one thickness where there are none."""
    task = em.tasks.make("balance")
    trajectory = task.rollout(0, frames=2)
    problem = task.future(trajectory.states[0], 0.0, trajectory.params, 0.5)
    model, data = at_start(problem.scene, problem.state, step=problem.scene.step / 4)
    assert em.mujoco.replay(model, data, problem).distance < 0.05
    assert model.geom_size[:, 2] == pytest.approx(0.05, rel=1e-3)
