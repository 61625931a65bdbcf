"""The same questions with Bullet's own dynamics."""

from __future__ import annotations

import math
import re
import subprocess
import sys

import numpy as np
import pytest

import energymargin as em

G = 9.81
TASKS = ("push", "balance", "topple", "grasp", "scoop", "push-multi", "push-real")


def ends(scene, steps=240, **how):
    return scene.unpack(em.World(scene).simulate(scene.pack(), steps, **how).states[-1])


def test_a_box_rests_on_a_plane_with_its_weight():
    scene = em.Scene(engine="bullet")
    scene.add_plane("floor", friction=0.5)
    scene.add_body("box", em.Box((0.1, 0.1, 0.1)), mass=2.0, position=(0, 0, 0.05), role="object")
    assert ends(scene)["box"]["position"] == pytest.approx((0, 0, 0.05), abs=2e-4)
    forces = [c.normal_force for c in em.World(scene).contacts(scene.pack())]
    assert sum(forces) == pytest.approx(2.0 * G, rel=1e-3)


def test_friction_stops_a_box_and_a_pair_has_its_own():
    scene = em.Scene(engine="bullet")
    scene.add_plane("floor", friction=1.0)
    scene.add_body(
        "box", em.Box((0.2, 0.2, 0.05)), mass=1.0, position=(0, 0, 0.025), velocity=(1, 0, 0)
    )
    scene.set_friction("floor", "box", 0.3)
    way = ends(scene)["box"]["position"][0]
    assert way == pytest.approx(1 / (2 * 0.3 * G), rel=0.03)


def arm(engine, **joint):
    scene = em.Scene(engine=engine)
    scene.add_body("base", em.Box((0.05,) * 3), mass=0, position=(0, 0, 1))
    scene.add_body("bob", em.Sphere(0.02), mass=0.5)
    scene.add_joint(
        "hinge", parent="base", child="bob", axis=(0, 1, 0), child_origin=(-0.5, 0, 0), **joint
    )
    return scene


def test_a_pendulum_swings_as_in_the_library_s_own_dynamics():
    bullet, native = (ends(arm(engine), 120)["bob"]["position"] for engine in ("bullet", "native"))
    assert bullet == pytest.approx(native, abs=0.02)


@pytest.mark.parametrize(
    ("joint", "position"),
    [
        ({"stiffness": 200.0, "damping": 20.0, "target": 0.4}, 0.4),
        ({"limits": (-0.3, 0.2)}, 0.2),
        ({"friction": 10.0}, 0.0),
    ],
)
def test_joints_are_driven_stopped_and_held(joint, position):
    scene = arm("bullet", **joint)
    last = em.World(scene).simulate(scene.pack(), 480).states[-1]
    assert last[scene.joint_slice("hinge")][0] == pytest.approx(position, abs=0.02)


@pytest.mark.parametrize("chain", [False, True])
def test_a_joint_that_follows_another_loads_it(chain):
    """The state has the leader alone: what the follower's inertia does to it tells."""
    ends = []
    for engine in ("bullet", "native"):
        scene = em.Scene(gravity=(0, 0, 0), engine=engine)
        scene.add_body("base", em.Box((0.05,) * 3), mass=0)
        for name in ("one", "two"):
            scene.add_body(name, em.Box((0.1, 0.02, 0.02)), mass=0.1)
        drive = {"stiffness": 0.05, "damping": 0.001, "target": 0.5}
        scene.add_joint("one", parent="base", child="one", axis=(0, 0, 1), **drive)
        mimic = em.Mimic("one", -2.0, 0.1)
        parent = "one" if chain else "base"
        scene.add_joint("two", parent=parent, child="two", axis=(0, 0, 1), mimic=mimic)
        scene.disable_collisions("one", "two")
        last = em.World(scene).simulate(scene.pack(), 60).states[-1]
        ends.append(last[scene.joint_slice("one")])
    assert ends[0] == pytest.approx(ends[1], rel=0.05, abs=0.02)
    alone = 0.5 * (1 - math.cos(math.sqrt(0.05 / (0.1 * (0.1**2 + 0.02**2) / 12)) * 0.25))
    assert abs(ends[0][0] - alone) > 0.05


