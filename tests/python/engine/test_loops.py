"""Loops, ball joints, tendons and damped bodies of MuJoCo's models, beside MuJoCo."""

import mujoco
import numpy as np
import pytest
from pages import content_of, floats

import energymargin as em
from energymargin import report
from energymargin.evaluate.searches import SearchSettings
from energymargin.look.viewer import view
from energymargin.store import score_dataset
from energymargin.tasks.base import inside
from energymargin.tasks.from_problem import ProblemTask
from energymargin.tasks.trajectories import Trajectory

# Shapes that collide with nothing have no extent.
pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")

OFF = 'contype="0" conaffinity="0"'
MODEL = f"""<mujoco><compiler angle="radian"/>
<option gravity="0 0 -9.81" timestep="0.0002" integrator="implicitfast"/>
<worldbody>
  <body name="crank"><joint name="crank" axis="0 1 0" damping="0.05"/>
    <geom type="capsule" fromto="0 0 0 0 0 .1" size=".01" mass=".2" {OFF}/>
    <body name="rod" pos="0 0 .1"><joint name="rod" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".01" mass=".3" {OFF}/></body></body>
  <body name="rocker" pos=".3 0 -.05"><joint name="rocker" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 0 0 .15" size=".01" mass=".2" {OFF}/></body>
  <body name="bob" pos="0 .5 0"><joint name="ball" type="ball" pos="0 0 .2" damping=".01"/>
    <geom type="box" size=".05 .03 .1" mass="1" {OFF}/></body>
  <body name="mocap" mocap="true" pos="0 1 0"/>
  <body name="carried" pos="0 1.1 0"><freejoint/>
    <geom type="box" size=".05 .03 .1" mass="1" {OFF}/></body>
  <body name="damped" pos="0 2 0" gravcomp="1"><joint name="damped" type="free" damping="0.3"/>
    <geom type="box" size=".1 .1 .1" mass="1" {OFF}/></body>
</worldbody>
<equality>
  <connect body1="rod" body2="rocker" anchor=".3 0 0" solref="0.001 1"/>
  <weld body1="mocap" body2="carried" solref="0.001 1"/>
</equality>
<tendon><fixed name="sum" range="-9 .9" limited="true" frictionloss=".001">
  <joint joint="crank" coef="1"/><joint joint="rocker" coef=".5"/></fixed></tendon>
<actuator><position name="pull" tendon="sum" kp="1" kv=".02" ctrlrange="-2 2"/></actuator>
</mujoco>"""


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_string(MODEL)


@pytest.fixture
def data(model):
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.6
    ball, damped = (model.joint(name).dofadr[0] for name in ("ball", "damped"))
    data.qvel[ball : ball + 3] = 1, 2, 3
    data.qvel[damped : damped + 6] = 1, 2, 3, 4, 5, 6
    mujoco.mj_forward(model, data)
    return data


def scene_of(model, data=None, **options):
    return em.scenes.from_mjcf(model, data=data, object="rocker", **options)


def test_moves_as_in_mujoco(model, data):
    scene = scene_of(model, data)
    start = em.mujoco.state(scene, model, data)
    assert [loop.type for loop in scene.loops] == ["point", "point", "weld"]
    (tendon,) = scene.tendons
    assert {of.joint: of.coefficient for of in tendon.joints} == {"crank": 1, "rocker": 0.5}
    simulation = em.World(scene).simulate(start, 240, record=range(0, 241, 24))
    for state, time in zip(simulation.states, np.ravel(simulation.times), strict=True):
        while data.time < time - 1e-6:
            mujoco.mj_step(model, data)
        ours, theirs = scene.unpack(state), scene.unpack(em.mujoco.state(scene, model, data))
        for body in ("bob", "carried", "damped"):
            assert ours[body]["position"] == pytest.approx(theirs[body]["position"], abs=2e-3)
        for joint in ("crank", "rod", "rocker"):
            angles = (of["joints"][joint]["position"] for of in (ours, theirs))
            assert next(angles) == pytest.approx(next(angles), abs=0.02)
    assert ours["joints"]["crank"]["position"] > 0.3


def test_mocap_body_carries_what_is_welded_to_it(model):
    scene = scene_of(model)
    assert [body.name for body in scene.bodies if body.kinematic] == ["mocap"]
    rows = np.tile([0.2, 0, 0, 0, 0, 1.0], (240, 1))
    plan = em.Plan(step=1 / 240, velocities={"mocap": rows})
    state = em.World(scene, plan).simulate(scene.pack(), 240).states[-1]
    at = scene.unpack(state)
    gap = np.linalg.norm(at["carried"]["position"] - at["mocap"]["position"])
    assert gap == pytest.approx(0.1, abs=1e-6)
    assert at["carried"]["position"][0] == pytest.approx(0.2 - 0.1 * np.sin(1.0), abs=1e-3)


