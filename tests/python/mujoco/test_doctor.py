"""The doctor names a known fault of each scene, and says nothing of healthy ones."""

import pytest
from command_line import invoke

pytest.importorskip("mujoco")
import mujoco

import energymargin as em

BOX = """<body name="box" pos="{at}"><freejoint/>
<geom name="block" type="box" size=".05 .05 .05" {more}/></body>"""
FLOOR = '<geom name="floor" type="plane" size="2 2 1" {more}/>'
GRIP = """
<body name="palm" pos="0 0 .5">
  <body name="left" pos="-.06 0 0"><joint name="left" type="slide" axis="1 0 0" damping="5"/>
    <geom type="box" size=".01 .02 .02" mass=".1" friction="1"/></body>
  <body name="right" pos=".06 0 0"><joint name="right" type="slide" axis="-1 0 0" damping="5"/>
    <geom type="box" size=".01 .02 .02" mass=".1" friction="1"/></body></body>
<body name="can" pos="0 0 .5"><freejoint/>
  <geom type="box" size=".0499 .02 .04" mass=".2" friction="1"/></body>
"""
MOTORS = """<actuator><motor name="l" joint="left" ctrlrange="0 9"/>
<motor name="r" joint="right" ctrlrange="0 9"/></actuator>"""
GRIPS = '<keyframe><key qpos="0 0 0 0 .5 1 0 0 0" ctrl="8 8"/></keyframe>'
SERVO = '<actuator><position name="servo" joint="elbow" {more}/></actuator>'
ARM = """<body name="arm" pos="0 0 1"><joint name="elbow" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 .5 0 0" size=".02" mass="2"/></body>"""


def scene(body, *, option="", rest=""):
    text = f"<mujoco><option {option}/><worldbody>{body}</worldbody>{rest}</mujoco>"
    return mujoco.MjModel.from_xml_string(text)


def standing(at="0 0 .0499", more="", floor=""):
    return FLOOR.format(more=floor) + BOX.format(at=at, more=more)


LID = """<body name="lid" pos="0 0 .1497"><freejoint/>
<geom type="box" size=".05 .05 .05"/></body>"""
FAULTS = {
    "overlap": scene(standing(at="0 0 .02")),
    "not at rest": scene(standing(at="0 0 .3")),
    "solref": scene(standing(more='solref="0.002 1"', floor='solref="0.002 1"')),
    "margin": scene(standing(more='margin="0.004"', at="0 0 .052")),
    "weak drive": scene(
        ARM,
        rest=SERVO.format(more='kp="100" forcerange="-2 2"'),
    ),
    "creep": scene(GRIP, rest=MOTORS + GRIPS),
}
HEALTHY = {
    "a box on a floor": scene(standing()),
    "two boxes": scene(standing() + LID),
    "a grip with elliptic cones": scene(
        GRIP, option='cone="elliptic" impratio="100"', rest=MOTORS + GRIPS
    ),
    "an arm that its servo holds": scene(
        ARM,
        rest=SERVO.format(more='kp="1e5" kv="1e3" forcerange="-99 99"'),
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_known_fault_is_named(fault):
    found = em.mujoco.doctor(FAULTS[fault])
    assert fault in [one.kind for one in found.findings], found.findings


@pytest.mark.parametrize("name", HEALTHY)
def test_a_healthy_scene_has_none(name):
    assert em.mujoco.doctor(HEALTHY[name]).findings == ()


def test_the_creep_of_a_grip_has_its_speed_and_what_stops_it():
    (one,) = em.mujoco.doctor(FAULTS["creep"]).findings
    assert one.where == "can" and "pyramidal cones, impratio 1" in one.text
    assert "with elliptic cones and impratio 10" in one.text


def test_the_command_lists_what_is_wrong_and_ends_with_1(tmp_path):
    for at, status in (("0 0 .0499", 0), ("0 0 .02", 1)):
        file = tmp_path / "scene.xml"
        file.write_text(f"<mujoco><worldbody>{standing(at)}</worldbody></mujoco>")
        told = invoke(["doctor", str(file)])
        assert told.exit_code == status, told.output
    (tmp_path / "c.xml").write_text("<mujoco><worldbody></mujoco>")
    told = invoke(["doctor", str(tmp_path / "c.xml")])
    assert told.exit_code == 2 and "is no model of MuJoCo" in told.output
