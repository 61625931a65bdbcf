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


PAIR = '<contact><pair geom1="floor" geom2="block" {more}/></contact>'
TENDON = """<tendon><fixed name="rope"><joint joint="elbow" coef="1"/></fixed></tendon>
<actuator><position name="winch" tendon="rope" kp="500" kv="20" forcerange="-1 1"/></actuator>"""
RAMP = """<geom type="plane" size="2 2 1" euler="0 20 0" friction=".8"/>
<body name="crate" pos="0 0 .0532" euler="0 20 0"><freejoint/>
<geom type="box" size=".05 .05 .05" mass="1" friction=".8"/></body>"""
TIED = """<body name="one" pos="0 0 .0499"><freejoint/><geom type="box" size=".05 .05 .05"/></body>
<body name="two" pos=".5 0 .0499"><freejoint/><geom type="box" size=".05 .05 .05"/></body>"""
TIE = """<equality><connect body1="one" body2="two" anchor=".1 0 0"/></equality>
<keyframe><key qpos="0 0 .0499 1 0 0 0 .7 0 .0499 1 0 0 0"/></keyframe>"""
SPIN = '<keyframe><key qpos="0 0 .0499 1 0 0 0" qvel="0 0 0 0 0 3"/></keyframe>'
BALL = """<body name="ball" pos="0 0 .0499"><freejoint/>
<geom type="sphere" size=".05" friction="1 0 0"/></body>"""
MOTOR = '<actuator><motor name="motor" joint="elbow" ctrllimited="true" {more}/></actuator>'
DOUBLE = """<actuator><motor joint="elbow" ctrlrange="-6 6"/><motor joint="elbow" ctrlrange="-6 6"/>
</actuator><keyframe><key qpos="0" ctrl="-2.4525 -2.4525"/></keyframe>"""
OVERRIDE = '<option o_margin=".02" o_solref=".02 1"><flag override="enable"/></option>'
WEAK = (
    '<actuator><motor name="motor" joint="{joint}" ctrllimited="true" ctrlrange="-1 1"/></actuator>'
)
PLATE = """<body name="plate" pos="0 0 .0499"><joint name="lift" type="slide" axis="0 0 1" {more}/>
<geom type="box" size=".05 .05 .05" mass="5"/></body>"""
OTHER_ARM = ARM.replace('"arm" pos="0 0 1"', '"other" pos="0 1 1"').replace("elbow", "other")
KINDS = {
    "a pair's solref": ("solref", scene(standing(), rest=PAIR.format(more='solref=".001 1"'))),
    "a direct solref": ("solref", scene(standing(more='solref="-4e6 -10" priority="1"'))),
    "a pair's margin": ("margin", scene(standing(), rest=PAIR.format(more='margin=".01"'))),
    "the options' margin": ("margin", scene(standing(), rest=OVERRIDE)),
    "a motor of a small range": (
        "weak drive",
        scene(ARM, rest=MOTOR.format(more='gear="2" ctrlrange="-1 1"')),
    ),
    "a servo that sags": ("weak drive", scene(ARM, rest=SERVO.format(more='kp="8" kv="2"'))),
    "a tendon that is too weak": ("weak drive", scene(ARM, rest=TENDON)),
    "a slope": ("creep", scene(RAMP)),
    "two boxes that are not where they are tied": ("not at rest", scene(TIED, rest=TIE)),
    "a ball that turns in its place": (
        "not at rest",
        scene(FLOOR.format(more="") + BALL, rest=SPIN),
    ),
}
QUIET = {
    "two motors together": scene(ARM, rest=DOUBLE),
    "a servo whose targets are on one side": scene(
        ARM, rest=SERVO.format(more='kp="1e3" kv="50" ctrlrange="0 1.5"')
    ),
    "gravity compensation": scene(
        ARM.replace('name="arm"', 'name="arm" gravcomp="1"'),
        rest=SERVO.format(more='kp="10" kv="1" forcerange="-5 5"'),
    ),
    "a margin of half a millimetre": scene(standing(more='margin=".0005"')),
    "a gap": scene(standing(more='gap=".01"')),
    "a crate on a slope with elliptic cones": scene(RAMP, option='cone="elliptic" impratio="100"'),
    "a plate at the end of its joint": scene(
        PLATE.format(more='limited="true" range="0 .5"'), rest=WEAK.format(joint="lift")
    ),
    "a plate on the floor": scene(
        FLOOR.format(more="") + PLATE.format(more=""), rest=WEAK.format(joint="lift")
    ),
    "an arm that a weld holds": scene(
        ARM, rest='<equality><weld body1="arm"/></equality>' + WEAK.format(joint="elbow")
    ),
    "two arms that balance each other": scene(
        ARM + OTHER_ARM,
        rest='<equality><joint joint1="other" joint2="elbow" polycoef="0 -1 0 0 0"/></equality>'
        + SERVO.format(more='kp="1e3" kv="50" forcerange="-2 2"'),
    ),
    "what floats": scene(BALL, option='gravity="0 0 0"'),
}


@pytest.mark.parametrize("name", KINDS)
def test_a_fault_is_named_wherever_it_stands(name):
    kind, model = KINDS[name]
    found = em.mujoco.doctor(model)
    assert kind in [one.kind for one in found.findings], found.findings


@pytest.mark.parametrize("name", QUIET)
def test_what_only_looks_like_a_fault_is_none(name):
    assert em.mujoco.doctor(QUIET[name]).findings == ()


def test_what_fell_before_it_settles_does_not_creep_and_old_warnings_are_no_divergence():
    model = scene(TIED, rest=TIE)
    assert {one.kind for one in em.mujoco.doctor(model).findings} == {"not at rest"}
    model = scene(standing())
    data = mujoco.MjData(model)
    data.warning[int(mujoco.mjtWarning.mjWARN_BADQACC)].number = 3
    assert em.mujoco.doctor(model, data).findings == ()


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


def test_a_cloth_in_a_post_is_named():
    """MuJoCo has no geom where something soft touches."""
    cloth = """<flexcomp name="cloth" type="grid" dim="2" count="3 3 1" spacing=".05 .05 .05"
    mass=".1" radius=".005" pos="0 0 .1"/><body name="last" pos="3 0 5"><geom size=".01"/></body>"""
    post = '<body name="post" pos="0 0 .05"><geom type="box" size=".05 .05 .05"/></body>'
    found = em.mujoco.doctor(scene(post + cloth))
    assert [one.where for one in found.findings if one.kind == "overlap"] == ["cloth and post"]


def test_the_command_lists_what_is_wrong_and_ends_with_1(tmp_path):
    for at, status in (("0 0 .0499", 0), ("0 0 .02", 1)):
        file = tmp_path / "scene.xml"
        file.write_text(f"<mujoco><worldbody>{standing(at)}</worldbody></mujoco>")
        told = invoke(["doctor", str(file)])
        assert told.exit_code == status, told.output
    (tmp_path / "c.xml").write_text("<mujoco><worldbody></mujoco>")
    told = invoke(["doctor", str(tmp_path / "c.xml")])
    assert told.exit_code == 2 and "is no model of MuJoCo" in told.output