def test_plan_pulls_a_tendon_and_mujoco_is_told(model, data):
    scene = scene_of(model, data)
    assert em.mujoco.targets(scene, model, data) == {"sum": pytest.approx(0.6)}
    rows = np.full(480, 0.3)
    plan = em.Plan(step=1 / 240, targets={"sum": rows})
    at = scene.unpack(em.World(scene, plan).simulate(scene.pack(), 480).states[-1])["joints"]
    low = at["crank"]["position"]
    plan = em.Plan(step=1 / 240, targets={"sum": rows + 0.5})
    at = scene.unpack(em.World(scene, plan).simulate(scene.pack(), 480).states[-1])["joints"]
    assert at["crank"]["position"] > low + 0.1
    with pytest.raises(ValueError, match="'nothing'"):
        em.World(scene, em.Plan(step=1 / 240, targets={"nothing": rows}))


def test_ignored_they_are_left_out(model):
    ignore = ("tendon", "actuator/tendon", "equality/connect", "equality/weld", "joint/ball")
    scene = scene_of(model, ignore=ignore)
    assert not scene.loops
    assert not scene.tendons
    assert set(scene.report.names("left out")) >= {"tendon", "equality/weld", "joint/ball"}
    assert scene.report.names("body loose") == ["rod", "rocker", "carried"]


def named(body):
    return "ground" if body == "world" else body


def test_twin_in_mujoco_moves_alike(model, data):
    scene = scene_of(model, data)
    kept = em.Scene(scene.gravity, friction_rule="max")
    for body in scene.bodies:
        if body.kinematic or body.name == "carried":
            continue
        kept.add_body(
            named(body.name),
            body.shape,
            mass=body.mass,
            position=body.position,
            orientation=body.orientation,
            force=body.force,
            velocity=body.velocity,
            angular_velocity=body.angular_velocity,
            inertial=body.inertial,
            linear_damping=body.angular_damping if body.name == "damped" else 0.0,
            angular_damping=body.angular_damping if body.name == "damped" else 0.0,
        )
    for joint in scene.joints:
        kept.add_joint(
            joint.name,
            parent=named(joint.parent),
            child=joint.child,
            axis=joint.axis,
            origin=joint.origin,
            child_origin=joint.child_origin,
            damping=joint.damping,
        )
    (tendon,) = scene.tendons
    terms = {of.joint: of.coefficient for of in tendon.joints}
    kept.add_tendon("sum", terms, target=0.6, stiffness=1, damping=0.02, limits=(-9, 0.9))
    for loop in scene.loops[:2]:
        kept.add_loop(named(loop.body_a), loop.body_b, point_a=loop.point_a, point_b=loop.point_b)
    twin = em.mujoco.model_of(kept, step=2e-4)
    own = mujoco.MjData(twin)
    mujoco.mj_resetDataKeyframe(twin, own, 0)
    for _ in range(5000):
        mujoco.mj_step(twin, own)
    state = em.World(kept).simulate(kept.pack(), 240).states[-1]
    ours = kept.unpack(state)
    for name in ("bob", "rod", "rocker", "damped"):
        assert ours[name]["position"] == pytest.approx(own.body(name).xpos, abs=1e-3)


def test_problem_file_keeps_them(model, data, tmp_path):
    scene = scene_of(model, data)
    ball = em.regions.Ball("rocker", center=(0.3, 0, 0), radius=1.0)
    wrench = {"force": (1, 0, 0), "torque": (0, 0, 0), "duration": 0.1}
    problem = em.Problem(scene, scene.pack(), captured=ball, **wrench)
    problem.save(tmp_path / "p.json")
    read = em.Problem.load(tmp_path / "p.json").scene
    assert repr(read.tendons[0].joints[0].joint) == repr(scene.tendons[0].joints[0].joint)
    assert read.loops[2].point_b == pytest.approx(scene.loops[2].point_b)
    ours, theirs = (em.World(of).simulate(of.pack(), 20).states[-1] for of in (scene, read))
    assert np.array_equal(ours, theirs)


