"""Objects on joints: a drawer, a door, a lid; and sets of positions of joints."""

import numpy as np
import pytest
from pages import content_of, floats

import energymargin as em
from energymargin.look.viewer import view

STIFFNESS = 6.0  # N m/rad, of the door's spring
OPEN = 0.4  # rad


def door(stiffness=STIFFNESS, **options):
    """A door on a hinge, which a spring keeps closed."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("frame", em.Box((0.02, 0.02, 0.5)), mass=0)
    scene.add_body("door", em.Box((0.4, 0.02, 0.5)), mass=1.0, role="object")
    scene.add_joint(
        "hinge",
        parent="frame",
        child="door",
        origin=(0.02, 0, 0),
        child_origin=(-0.2, 0, 0),
        stiffness=stiffness,
        damping=0.01,
        limits=(-0.05, 1.5),
    )
    captured = em.regions.Joint("hinge", upper=OPEN)
    torque = {"force": (0, 0, 0), "torque": (0, 0, 3.0)}
    return em.Problem(scene, scene.pack(), **torque, duration=0.1, captured=captured, **options)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_effort_to_open_a_door_is_the_energy_of_its_spring(seed):
    effort = em.escape_effort(door(), nodes=40_000, seed=seed)
    right = 0.5 * STIFFNESS * OPEN**2
    assert right <= 1.001 * effort.effort
    assert effort.effort <= 1.12 * right


def test_work_on_a_door_is_its_gain_of_energy():
    """Without a spring all work becomes kinetic energy: exactly, as for a free body."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("frame", em.Box((0.02, 0.02, 0.5)), mass=0)
    scene.add_body("door", em.Box((0.4, 0.02, 0.5)), mass=1.0, role="object")
    scene.add_joint(
        "hinge", parent="frame", child="door", child_origin=(-0.2, 0, 0), origin=(0.02, 0, 0)
    )
    wrench = np.array([0.3, 1.0, 0.2, 0.0, 0.1, 0.4])
    rollout = em.World(scene).rollout(scene.pack(), wrench, 0.5, audit=True)
    speed = scene.unpack(rollout.state)["joints"]["hinge"]["velocity"]
    inertia = (0.4**2 + 0.02**2) / 12 + 0.2**2
    assert rollout.work == pytest.approx(0.5 * inertia * speed**2, rel=1e-9)
    assert abs(rollout.audit.leftover) < 1e-9 * rollout.audit.turnover


def drawer(friction=0.5):
    """A drawer on a rail."""
    scene = em.Scene()
    scene.add_body("cabinet", em.Box((0.3, 0.4, 0.3)), mass=0, position=(-0.2, 0, 0))
    box = em.Box((0.25, 0.3, 0.1))
    scene.add_body("drawer", box, mass=1.5, role="object", friction=friction)
    scene.add_joint(
        "slide", parent="cabinet", child="drawer", type="prismatic", axis=(1, 0, 0),
        origin=(0.05, 0, 0), limits=(0.0, 0.4), start=0.1, friction=1.0,
    )  # fmt: skip
    scene.disable_collisions("cabinet", "drawer")
    captured = em.regions.Joint("slide", lower=0.05, upper=0.3)
    return em.Problem(
        scene, scene.pack(), force=(8, 0, 0), torque=(0, 0, 0), duration=0.2, captured=captured
    )


def test_a_drawer_is_scored_saved_and_drawn(tmp_path):
    problem = drawer()
    score = em.capture_score(problem, nodes=200, seed=3)
    effort = em.escape_effort(problem, nodes=400, seed=3)
    assert 0 < score.capture < 1 and effort.effort > 0.04  # N m: its friction, over 5 cm at least
    path = tmp_path / "drawer.json"
    problem.save(path)
    read = em.Problem.load(path)
    assert repr(read.captured) == "Region(Joint('slide'))"
    assert em.capture_score(read, nodes=200, seed=3).capture == score.capture
    probability = em.capture_probability(problem.replace(horizon=0.5), rollouts=50, seed=1)
    low, high = probability.interval()
    assert 0 <= low < high <= 1
    em.plots.plot_state(problem)


