"""Sets of states in which two bodies touch."""

import json

import numpy as np
import pytest

import energymargin as em

PRESS = 20.0  # N, of each finger
ASIDE = 0.04  # m, of a finger from the middle at position 0 of its joint


def grip(shape=None, friction=0.6, gravity=-9.81, **options):
    """Two fingers on rails press on an object from both sides, and hold it."""
    scene = em.Scene(gravity=(0, 0, gravity))
    scene.add_body("palm", em.Box((0.02, 0.02, 0.02)), mass=0, position=(0, 0, 0.5))
    for side, sign in (("left", -1), ("right", 1)):
        pad = em.Box((0.02, 0.04, 0.04))
        scene.add_body(side, pad, mass=0.1, role="effector", friction=friction)
        scene.add_joint(
            f"{side} rail", parent="palm", child=side, type="prismatic", axis=(1, 0, 0),
            origin=(sign * ASIDE, 0, -0.1), stiffness=2000.0, damping=20.0,
            target=-sign * PRESS / 2000.0, torque_limit=PRESS,
        )  # fmt: skip
    box = em.Box((0.06, 0.06, 0.06)) if shape is None else shape
    scene.add_body("object", box, mass=0.2, role="object", friction=friction, position=(0, 0, 0.4))
    captured = em.regions.Touching("object", "left") & em.regions.Touching("object", "right")
    bounds = {"force": (5, 5, 40), "torque": (0.02, 0.02, 0.02)}
    return em.Problem(scene, scene.pack(), duration=0.1, captured=captured, **bounds, **options)


def settled(problem, seconds=0.3):
    wrench = np.zeros(6)
    state = em.World(problem.scene).rollout(problem.state, wrench, seconds).state
    return problem.with_state(state)


@pytest.fixture(scope="module")
def held():
    return settled(grip())


def moved(problem, gap):
    """The state with the object away from the left finger, into the right one."""
    scene = problem.scene
    state = scene.pack()
    state[scene.slice("object")][0] += gap
    return state


@pytest.mark.parametrize("gap", [None, 0.0, 0.002])
def test_bodies_touch_up_to_a_gap(gap):
    problem = grip()
    touching = em.regions.Touching("object", "left", **({} if gap is None else {"gap": gap}))
    edge = 1e-4 if gap is None else gap
    for distance, inside in ((edge - 1e-7, True), (edge + 1e-7, False), (-1e-3, True)):
        state = moved(problem, distance)
        apart = em.World(problem.scene).distance(state, "object", "left")
        assert apart == pytest.approx(distance, abs=1e-9)
        assert touching.contains(problem.scene, state) is inside


@pytest.mark.parametrize(
    "shape", [em.Box((0.06, 0.06, 0.06)), em.Sphere(0.03), em.Cylinder(0.03, 0.06)]
)
def test_the_force_is_that_with_which_both_bodies_press_on_each_other(shape):
    """Closed form: each finger presses with what its drive gives, as the object is at rest."""
    problem = settled(grip(shape))
    for share, inside in ((0.0, True), (0.99, True), (1.01, False)):
        for finger in ("left", "right"):
            for pair in (("object", finger), (finger, "object")):
                touching = em.regions.Touching(*pair, force=share * PRESS)
                assert touching.contains(problem.scene, problem.state) is inside
    contacts = em.World(problem.scene).contacts(problem.state)
    left = sum(c.normal_force for c in contacts if "left" in (c.body_a, c.body_b))
    exact = em.regions.Touching("object", "left", force=left)
    assert exact.contains(problem.scene, problem.state)


def test_what_touches_without_pressing_is_not_held():
    problem = grip()
    scene = em.Scene(gravity=(0, 0, 0))
    for name, x in (("object", 0.0), ("finger", 0.06)):
        scene.add_body(
            name, em.Box((0.06, 0.06, 0.06)), mass=0.2, role="object", position=(x, 0, 0)
        )
    touches = em.regions.Touching("object", "finger")
    presses = em.regions.Touching("object", "finger", force=1e-3)
    assert touches.contains(scene, scene.pack()) and not presses.contains(scene, scene.pack())
    assert (~presses).contains(scene, scene.pack())
    states = np.stack([moved(problem, 0.0), moved(problem, 0.01), problem.state])
    assert problem.captured.contains(problem.scene, states).tolist() == [True, False, True]


def test_scores_of_a_grip_are_the_same_on_any_number_of_threads(held):
    one, two = (
        em.capture_score(held, nodes=150, seed=2, threads=n, nodes_per_round=8) for n in (1, 2)
    )
    assert one.capture == two.capture and 0 < one.capture <= 1
    effort = em.escape_effort(held, nodes=600, seed=2)
    assert 0 < effort.effort < np.inf
    end = effort.tree.states[effort.path[-1]]
    world = em.World(held.scene)
    assert max(world.distance(end, "object", finger) for finger in ("left", "right")) > 1e-4
    asked = held.replace(horizon=0.4)
    parts = [em.capture_probability(asked, rollouts=40, seed=1, threads=n) for n in (1, 2)]
    assert parts[0].captured == parts[1].captured
    assert np.array_equal(parts[0].exit_times, parts[1].exit_times)