def test_plan_of_a_tendon_is_read_back(model, data):
    scene = scene_of(model, data)
    plan = em.Plan(step=1 / 240, targets={"sum": np.full(24, 0.3)})
    ball = em.regions.Ball("rocker", center=(0.3, 0, 0), radius=1.0)
    wrench = {"force": (1, 0, 0), "torque": (0, 0, 0), "duration": 0.1}
    problem = em.Problem(scene, scene.pack(), captured=ball, plan=plan, horizon=0.1, **wrench)
    assert em.Problem.from_json(problem.to_json()).to_json() == problem.to_json()


def linkage():
    """A bag on a ball joint; a tendon swings a rod in a parallelogram that a loop closes."""
    scene = em.Scene()
    scene.add_body("frame", em.Box((0.02, 0.02, 0.02)), mass=0)
    for name, size, role in (
        ("crank", (0.01, 0.01, 0.05), "effector"),
        ("rocker", (0.01, 0.01, 0.05), "none"),
        ("rod", (0.1, 0.01, 0.01), "object"),
    ):
        scene.add_body(name, em.Box(size), mass=0.05, role=role)
    low = {"axis": (0, 1, 0), "child_origin": (0, 0, -0.025)}
    scene.add_joint("crank", parent="frame", child="crank", **low)
    scene.add_joint("rocker", parent="frame", child="rocker", origin=(0.1, 0, 0), **low)
    ends = {"origin": (0, 0, 0.025), "child_origin": (-0.05, 0, 0)}
    scene.add_joint("rod", parent="crank", child="rod", axis=(0, 1, 0), **ends)
    scene.add_loop("rod", "rocker", point_a=(0.05, 0, 0), point_b=(0, 0, 0.025))
    scene.add_tendon("both", {"crank": 0.5, "rocker": 0.5}, stiffness=0.5, damping=0.01)
    for other in ("rocker", "frame"):
        scene.disable_collisions("rod", other)
    scene.add_body("hook", em.Box((0.02, 0.02, 0.02)), mass=0, position=(0, 0.5, 0.15))
    scene.add_body("bag", em.Box((0.1, 0.1, 0.2)), mass=0.5, position=(0, 0.5, 0), role="object")
    scene.add_loop("hook", "bag", point_b=(0, 0, 0.15))
    stays = em.regions.Ball("bag", center=(0, 0.5, 0), radius=0.03)
    return em.Problem(
        scene,
        scene.pack(),
        captured={"rod": em.regions.Joint("crank", lower=-0.2, upper=0.2), "bag": stays},
        force=(1, 1, 0),
        torque=(0, 0, 0),
        duration=0.2,
    )


def test_objects_in_loops_have_the_same_bits_on_any_thread_and_with_a_plan():
    problem = linkage()
    plan = em.Plan(step=1 / 50, targets={"both": np.linspace(0, 0.1, 15)})
    ahead = problem.replace(horizon=0.3, plan=plan)
    one, two = (
        em.capture_probability(ahead, rollouts=40, seed=1, threads=threads, by_object=True)
        for threads in (1, 2)
    )
    each = [[of.captured for of in found.by_object.values()] for found in (one, two)]
    assert each[0] == each[1]
    assert 0 < one.captured < 1
    assert one.unconverged == 0
    efforts = [em.escape_effort(problem, nodes=150, seed=2).effort for _ in range(2)]
    assert efforts[0] == efforts[1] > 0


def test_the_viewer_draws_objects_in_loops():
    problem = linkage()
    content = content_of(view(problem, nodes=60))
    (shot,) = content["shots"]
    assert [body["object"] for body in shot["bodies"]].count(True) == 2  # the rod and the bag
    for drawn, numbers in (("dots", 3), ("edges", 6)):
        assert len(floats(content, shot[drawn]["points"], -1, numbers)) > 60


def test_a_report_shows_objects_in_loops(tmp_path):
    problem, trajectories = linkage(), []
    problem.save(tmp_path / "linkage.json")
    task = ProblemTask(tmp_path / "linkage.json")
    for seed, force in enumerate(np.arange(-1.25, 1.5, 0.5)):
        push = {"bag": np.tile([force, 0, 0, 0, 0, 0], (90, 1))}
        run = em.World(problem.scene).simulate(
            problem.state, 90, drives=push, record=range(0, 90, 15)
        )
        held = inside(task.captured(problem.state, {}), problem.scene, np.asarray(run.states))
        ends = {
            "captured": held.all(0),
            "success": bool(held.all(0)[-1]),
            "params": {},
            "seed": seed,
        }
        anyway = {"captured_any": held.any(0), "success_any": bool(held.any(0)[-1])}
        frames = np.ravel(run.times), np.asarray(run.states), run.contacts
        trajectories.append(Trajectory(*frames, **ends, **anyway))
    parameters = {"file": task.file, "digest": task.digest}
    dataset = em.datasets.Dataset("problem", parameters, 0, trajectories)
    dataset.save(tmp_path / "linkage.h5")
    score_dataset(dataset, tmp_path / "linkage-scores.db", settings=SearchSettings(nodes=15))
    report.write(tmp_path / "linkage-scores.db", tmp_path / "linkage.html")
    page = (tmp_path / "linkage.html").read_text()
    assert "No picture" not in page
    assert page.count("data:image/png") > 1