def test_a_kinematic_body_carries_and_a_servo_drives():
    scene = em.Scene(engine="bullet")
    scene.add_body(
        "belt", em.Box((1, 1, 0.1)), mass=1, kinematic=True, velocity=(0.1, 0, 0), friction=1
    )
    scene.add_body(
        "box", em.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.1), role="object", friction=1
    )
    end = ends(scene)
    assert end["belt"]["position"][0] == pytest.approx(0.1, rel=1e-6)
    assert end["box"]["position"][0] == pytest.approx(0.1, rel=0.05)
    servo = em.Plan(
        scene.step,
        velocities={"box": np.tile([0, 0, 0.2, 0, 0, 0], (240, 1))},
        limits={"box": (50, 5)},
    )
    lifted = em.World(scene, servo).simulate(scene.pack(), 240).states[-1]
    assert scene.unpack(lifted)["box"]["position"][2] == pytest.approx(0.3, abs=0.01)


def cart(engine, kinematic):
    scene = em.Scene(engine=engine)
    box = em.Box((0.2, 0.2, 0.1))
    scene.add_body("cart", box, mass=1, kinematic=kinematic, velocity=(0.3, 0, 0))
    scene.add_body("bob", em.Sphere(0.02), mass=0.5)
    scene.add_joint("hinge", parent="cart", child="bob", axis=(0, 1, 0), child_origin=(0, 0, 0.4))
    scene.disable_collisions("cart", "bob")
    return scene


@pytest.mark.parametrize("kinematic", [True, False], ids=["kinematic", "servo"])
def test_what_drives_the_base_of_a_tree_is_felt_by_its_joints(kinematic):
    """A bob hangs on a cart that is brought from one speed to another at once."""
    states = []
    for engine in ("bullet", "native"):
        scene = cart(engine, kinematic)
        velocities = {"cart": np.tile([1.0, 0, 0, 0, 0, 0], (60, 1))}
        limits = {} if kinematic else {"limits": {"cart": (800.0, 80.0)}}
        plan = em.Plan(scene.step, velocities=velocities, **limits)
        states.append(em.World(scene, plan).simulate(scene.pack(), 60).states[-1])
    assert abs(states[0][scene.joint_slice("hinge")][0]) > 0.2
    np.testing.assert_allclose(states[0], states[1], atol=1e-9 if kinematic else 2e-4)
    if kinematic:
        assert scene.unpack(states[0])["cart"]["position"] == pytest.approx((0.25, 0, 0), abs=1e-15)


@pytest.mark.parametrize("what", ["tendon", "loop", "armature", "belt"])
def test_what_bullet_cannot_do_is_refused_by_name(what):
    scene = arm("bullet", armature=0.1 if what == "armature" else 0.0)
    if what == "tendon":
        scene.add_tendon("string", {"hinge": 1.0}, stiffness=1.0)
    elif what == "loop":
        scene.add_loop("base", "bob")
    elif what == "belt":
        scene.add_body("belt", em.Box((1, 1, 0.1)), mass=0, surface_velocity=(0.1, 0, 0))
    with pytest.raises(ValueError, match=r"engine is 'bullet', which has no .*engine 'native'"):
        em.World(scene)
    em.World(scene.with_engine("native"))


def test_an_engine_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="engine is 'ode', expected 'native' or 'bullet'"):
        em.Scene(engine="ode")
    with pytest.raises(ValueError, match="engine is 'ode'"):
        em.tasks.make("push", engine="ode")


FINGER = """<link name="{side}"><inertial><mass value=".1"/>
  <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size=".01 .02 .08"/></geometry></collision></link>
<joint name="{side}" type="prismatic"><parent link="palm"/><child link="{side}"/>
  <origin xyz="{x} 0 -.06"/><axis xyz="{inward} 0 0"/>
  <limit lower="0" upper=".02" effort="10" velocity="1"/></joint>"""


def hand(folder):
    """A gripper of a URDF on a kinematic base, which lifts a cube."""
    fingers = [("left", -0.025, 1), ("right", 0.025, -1)]
    links = "".join(FINGER.format(side=side, x=x, inward=inward) for side, x, inward in fingers)
    (folder / "hand.urdf").write_text(f'<robot name="hand"><link name="palm"/>{links}</robot>')
    scene = em.Scene(engine="bullet")
    cube = em.Box((0.04,) * 3)
    scene.add_body("cube", cube, mass=0.1, position=(0, 0, 0.2), friction=0.7, role="object")
    drive = {"stiffness": 2000, "damping": 20, "target": 0.01}
    em.scenes.from_urdf(
        folder / "hand.urdf",
        scene=scene,
        base="kinematic",
        position=(0, 0, 0.26),
        role="effector",
        friction=0.7,
        joints={"left": drive, "right": drive},
    )
    return em.Problem(
        scene,
        scene.pack(),
        force=(4, 4, 4),
        torque=(0.1, 0.1, 0.1),
        duration=0.1,
        captured=em.regions.Ball("cube", center=(0, 0, 0.2), radius=0.06),
        horizon=0.2,
        plan=em.Plan(scene.step, velocities={"palm": np.tile([0, 0, 0.1, 0, 0, 0], (48, 1))}),
    )


