"""Controls of MuJoCo that ask for a scene's targets: what is gripped stays gripped."""

import mujoco
import numpy as np
import pytest

import energymargin as em

# Two fingers close on a ball; their drives are of the kinds that grippers have.
GRIPPER = """<mujoco>
  <option timestep="0.002" cone="elliptic"/>
  <worldbody>
    <body name="palm">
      <geom type="box" size="0.02 0.05 0.01"/>
      <body name="left" pos="-0.03 0 0.05">
        <joint name="left" type="slide" axis="1 0 0" range="0 0.02" {spring}/>
        <geom type="box" size="0.005 0.01 0.02" mass="0.1" friction="1"/>
      </body>
      <body name="right" pos="0.03 0 0.05">
        <joint name="right" type="slide" axis="-1 0 0" range="0 0.02"/>
        <geom type="box" size="0.005 0.01 0.02" mass="0.1" friction="1"/>
      </body>
    </body>
    <body name="ball" pos="0 0 0.05">
      <freejoint name="ball"/><geom type="sphere" size="0.01" mass="0.05" friction="1"/>
    </body>
  </worldbody>
  <tendon>
    <fixed name="both"><joint joint="left" coef="0.5"/><joint joint="right" coef="0.5"/></fixed>
  </tendon>
  <equality><joint joint1="right" joint2="left"/></equality>
  <actuator>{actuator}</actuator>
</mujoco>"""

DRIVES = {
    "position": ("", '<position joint="left" kp="400" kv="10"/>'),
    "gear": ("", '<position joint="left" kp="100" kv="2" gear="2"/>'),
    "offset": (
        "",
        '<general joint="left" biastype="affine" gainprm="2" biasprm="1 -400 -10"/>',
    ),
    "beside a spring": ('stiffness="50"', '<position joint="left" kp="400" kv="10"/>'),
    "filter": ("", '<position joint="left" kp="400" kv="10" timeconst="0.05"/>'),
    "tendon": ("", '<position tendon="both" kp="400" kv="10"/>'),
}
TARGET = 0.018


def made(drive):
    """A model, and a scene of it whose left joint has the target."""
    spring, actuator = DRIVES[drive]
    model = mujoco.MjModel.from_xml_string(GRIPPER.format(spring=spring, actuator=actuator))
    scene = em.scenes.from_mjcf(
        model,
        object="ball",
        effector="palm",
        joints={"left": {"target": TARGET}},
        ignore=("actuator/activation",),
    )
    return model, scene


@pytest.mark.parametrize("drive", DRIVES)
def test_a_state_goes_to_mujoco_with_the_controls_that_ask_for_its_targets(drive):
    model, scene = made(drive)
    data = mujoco.MjData(model)
    em.mujoco.set_state(model, data, scene, scene.pack())
    assert em.mujoco.targets(scene, model, data) == {"left": pytest.approx(TARGET)}
    again = em.scenes.from_mjcf(
        model, object="ball", effector="palm", data=data, ignore=("actuator/activation",)
    )
    left = next(joint for joint in again.joints if joint.name == "left")
    assert left.target == pytest.approx(TARGET)


@pytest.mark.parametrize("drive", DRIVES)
def test_what_a_gripper_holds_here_it_holds_in_mujoco(drive):
    model, scene = made(drive)
    grasped = em.World(scene).simulate(scene.pack(), steps=120, record=[120]).states[0]
    ball = scene.unpack(grasped)["ball"]["position"]
    inside = em.regions.Ball("ball", ball, 0.03)
    bounds = {"force": (0, 0, 1), "torque": (0, 0, 0), "duration": 0.1, "captured": inside}
    problem = em.Problem(scene, grasped, horizon=0.5, **bounds)
    data = mujoco.MjData(model)
    em.mujoco.set_state(model, data, scene, grasped)
    assert not em.mujoco.replay(model, data, problem).escaped
    data.ctrl[:] = 0.0
    data.act[:] = 0.0
    with pytest.raises(ValueError, match=r"control 0 for joint 'left', expected .*set_state"):
        em.mujoco.replay(model, data, problem)


@pytest.mark.parametrize("drive", DRIVES)
def test_targets_of_a_plan_are_reached_in_mujoco(drive):
    model, scene = made(drive)
    away = {"ball": {"position": (0, 0, 1), "velocity": (0, 0, 0.1)}}
    start = scene.pack(**away)
    inside = em.regions.Ball("ball", (0, 0, 1), 9.0)
    plan = em.Plan(1 / 240, targets={"left": np.full(240, 0.01)})
    bounds = {"force": (0, 0, 1), "torque": (0, 0, 0), "duration": 0.1, "captured": inside}
    problem = em.Problem(scene, start, horizon=1.0, plan=plan, **bounds)
    data = mujoco.MjData(model)
    em.mujoco.set_state(model, data, scene, start)
    end = scene.unpack(em.mujoco.replay(model, data, problem).state)
    assert end["joints"]["left"]["position"] == pytest.approx(0.01, abs=5e-4)


def test_a_target_beyond_the_range_of_the_control_warns():
    actuator = '<position joint="left" kp="400" ctrlrange="0 0.01"/>'
    model = mujoco.MjModel.from_xml_string(GRIPPER.format(spring="", actuator=actuator))
    scene = em.scenes.from_mjcf(model, joints={"left": {"target": TARGET}})
    with pytest.warns(em.PlausibilityWarning, match=r"'left': control 0.018 .* \[0, 0.01\]"):
        em.mujoco.set_state(model, mujoco.MjData(model), scene, scene.pack())


def test_controls_of_what_the_scene_does_not_have_stay():
    model, _ = made("position")
    hand = em.Scene()
    hand.add_body("ball", em.Sphere(0.01), mass=0.05, position=(0, 0, 0.05))
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.007
    em.mujoco.set_state(model, data, hand, hand.pack())
    assert data.ctrl[0] == 0.007