def test_a_tied_body_is_not_moved_apart():
    problem = linkage()
    with pytest.raises(ValueError, match="'bag', which a loop ties"):
        em.scenes.moved_apart(em.World(problem.scene), problem.state, ["bag"])


def test_tied_object_has_no_escape_energy(model):
    scene = em.scenes.from_mjcf(model, object="carried")
    ball = em.regions.Ball("carried", center=(0, 1.1, 0), radius=0.1)
    wrench = {"force": (1, 0, 0), "torque": (0, 0, 0), "duration": 0.1}
    problem = em.Problem(scene, scene.pack(), captured=ball, **wrench)
    with pytest.raises(ValueError, match="'carried' in a loop"):
        em.escape_energy(problem)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"joints": ["a"]}, "joints is .* expected a dict"),
        ({"joints": {"a": "x"}}, r"joints\['a'\] is 'x'"),
        ({"joints": {"b": 1.0}}, "joint is 'b', expected one of 'a'"),
        ({"joints": {"a": np.nan}}, r"joints\['a'\] is nan"),
        ({"joints": {}}, "joints is none"),
        ({"joints": {"a": 1.0}, "limits": (1, 0)}, "lower limit"),
        ({"joints": {"a": 1.0}, "stiffness": -1.0}, "stiffness is -1"),
    ],
)
def test_tendon_says_what_is_wrong(options, message):
    scene = em.Scene()
    scene.add_body("base", em.Box((0.1, 0.1, 0.1)), mass=0)
    scene.add_body("link", em.Box((0.1, 0.1, 0.1)), mass=1)
    scene.add_joint("a", parent="base", child="link")
    with pytest.raises((TypeError, ValueError), match=message):
        scene.add_tendon("t", **options)
    assert not scene.tendons


GRIPPER = """<robot name="gripper">
  <link name="palm"><inertial><mass value="1"/>
    <inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.02"/></geometry></collision></link>
  <link name="finger"><inertial><mass value=".1"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.02 0.02 0.06"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="palm"/><child link="finger"/>
    <origin xyz="0 0 0.1"/><axis xyz="1 0 0"/>
    <limit lower="-0.04" upper="0.04" effort="10" velocity="1"/></joint>
</robot>"""


@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
def test_kinematic_base_goes_where_a_plan_says_whatever_its_hand_meets(kind, tmp_path):
    path = tmp_path / f"hand.{kind}"
    if kind == "urdf":
        path.write_text(GRIPPER)
        hand = em.scenes.from_urdf(path, base="kinematic", joints={"slide": {"held": True}})
    else:
        path.write_text(
            '<mujoco><worldbody><body name="palm"><freejoint/><geom size=".1 .1 .02" type="box"/>'
            f'<body name="finger"><joint type="slide" range="-.04 .04"/><geom size=".05" {OFF}/>'
            "</body></body></worldbody></mujoco>"
        )
        hand = em.scenes.from_mjcf(path, subtree="palm", base="kinematic")
    (palm,) = (body for body in hand.bodies if body.name == "palm")
    assert palm.kinematic
    rows = np.tile([0, 0, 0.5, 0, 0, 0.0], (240, 1))
    plan = em.Plan(step=1 / 240, velocities={"palm": rows})
    end = hand.unpack(em.World(hand, plan).simulate(hand.pack(), 240).states[-1])
    assert end["palm"]["position"] == pytest.approx([0, 0, 0.5], abs=1e-9)
    assert end["finger"]["position"][2] > 0.45


def built(bodies, equality="", actuators="", options=""):
    return em.scenes.from_mjcf(
        f"<mujoco><option>{options}</option><worldbody>{bodies}</worldbody>"
        f"<equality>{equality}</equality>{actuators}</mujoco>"
    )