@pytest.fixture(scope="module")
def problems(tmp_path_factory):
    made = {"hand": hand(tmp_path_factory.mktemp("hand"))}
    for name in TASKS:
        task = em.tasks.make(name, engine="bullet")
        ran = task.rollout(seed=3)
        posed = task.problem(ran.states[3], ran.params)
        made[name] = posed.replace(horizon=24 * posed.scene.step)
        assert made[name].scene.engine == "bullet"
    return made


def push_back(states, _, time):
    return -0.1 * states[:, :1] * (1 + time)


def plans(problem):
    """A feedback and a policy that push the object back along x, for the same time."""
    body = next(body.name for body in problem.scene.bodies if body.role == "object")
    step, period = problem.scene.step, 6 * problem.scene.step
    names = {"observed": [f"{body}.x"], "corrected": [f"{body}.fx"]}
    yield em.Feedback([[0.1]], **names, period=period, step=step)
    yield em.Policy(
        push_back, period=period, observe=[f"{body}.x"], command=[f"{body}.fx"], name="back"
    )


def answers(problem, threads=1):
    quiet = {"warn": False, "threads": threads}
    asked = {"rollouts": 8, **quiet}
    still = problem.replace(horizon=None, plan=None)
    found = {
        "capture": em.capture_score(still, nodes=40, **quiet),
        "probability": em.capture_probability(problem, **asked).captured,
        "rare": em.capture_probability(problem, rare=True, rollouts=40, **quiet).lost,
        "force": em.force_score(still).force,
    }
    found["capture"] = found["capture"].capture
    if problem.captured_by_object:
        each = em.capture_probability(problem, by_object=True, **asked)
        found["each object"] = [p.mean_time for p in each.by_object.values()]
    for planner in ("est", "rrt"):
        effort = em.escape_effort(problem, planner=planner, nodes=60, warn=False).effort
        found[planner] = effort
    return found


def verbs(problem, threads=1):
    """What is asked of plans that react, of several problems, and of what is not known."""
    quiet = {"rollouts": 8, "threads": threads}
    reacting = [problem.replace(plan=plan, effector="coast") for plan in plans(problem)]
    found = [em.capture_probability(each, warn=False, **quiet).captured for each in reacting]
    ranking = em.rank([problem, *reacting], race=False, **quiet)
    found.append(ranking.to_csv())
    belief = em.Belief(problem, mass=0.1, friction=0.1)
    settings = em.SearchSettings(nodes=40, rollouts=8)
    scores = em.score_belief(belief, particles=4, settings=settings, threads=threads)
    return [*found, [repr(each) for each in scores.scores]]


@pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")
@pytest.mark.parametrize("name", [*TASKS, "hand"])
def test_every_metric_has_the_same_bits_again_on_threads_and_from_a_file(problems, name, tmp_path):
    problem = problems[name]
    first = answers(problem)
    assert answers(problem, threads=2) == first
    problem.save(tmp_path / "problem.json")
    assert answers(em.Problem.load(tmp_path / "problem.json")) == first


@pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")
@pytest.mark.parametrize("name", [*TASKS, "hand"])
def test_every_verb_has_the_same_bits_again_on_threads(problems, name):
    assert verbs(problems[name], threads=2) == verbs(problems[name])


@pytest.mark.parametrize("name", ["push", "scoop", "push-multi"])
def test_the_viewer_s_way_out_ends_where_the_tree_does(problems, name):
    pytest.importorskip("skimage")
    from energymargin.look.viewer.sources import replay

    problem = problems[name].replace(horizon=None, plan=None)
    escape = em.escape_effort(problem, nodes=60, seed=1, warn=False)
    node = int(np.argmax(escape.tree.costs))
    way = replay(problem, escape.tree, escape.tree.path_to(node))
    np.testing.assert_array_equal(way.states[-1], escape.tree.states[node])


def test_a_hand_on_a_moving_base_lifts_its_cube(problems):
    lifted = em.World(problems["hand"].scene, problems["hand"].plan)
    end = problems["hand"].scene.unpack(lifted.simulate(problems["hand"].state, 48).states[-1])
    assert end["palm"]["position"][2] == pytest.approx(0.28, abs=1e-12)
    assert end["cube"]["position"][2] == pytest.approx(0.22, abs=2e-3)