def test_a_rare_loss_of_touch_is_that_of_plain_rollouts():
    problem = settled(grip(gravity=0.0)).replace(horizon=0.25)
    problem = problem.replace(force=(26, 0, 0), torque=(0, 0, 0))
    plain = em.capture_probability(problem, rollouts=600, seed=3, threads=2)
    rare = em.capture_probability(problem, rollouts=400, seed=3, threads=2, rare=True)
    low, high = plain.interval(which="lost", confidence=0.99)
    rare_low, rare_high = rare.interval(which="lost", confidence=0.99)
    assert 0 < plain.lost < 1 and rare_low <= high and low <= rare_high


def test_files_and_pickles_keep_the_set(held, tmp_path):
    force = em.regions.Touching("object", "left", force=5.0, gap=0.0002)
    problem = held.replace(succeeded=force | ~em.regions.Touching("object", "right"))
    path = tmp_path / "grip.json"
    problem.save(path)
    written = json.loads(path.read_text())
    left = {"type": "touching", "body": "object", "other": "left"}
    assert written["captured"]["of"][0] == left  # defaults are left out
    assert written["succeeded"]["of"][0] == {**left, "force": 5.0, "gap": 0.0002}
    read = em.Problem.load(path)
    assert read.to_json() == problem.to_json()
    assert (
        repr(read.captured) == "Region((Touching('object', 'left') & Touching('object', 'right')))"
    )
    scores = [em.capture_score(one, nodes=60, seed=1) for one in (problem, read)]
    assert scores[0].success == scores[1].success > 0


@pytest.mark.parametrize(
    ("asked", "error"),
    [
        ({"force": -1.0}, "force is -1, expected a finite number of at least 0"),
        ({"gap": float("nan")}, "gap is nan"),
        ({"other": "object"}, "other is 'object', expected another body than body"),
    ],
)
def test_bad_values_are_refused(asked, error):
    with pytest.raises(ValueError, match=error):
        em.regions.Touching(**{"body": "object", "other": "left", **asked})


def test_bodies_that_never_touch_are_refused():
    scene = grip().scene
    with pytest.raises(ValueError, match="'thumb'"):
        em.regions.Touching("object", "thumb").contains(scene, scene.pack())
    with pytest.raises(ValueError, match="other is 'palm', which never collides with 'left'"):
        em.regions.Touching("left", "palm").contains(scene, scene.pack())
    scene.disable_collisions("object", "left")
    with pytest.raises(ValueError, match="'left', which never collides with 'object'"):
        em.regions.Touching("object", "left").contains(scene, scene.pack())


def test_a_force_is_refused_where_it_would_mean_something_else(held):
    pressed = em.regions.Touching("object", "left", force=1.0)
    problem = held.replace(captured=held.captured & pressed)
    plan = em.Plan(step=1 / 60, targets={"left rail": np.full(12, 0.01)})
    with pytest.raises(
        ValueError, match=r"captured is a set with a Touching of a force, .* gap alone"
    ):
        problem.replace(plan=plan)
    assert em.capture_probability(held.replace(plan=plan), rollouts=5).captured <= 1.0
    with pytest.raises(ValueError, match="a Touching of a force, expected one of a gap alone"):
        em.escape_energy(problem)


def test_the_lower_bound_says_that_it_knows_nothing_of_contacts():
    problem = grip()
    loose = em.Scene()
    loose.add_plane("ground")
    loose.add_body("object", em.Sphere(0.05), mass=0.2, role="object", position=(0, 0, 0.05))
    captured = em.regions.Touching("object", "ground")
    asked = em.Problem(
        loose, loose.pack(), force=(1, 1, 5), torque=(0, 0, 0), duration=0.2, captured=captured
    )
    assert em.effort_lower_bound(asked).reason == "the capture set is one of contacts"
    energy = em.escape_energy(asked, samples=300, seed=1)
    assert energy.energy == pytest.approx(0.2 * 9.81 * 1e-4, rel=0.1)  # J: it is lifted by the gap
    assert problem.captured.contains(problem.scene, problem.state)


def test_a_set_of_contacts_is_drawn_and_viewed(held):
    pytest.importorskip("matplotlib")
    em.plots.plot_state(held)
    em.plots.plot_state(held, em.capture_score(held, nodes=30, seed=1))


def test_a_belief_about_friction_asks_each_of_its_scenes(held):
    belief = em.Belief(held, friction={"object": 0.2})
    score = em.score_belief(belief, ["capture"], particles=4, nodes=40, threads=2)["capture"]
    assert 0 < score.mean <= 1
