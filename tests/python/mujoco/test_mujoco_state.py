"""States of scenes in MuJoCo's data, and back."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import energymargin as em

# A gripper on an arm, a mocap body that would lead it, and an object whose centre of mass is off.
ARM = """<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="mocap" mocap="true" pos="0 0 2"/>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" axis="0 1 0.2"/><geom type="capsule" size="0.03 0.2" pos="0 0 0.2"/>
      <body name="palm" pos="0.1 0 0.4" euler="0.3 0.2 0.1">
        <joint name="wrist" axis="0 0 1" pos="0.02 0 0"/><geom type="box" size="0.04 0.04 0.02"/>
        <body name="left" pos="0.03 0 0.05">
          <joint name="left" type="slide" axis="1 0 0" range="-0.02 0.02"/>
          <geom type="box" size="0.005 0.01 0.03"/>
        </body>
        <body name="right" pos="-0.03 0 0.05">
          <joint name="right" type="slide" axis="1 0 0"/><geom type="box" size="0.005 0.01 0.03"/>
        </body>
      </body>
    </body>
    <body name="object" pos="0.5 0 0.1">
      <freejoint name="object"/>
      <geom type="box" size="0.02 0.03 0.04" pos="0.03 0.01 0"/>
    </body>
  </worldbody>
  <equality><joint joint1="right" joint2="left" polycoef="0 -1 0 0 0"/></equality>
  <actuator><position joint="left" kp="100" ctrlrange="-0.02 0.02"/></actuator>
</mujoco>"""


def hand(**body):
    """The gripper and the object as a scene of one's own, the palm free."""
    scene = em.Scene()
    box = em.Box((0.02, 0.02, 0.06))
    scene.add_body("palm", em.Box((0.08, 0.08, 0.04)), mass=0.3, role="effector", **body)
    scene.add_body("left", box, mass=0.05, role="effector")
    scene.add_body("right", box, mass=0.05, role="effector")
    moves = {"parent": "palm", "type": "prismatic", "axis": (1, 0, 0)}
    scene.add_joint(
        "left", child="left", origin=(0.03, 0, 0.05), limits=(-0.02, 0.02), stiffness=100, **moves
    )
    mimic = em.Mimic("left", -1.0, 0.0)
    scene.add_joint("right", child="right", origin=(-0.03, 0, 0.05), mimic=mimic, **moves)
    scene.add_body("object", em.Box((0.04, 0.06, 0.08)), mass=0.2, role="object")
    return scene


def moved(seed=0):
    """A model and data with random positions and velocities, as the equality has them."""
    model = mujoco.MjModel.from_xml_string(ARM)
    data, random = mujoco.MjData(model), np.random.default_rng(seed)
    data.qvel[:] = random.normal(size=model.nv)
    mujoco.mj_integratePos(model, data.qpos, 0.3 * random.normal(size=model.nv), 1.0)
    at = {name: model.joint(name) for name in ("left", "right")}
    for values, address in ((data.qpos, "qposadr"), (data.qvel, "dofadr")):
        left, right = (getattr(at[name], address)[0] for name in ("left", "right"))
        values[left] = np.clip(values[left], -0.02, 0.02)
        values[right] = -values[left]
    return model, data


def rate(model, data, body, seconds=1e-6):
    """The velocity of a body's frame and its angular velocity, by a small step of positions."""
    poses = []
    for sign in (-1, 1):
        there = mujoco.MjData(model)
        there.qpos[:] = data.qpos
        mujoco.mj_integratePos(model, there.qpos, data.qvel, sign * seconds)
        mujoco.mj_kinematics(model, there)
        poses.append((there.body(body).xpos.copy(), there.body(body).xmat.reshape(3, 3).copy()))
    (before, turn), (after, turned) = poses
    spin = Rotation.from_matrix(turned @ turn.T).as_rotvec()
    return (after - before) / (2 * seconds), spin / (2 * seconds)


def test_a_state_has_the_poses_and_velocities_of_the_frames_in_mujoco():
    model, data = moved()
    scene = hand()
    state = scene.unpack(em.mujoco.state(scene, model, data))
    mujoco.mj_forward(model, data)
    for body in ("palm", "object", "left", "right"):
        velocity, spin = rate(model, data, body)
        assert state[body]["position"] == pytest.approx(data.body(body).xpos, abs=1e-9)
        turn = Rotation.from_quat(state[body]["orientation"]).as_matrix()
        assert turn.ravel() == pytest.approx(data.body(body).xmat, abs=1e-9)
        assert state[body]["velocity"] == pytest.approx(velocity, abs=1e-6)
        assert state[body]["angular_velocity"] == pytest.approx(spin, abs=1e-6)