def test_rollouts_do_not_know_what_was_before(problems):
    problem = problems["scoop"]
    world = em.World(problem.scene)
    random = np.random.default_rng(0)
    wrenches = [random.uniform(-1, 1, (4, 6)) * 0.3 for _ in range(20)]
    once = [world.rollout(problem.state, w, 0.2).state for w in wrenches]
    again = [world.rollout(problem.state, w, 0.2).state for w in reversed(wrenches)][::-1]
    np.testing.assert_array_equal(once, again)


def test_the_command_generates_and_scores_with_it(tmp_path):
    def run(*words):
        command = [sys.executable, "-m", "energymargin", *words]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    few = ("--trajectories", "2", "--frames", "4", "--engine", "bullet")
    run("generate", "push", "-o", "p.h5", *few)
    with em.datasets.open(tmp_path / "p.h5") as dataset:
        assert dataset.parameters["engine"] == "bullet"
        assert dataset.problems([0])[0].scene.engine == "bullet"
    run("score", "p.h5", "--nodes", "10", "--rollouts", "5")
    few = ("--nodes", "10", "--metrics", "capture", "--engine", "native")
    run("score", "p.h5", "-o", "native.db", *few)
    with (
        em.store.ScoreStore(tmp_path / "native.db") as store,
        em.datasets.open(tmp_path / "p.h5") as own,
    ):
        native, bullet = store.run(1).scored(own, "p.h5", "native.db"), own.in_engine("bullet")
        assert native.problems([0])[0].scene.engine == "native" and bullet is own
    run("report", "native.db", "--pictures", "1", "--draws", "9", "--data", "p.h5")
    page = (tmp_path / "native.html").read_text()
    assert "is not the dataset" not in page and "--engine native" in page
    run("view", "p.h5", "--scores", "native.db", "-o", "v.html")


def test_audits_are_of_the_native_engine(problems):
    problem = problems["push"]
    with pytest.raises(ValueError, match=re.escape("audit is with engine 'bullet'")):
        em.World(problem.scene).rollout(problem.state, np.zeros(6), 0.1, audit=True)
    assert math.isfinite(em.World(problem.scene).rollout(problem.state, np.zeros(6), 0.1).effort)


LINK = """<link name="l{i}"><inertial><origin xyz="0 0 -.15"/><mass value=".5"/>
  <inertia ixx=".004" iyy=".004" izz=".001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j{i}" type="continuous"><parent link="{above}"/><child link="l{i}"/>
  <origin xyz="0 0 {z}"/><axis xyz="{axis}"/></joint>"""


@pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")
def test_an_arm_falls_as_in_pybullet_to_the_bit(tmp_path):
    pybullet = pytest.importorskip("pybullet")
    links = [("l0", -0.3, "1 0 0"), ("l1", -0.3, "0 1 0")]
    links = [("base", 0, "0 1 0"), *links]
    parts = [LINK.format(i=i, above=a, z=z, axis=x) for i, (a, z, x) in enumerate(links)]
    path, angles = tmp_path / "arm.urdf", (0.5, -0.3, 0.8)
    path.write_text(f'<robot name="arm"><link name="base"/>{"".join(parts)}</robot>')
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setTimeStep(1 / 240)
    pybullet.setGravity(0, 0, -G)
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE
    arm = pybullet.loadURDF(str(path), useFixedBase=True, flags=flags)
    for i, angle in enumerate(angles):
        free = {"linearDamping": 0, "angularDamping": 0, "jointDamping": 0, "maxJointVelocity": 1e9}
        pybullet.changeDynamics(arm, i, **free)
        pybullet.setJointMotorControl2(arm, i, pybullet.VELOCITY_CONTROL, force=0)
        pybullet.resetJointState(arm, i, angle, 0)
    for _ in range(240):
        pybullet.stepSimulation()
    theirs = [pybullet.getJointState(arm, i)[0] for i in range(3)]
    pybullet.disconnect(client)
    scene = em.Scene(engine="bullet")
    em.scenes.from_urdf(path, scene=scene)
    start = scene.pack(joints=dict(zip(("j0", "j1", "j2"), angles, strict=True)))
    last = em.World(scene).simulate(start, 240).states[-1]
    assert [last[scene.joint_slice(f"j{i}")][0] for i in range(3)] == theirs