def held_drawer(grip):
    """A drawer that two fingers hold by its knob, each with `grip` [N]; None: nothing holds it."""
    scene = em.Scene()
    scene.add_body("cabinet", em.Box((0.3, 0.4, 0.3)), mass=0, position=(-0.2, 0, 0))
    knob = em.Part(em.Box((0.04, 0.02, 0.02)), position=(0.145, 0, 0))
    box = em.Compound([em.Part(em.Box((0.25, 0.3, 0.1))), knob])
    scene.add_body("drawer", box, mass=1.5, friction=1.0, role="object")
    scene.add_joint(
        "slide", parent="cabinet", child="drawer", type="prismatic", axis=(1, 0, 0),
        origin=(0.05, 0, 0), limits=(0.0, 0.4), start=0.1, friction=1.0,
    )  # fmt: skip
    scene.disable_collisions("cabinet", "drawer")
    if grip:
        at = {"mass": 0, "position": (0.155, 0, 0), "role": "effector"}
        scene.add_body("palm", em.Box((0.02, 0.1, 0.02)), **at)
        closes = {"target": 0.04, "stiffness": 2000, "damping": 20, "torque_limit": grip}
        for name, side in (("left", -1), ("right", 1)):
            scene.add_body(
                name, em.Box((0.06, 0.01, 0.02)), mass=0.05, friction=0.5, role="effector"
            )
            scene.add_joint(
                name, parent="palm", child=name, type="prismatic", axis=(0, -side, 0),
                origin=(-0.03, side * 0.03, 0), limits=(0, 0.04), start=0.015, **closes,
            )  # fmt: skip
    captured = em.regions.Joint("slide", lower=0.05, upper=0.3)
    pull = {"force": (60, 0, 0), "torque": (0, 0, 0), "duration": 0.1}
    gripped = em.World(scene).simulate(scene.pack(), 60, record=[60]).states[0]
    return em.Problem(scene, gripped, captured=captured, **pull)