BLOCK = f'<geom type="box" size=".05 .03 .1" mass="1" {OFF}/>'
FREE = f'<body name="block"><freejoint/>{BLOCK}</body>'
MOCAP = '<body name="mocap" mocap="true"><body name="flange" pos="0 0 .1"/></body>'
ARM = f'<body name="arm"><joint name="elbow"/>{BLOCK}<body name="tool">{BLOCK}</body></body>'


@pytest.mark.parametrize("body", ["mocap", "flange"])
def test_mocap_body_carries_what_is_tied_to_what_is_on_it(body):
    scene = built(MOCAP + FREE, f'<weld body1="{body}" body2="block"/>')
    assert [(loop.body_a, loop.body_b) for loop in scene.loops] == [("mocap", "block")]
    assert [body.name for body in scene.bodies if body.kinematic] == ["mocap"]


@pytest.mark.parametrize("ends", [("mocap", "world"), ("arm", "tool")])
def test_ties_of_bodies_that_cannot_part_are_no_loops(ends):
    assert not built(MOCAP + ARM, '<weld body1="{}" body2="{}"/>'.format(*ends)).loops


def test_weld_that_bears_no_torque_ties_points():
    (loop,) = built(FREE, '<weld body1="block" torquescale="0"/>').loops
    assert loop.type == "point"


def test_damping_of_a_ball_joint_is_that_of_the_body_where_its_parent_stays():
    ball = f'<body name="bob"><joint type="ball" damping=".1"/>{BLOCK}</body>'
    assert built(ball).bodies[-1].angular_damping == 0.1
    carried = ARM.replace("</body></body>", f"{ball}</body></body>")
    with pytest.raises(em.scenes.NotSimulatedError, match=r"joint\.damping \(1\)"):
        built(carried)
    undamped = built(carried, options='<flag damper="disable"/>')
    assert all(body.angular_damping == 0 for body in undamped.bodies)


def test_warning_of_a_tendons_motor_names_its_joints():
    wrist = f'<body name="hand"><joint name="wrist"/>{BLOCK}</body>'
    joints = '<joint joint="elbow" coef="1"/><joint joint="wrist" coef="1"/>'
    motor = '<actuator><motor tendon="pull"/></actuator>'
    with pytest.warns(em.PlausibilityWarning, match="drives or holds elbow, wrist"):
        built(ARM + wrist, "", f'<tendon><fixed name="pull">{joints}</fixed></tendon>{motor}')


BALLS = f"""<mujoco><option timestep="0.0002" integrator="implicitfast"/><worldbody>
  <body name="bob" pos="0 0 1"><joint name="bob" type="ball" pos="0 0 .1" damping=".02"/>{BLOCK}
    <body name="bead" pos="0 0 -.2"><joint name="bead" type="ball" pos="0 0 .1"/>{BLOCK}</body>
  </body></worldbody></mujoco>"""


@pytest.fixture
def balls():
    """A pendulum on two ball joints: its model, scene, and the states of its swing."""
    model = mujoco.MjModel.from_xml_string(BALLS)
    data = mujoco.MjData(model)
    data.qvel[:] = 1, 2, 3, 0.5, 0.2, 0.1
    mujoco.mj_forward(model, data)
    scene = em.scenes.from_mjcf(model, data=data, object="bead")
    states = em.World(scene).simulate(scene.pack(), 120, record=range(0, 121, 60)).states
    return model, scene, states


def test_state_of_ball_joints_goes_to_mujoco_and_back(balls):
    model, scene, states = balls
    for state in states:
        data = mujoco.MjData(model)
        em.mujoco.set_state(model, data, scene, state)
        there, here = scene.unpack(em.mujoco.state(scene, model, data)), scene.unpack(state)
        for body in ("bob", "bead"):
            for of, error in (("position", 1e-7), ("angular_velocity", 1e-9)):
                assert there[body][of] == pytest.approx(here[body][of], abs=error)


def test_twin_of_a_model_with_ball_joints_swings_as_it_does(balls):
    _, scene, states = balls
    twin = em.mujoco.model_of(scene, step=2e-4)
    data = mujoco.MjData(twin)
    mujoco.mj_resetDataKeyframe(twin, data, 0)
    for _ in range(2500):
        mujoco.mj_step(twin, data)
    end = scene.unpack(states[-1])
    for body in ("bob", "bead"):
        assert data.body(body).xpos == pytest.approx(end[body]["position"], abs=2e-3)


def test_body_of_the_name_world_has_to_be_the_world():
    scene = em.Scene()
    scene.add_body("world", em.Sphere(0.1), mass=0, position=(0, 0, 1))
    with pytest.raises(ValueError, match="'world' is not where"):
        em.mujoco.to_mjcf(scene)