def test_a_state_is_that_of_qpos_after_a_step_and_leaves_the_data_as_it_is():
    model, data = moved()
    mujoco.mj_step(model, data)
    before = data.xpos.copy(), data.qpos.copy(), data.cvel.copy()
    scene = hand()
    state = em.mujoco.state(scene, model, data)
    for was, now in zip(before, (data.xpos, data.qpos, data.cvel), strict=True):
        assert np.array_equal(was, now)
    mujoco.mj_forward(model, data)
    assert state[scene.slice("palm")][:3] == pytest.approx(data.body("palm").xpos, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_a_state_goes_to_mujoco_and_back(seed):
    model, data = moved(seed)
    scene = hand()
    state = em.mujoco.state(scene, model, data)
    state[scene.slice("object")] += 0.01
    turn = slice(scene.slice("object").start + 3, scene.slice("object").start + 7)
    state[turn] /= np.linalg.norm(state[turn])
    state[scene.joint_slice("left")] = 0.01, -0.4
    em.mujoco.set_state(model, data, scene, state)
    assert data.joint("right").qpos[0] == pytest.approx(-0.01)
    again = em.mujoco.state(scene, model, data)
    # The palm hangs on an arm that stays: its pose and its velocity are the arm's.
    assert again == pytest.approx(state, abs=1e-9)


def test_a_base_that_the_arm_does_not_bring_there_is_refused_and_changes_nothing():
    model, data = moved()
    scene = hand()
    state = em.mujoco.state(scene, model, data)
    state[scene.slice("palm").start] += 0.1
    before = data.qpos.copy()
    with pytest.raises(ValueError, match=r"'palm' is 0\.1 m and .* cannot place it"):
        em.mujoco.set_state(model, data, scene, state)
    assert np.array_equal(data.qpos, before)


def test_a_mocap_body_is_a_free_body_that_is_put_where_the_state_says():
    model, data = moved()
    scene = em.Scene()
    scene.add_body("mocap", em.Sphere(0.1), mass=1.0, position=(0, 0, 2))
    state = em.mujoco.state(scene, model, data)
    state[:3] = 1, 2, 3
    em.mujoco.set_state(model, data, scene, state)
    assert data.body("mocap").xpos == pytest.approx([1, 2, 3])
    assert em.mujoco.state(scene, model, data) == pytest.approx(state)


def test_what_the_model_does_not_have_is_refused_or_comes_from_another_state():
    model, data = moved()
    scene = hand()
    scene.add_body("ball", em.Sphere(0.1), mass=1.0, position=(0, 0, 5))
    with pytest.raises(ValueError, match="the model does not have 'ball'; others=state"):
        em.mujoco.state(scene, model, data)
    state = em.mujoco.state(scene, model, data, others=scene.pack())
    assert scene.unpack(state)["ball"]["position"] == pytest.approx([0, 0, 5])
    with pytest.raises(ValueError, match=r"others has shape \(3,\) of float64, expected"):
        em.mujoco.state(scene, model, data, others=[1, 2, 3])


def test_names_may_have_a_prefix():
    model, data = moved()
    scene = em.Scene()
    scene.add_body("robot/object", em.Sphere(0.1), mass=1.0)
    state = em.mujoco.state(scene, model, data, prefix="robot/")
    assert state[:3] == pytest.approx(data.joint("object").qpos[:3])


def test_a_fixed_body_that_is_elsewhere_in_the_model_is_refused():
    model, data = moved()
    scene = em.Scene()
    scene.add_body("palm", em.Sphere(0.1), mass=0.0, position=(0, 0, 9))
    with pytest.raises(ValueError, match=r"'palm' is .* fixed in the scene; .*base='free'"):
        em.mujoco.state(scene, model, data)


BALLS = """<mujoco><worldbody>
  <body name="lamp" pos="0 0 1">
    <joint name="lamp" type="ball"/><geom size="0.1" pos="0.1 0 0"/>
    <body name="bulb" pos="0.3 0 0"><geom size="0.05"/></body>
  </body>
  <body name="cart" pos="2 0 1">
    <freejoint/><geom size="0.1"/>
    <body name="head" pos="0 0 0.2"><joint name="head" type="ball"/><geom size="0.05"/></body>
  </body>
  <body name="mark" mocap="true" pos="4 0 1"><geom size="0.1"/></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize("turned", ["lamp", "head"])
def test_what_a_ball_joint_has_turned_is_said_to_be_elsewhere(turned):
    model = mujoco.MjModel.from_xml_string(BALLS)
    data = mujoco.MjData(model)
    scene = em.scenes.from_mjcf(model, ignore=["joint/ball"])
    em.mujoco.state(scene, model, data)
    data.joint(turned).qpos[:] = [0.8, 0, 0, 0.6]
    with pytest.raises(ValueError, match=f"'{turned}' is .* fixed in the scene; .*data=data"):
        em.mujoco.state(scene, model, data)
    as_it_is = em.scenes.from_mjcf(model, ignore=["joint/ball"], data=data)
    em.mujoco.state(as_it_is, model, data)


def test_a_mocap_body_that_has_moved_is_said_to_be_elsewhere():
    model = mujoco.MjModel.from_xml_string(BALLS)
    data = mujoco.MjData(model)
    scene = em.scenes.from_mjcf(model, ignore=["joint/ball"])
    data.mocap_pos[0, 2] = 1.5
    with pytest.raises(ValueError, match=r"'mark' is 0\.5 m .* fixed in the scene; .*data=data"):
        em.mujoco.state(scene, model, data)
    em.mujoco.state(em.scenes.from_mjcf(model, ignore=["joint/ball"], data=data), model, data)


def test_a_held_joint_has_its_position_and_no_velocity():
    model, data = moved()
    scene = em.Scene()
    scene.add_body("base", em.Sphere(0.1), mass=0.0)
    scene.add_body("left", em.Sphere(0.1), mass=1.0)
    scene.add_joint("left", parent="base", child="left", type="prismatic", held=True)
    state = em.mujoco.state(scene, model, data)
    assert state == pytest.approx([data.joint("left").qpos[0], 0.0])


def test_targets_are_what_the_controls_ask_for_within_their_range():
    model, data = moved()
    data.ctrl[:] = 0.01
    assert em.mujoco.targets(hand(), model, data) == {"left": pytest.approx(0.01)}
    data.ctrl[:] = 1.0
    assert em.mujoco.targets(hand(), model, data) == {"left": pytest.approx(0.02)}