def test_a_hand_that_holds_a_drawer_makes_it_more_robust_and_mujoco_agrees(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    problems = [held_drawer(grip) for grip in (None, 5.0, 20.0)]
    found = [
        [em.escape_effort(problem, nodes=8000, seed=seed, search="published") for seed in (1, 2, 3)]
        for problem in problems
    ]
    # Each is an upper bound, so the least counts.
    loose, weak, strong = (min(each.effort for each in efforts) for efforts in found)
    assert loose < weak < 0.5 * strong
    # It slips from the fingers after 2 cm, and its rail has friction for 5.
    assert strong > 2 * 0.5 * 20 * 0.02 + 1.0 * 0.05
    chances = [
        em.capture_probability(problem.replace(horizon=0.5), rollouts=50, seed=1).captured
        for problem in (problems[0], problems[2])
    ]
    assert chances[0] + 0.1 < chances[1]
    held = problems[2]
    held.save(tmp_path / "held.json")
    read = em.Problem.load(tmp_path / "held.json")
    assert (
        em.escape_effort(read, nodes=8000, seed=1, search="published").effort == found[2][0].effort
    )
    model = em.mujoco.model_of(held.scene, held.state)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    assert em.mujoco.replay(model, data, held, found[2][0]).escaped


def test_scores_of_a_free_body_refuse_one_on_a_joint():
    for score in (em.escape_energy, em.effort_lower_bound):
        with pytest.raises(
            ValueError, match=f"'drawer' on a joint, expected a free body .* {score.__name__}"
        ):
            score(drawer())


def test_a_set_of_a_joint_is_about_one_that_moves():
    scene = door().scene
    inside = em.regions.Joint("hinge", lower=-0.1, upper=0.2)
    for angle, within in ((0.1, True), (0.3, False)):
        state = scene.pack(joints={"hinge": {"position": angle}})
        assert inside.contains(scene, state) is within
    with pytest.raises(ValueError, match="'hinge'"):
        em.regions.Joint("none").contains(scene, scene.pack())
    with pytest.raises(ValueError, match="lower is 1, expected a number up to upper, 0"):
        em.regions.Joint("hinge", lower=1, upper=0)


def test_a_replay_in_mujoco_agrees_on_a_door():
    mujoco = pytest.importorskip("mujoco")
    problem = door()
    model = em.mujoco.model_of(problem.scene, problem.state)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    effort = em.escape_effort(problem, nodes=1500, seed=2)
    replayed = em.mujoco.replay(model, data, problem, effort)
    assert replayed.escaped or replayed.least_scale <= 1.05


def test_a_drawer_of_a_mujoco_model_is_an_object():
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><body name="cabinet"><geom type="box" size=".2 .2 .02" pos="0 0 -.2"/>
        <body name="drawer"><joint name="slide" type="slide" axis="1 0 0" range="0 .4"
        limited="true" frictionloss="1"/><geom type="box" size=".15 .15 .05" mass="1.5"/>
        </body></body></worldbody></mujoco>"""
    )
    scene = em.scenes.from_mjcf(model, object="drawer")
    captured = em.regions.Joint("slide", lower=0.05, upper=0.3)
    at = scene.pack(joints={"slide": 0.1})
    pull = {"force": (8, 0, 0), "torque": (0, 0, 0), "duration": 0.2}
    effort = em.escape_effort(em.Problem(scene, at, captured=captured, **pull), nodes=5000).effort
    assert 1.01 * effort >= 0.05 and effort < 0.08  # 1 N over 5 cm


def with_a_cup():
    """A drawer that carries a free cup: both are objects, each with a set of its own."""
    scene = drawer().scene
    at = scene.unpack(scene.pack())["drawer"]["position"] + (0, 0, 0.08)
    scene.add_body("cup", em.Box((0.06,) * 3), mass=0.2, position=at, role="object")
    scene.disable_collisions("cabinet", "cup")
    stays = em.regions.Ball("cup", center=(0, 0, 0.08), radius=0.03, frame="drawer")
    captured = {"drawer": em.regions.Joint("slide", lower=0.05, upper=0.3), "cup": stays}
    bounds = {"force": (8, 0, 0), "torque": (0, 0, 0), "duration": 0.2}
    return em.Problem(scene, scene.pack(), captured=captured, **bounds)


def test_one_object_on_a_joint_and_a_free_one_have_the_same_bits_on_any_thread():
    problem = with_a_cup()
    score = em.capture_score(problem, nodes=150, seed=2)
    assert 0 < score.capture <= score.capture_any <= 1
    efforts = [
        em.escape_effort(problem, nodes=150, seed=2, captured=captured).effort
        for captured in ("all", "any")
    ]
    assert 0 < efforts[0] <= efforts[1]
    ahead = problem.replace(horizon=0.3, force=(2.5, 0, 0))
    one, two = (
        em.capture_probability(ahead, rollouts=40, seed=1, threads=threads, by_object=True)
        for threads in (1, 2)
    )
    each = [[of.captured for of in found.by_object.values()] for found in (one, two)]
    assert each[0] == each[1]
    both = each[0]
    assert 0 < one.captured <= min(both) and max(both) <= one.any.captured


def test_the_viewer_draws_an_object_on_a_joint_its_tree_and_its_way():
    problem = with_a_cup()
    content = content_of(view(problem, nodes=60))
    (shot,) = content["shots"]
    assert [body["object"] for body in shot["bodies"]].count(True) == 2
    for drawn, numbers in (("dots", 3), ("edges", 6)):
        assert len(floats(content, shot[drawn]["points"], -1, numbers)) > 60  # of two objects
