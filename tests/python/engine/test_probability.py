"""Plans, problems with a horizon, and the probability of staying captured."""

from __future__ import annotations

import pickle
import time

import numpy as np
import pytest
from futures import resting as alone

import energymargin as em

STEP = 1 / 240


def ball(bound: float, horizon: float | None = 0.5, **keywords: object) -> em.Problem:
    """A ball of 1 kg in free fall, captured within 0.5 m of its start."""
    scene = em.Scene(gravity=(0.0, 0.0, -9.81))
    scene.add_body("object", em.Sphere(0.05), mass=1.0, role="object")
    return em.Problem(
        scene,
        scene.pack(),
        force=(bound,) * 3,
        torque=(0.0, 0.0, 0.0),
        duration=0.5,
        captured=em.regions.Ball("object", (0.0, 0.0, 0.0), 0.5),
        horizon=horizon,
        **keywords,
    )


def pusher(gravity: float = 9.81) -> em.Scene:
    """A box on a floor, and an effector beside it."""
    scene = em.Scene(gravity=(0.0, 0.0, -gravity))
    scene.add_body("floor", em.Box((5.0, 5.0, 0.1)), mass=0, position=(0.0, 0.0, -0.05))
    scene.add_body(
        "object", em.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0.0, 0.0, 0.05), role="object"
    )
    scene.add_body(
        "effector", em.Box((0.1,) * 3), mass=1.0, position=(-0.3, 0.0, 0.06), role="effector"
    )
    return scene


def resting(scene: em.Scene, **keywords: object) -> em.Problem:
    """Will the box of `pusher` stay within 10 cm of its start?"""
    return em.Problem(
        scene,
        keywords.pop("state", scene.pack()),
        force=(1.0, 1.0, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.2,
        captured=em.regions.Ball("object", (0.0, 0.0, 0.05), 0.1),
        succeeded=em.regions.HalfSpace("object", (-1.0, 0.0, 0.0), -0.2),
        **keywords,
    )


# -- plans


def test_a_held_effector_keeps_its_velocity_through_a_collision():
    """Its motor is stronger than friction; the box moves on with it."""
    scene = pusher()
    start = scene.pack(effector={"velocity": (0.5, 0.0, 0.0)})
    plan = em.Plan.hold(scene, start, 1.0)
    states = em.World(scene, plan).simulate(start, 240).states
    assert np.allclose(states[:90, 20], 0.5, atol=1e-6)
    assert states[-1, 20] == pytest.approx(0.5, abs=1e-3)
    assert states[-1, 0] == pytest.approx(0.3, abs=0.01)  # 0.5 m of way, 0.2 m of it to the box


def test_a_motor_is_no_stronger_than_its_limit():
    """2 N on 1 kg give 2 m/s^2."""
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body("object", em.Sphere(0.05), mass=1.0, position=(9.0, 0.0, 0.0), role="object")
    scene.add_body("effector", em.Sphere(0.05), mass=1.0, role="effector")
    rows = np.zeros((120, 6))
    rows[:, 0] = 100.0
    plan = em.Plan(STEP, velocities={"effector": rows}, limits={"effector": (2.0, 1.0)})
    state = em.World(scene, plan).simulate(scene.pack(), 120).states[-1]
    assert state[20] == pytest.approx(1.0)


@pytest.mark.parametrize("jointed", [False, True])
def test_a_motor_moves_a_body_alike_with_and_without_joints_in_the_scene(jointed):
    """Two solvers do it."""
    scene = pusher()
    if jointed:
        scene.add_body("post", em.Box((0.1,) * 3), mass=0, position=(0.0, 2.0, 1.0))
        scene.add_body("arm", em.Box((0.1,) * 3), mass=1.0, position=(0.0, 2.5, 1.0))
        scene.add_joint(
            "hinge",
            parent="post",
            child="arm",
            type="revolute",
            axis=(0, 0, 1),
            child_origin=(0, -0.5, 0),
        )
    start = scene.pack(effector={"velocity": (0.5, 0.0, 0.0)})
    states = em.World(scene, em.Plan.hold(scene, start, 0.5)).simulate(start, 120).states
    assert states[-1][13] == pytest.approx(-0.0532, abs=2e-4)  # the impact holds it up for a moment


def test_the_base_of_a_gripper_is_carried_by_its_motor():
    """It holds two fingers against gravity."""
    scene = em.Scene()
    scene.add_body("object", em.Sphere(0.02), mass=0.1, position=(1.0, 0.0, 0.0), role="object")
    scene.add_body("palm", em.Box((0.1,) * 3), mass=1.0, position=(0.0, 0.0, 1.0), role="effector")
    scene.add_body(
        "finger", em.Box((0.02,) * 3), mass=0.1, position=(0.0, 0.0, 0.9), role="effector"
    )
    scene.add_joint(
        "slide",
        parent="palm",
        child="finger",
        type="prismatic",
        origin=(0, 0, -0.1),
        axis=(1, 0, 0),
        stiffness=100,
        damping=5,
    )
    start = scene.pack(palm={"velocity": (0.0, 0.0, 0.2)})
    world = em.World(scene, em.Plan.hold(scene, start, 0.5))
    unpacked = scene.unpack(world.simulate(start, 120).states[-1])
    assert unpacked["palm"]["position"][2] == pytest.approx(1.1, abs=1e-3)


def test_rows_of_a_longer_step_are_held():
    """As if each was there four times."""
    scene = pusher()
    coarse = np.random.default_rng(0).uniform(-5, 5, (30, 6))
    ends = [
        em.World(scene, plan).simulate(scene.pack(), 120).states[-1]
        for plan in (
            em.Plan(4 * STEP, wrenches={"effector": coarse}),
            em.Plan(STEP, wrenches={"effector": np.repeat(coarse, 4, axis=0)}),
        )
    ]
    assert np.array_equal(*ends)


def test_a_rollout_at_a_time_goes_on_where_the_plan_is():
    """As with a plan of the rows that are left."""
    scene, rows = pusher(), np.random.default_rng(1).uniform(-5, 5, (60, 6))
    whole = em.World(scene, em.Plan(STEP, wrenches={"effector": rows}))
    rest = em.World(scene, em.Plan(STEP, wrenches={"effector": rows[20:]}))
    push = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    later = whole.rollout(scene.pack(), push, 40 * STEP, time=20 * STEP)
    assert np.array_equal(later.state, rest.rollout(scene.pack(), push, 40 * STEP).state)
    first = whole.rollout(scene.pack(), push, 40 * STEP)
    assert not np.array_equal(later.state, first.state)


@pytest.mark.parametrize("time", [-0.1, float("nan"), 1e9])
def test_a_time_of_the_plan_that_cannot_be_is_refused(time):
    scene = pusher()
    world = em.World(scene, em.Plan.hold(scene, scene.pack(), 0.1))
    with pytest.raises(ValueError, match="time is"):
        world.rollout(scene.pack(), np.zeros(6), 0.1, time=time)


def test_a_plan_survives_pickling():
    """With its limits."""
    plan = em.Plan(STEP, velocities={"a": np.ones((3, 6))}, limits={"a": (2.0, 0.5)})
    again = pickle.loads(pickle.dumps(plan))
    assert again.limits == plan.limits == {"a": (2.0, 0.5)}
    assert np.array_equal(again.velocities["a"], plan.velocities["a"])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda s: em.Plan(STEP), "at least one row"),
        (lambda s: em.Plan(0.0, wrenches={"effector": np.zeros((2, 6))}), "step of the plan is 0"),
        (lambda s: em.Plan(STEP, wrenches={"effector": np.zeros((2, 5))}), r"\(any, 6\)|6"),
        (
            lambda s: em.Plan(
                STEP, wrenches={"effector": np.zeros((2, 6)), "object": np.zeros((3, 6))}
            ),
            "3 rows, expected 2 rows",
        ),
        (lambda s: em.Plan(STEP, wrenches={"effector": np.full((2, 6), np.nan)}), "finite"),
        (lambda s: em.Plan(STEP, velocities={"a": np.zeros((2, 6))}, limits={"b": (1, 1)}), "'b'"),
        (
            lambda s: em.World(s, em.Plan(0.003, wrenches={"effector": np.zeros((2, 6))})),
            "at least a step",
        ),
        (lambda s: em.World(s, em.Plan(STEP, wrenches={"floor": np.zeros((2, 6))})), "fixed body"),
        (lambda s: em.World(s, em.Plan(STEP, wrenches={"ghost": np.zeros((2, 6))})), "ghost"),
        (lambda s: em.Plan.hold(s, s.pack(), 0.0), "duration is 0"),
    ],
)
def test_bad_plans_are_refused(make, words):
    """With what is wrong and what was expected."""
    with pytest.raises(ValueError, match=words):
        make(pusher())


# -- problems with a clock


def test_the_horizon_is_that_of_the_plan_unless_given():
    """And a copy may ask about less, or about no time at all."""
    scene = pusher()
    problem = resting(scene, plan=em.Plan.hold(scene, scene.pack(), 1.0))
    assert problem.horizon == pytest.approx(1.0)
    assert problem.replace(horizon=0.5).horizon == pytest.approx(0.5)
    bare = problem.replace(horizon=None, plan=None)
    assert bare.horizon is None
    assert bare.plan is None
    assert bare.rate == problem.rate


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"horizon": 2.0}, "at least as long as the horizon"),
        ({"horizon": 0.001}, "whole steps"),
        ({"check": 0.003}, "check is 0.003"),
        ({"dwell": -1.0}, "dwell is -1"),
        ({"dwell": 1 / 240}, r"dwell is 0\.00416.*at least as long as `check`.*0\.0166"),
        ({"dwell": 1 / 60, "check": 1 / 40}, r"dwell is 0\.0166.*`check`.*0\.025 s"),
        ({"effector": "drive"}, "the plan says"),
    ],
)
def test_bad_clocks_are_refused(changes, words):
    """By the name of the argument."""
    scene = pusher()
    problem = resting(scene, plan=em.Plan.hold(scene, scene.pack(), 1.0))
    with pytest.raises(ValueError, match=words):
        problem.replace(**changes)


def test_replace_refuses_other_keywords():
    """As any function would."""
    with pytest.raises(TypeError, match="'horizont'"):
        ball(1.0).replace(horizont=1.0)


@pytest.mark.parametrize("metric", [em.capture_score, em.force_score, em.escape_energy])
def test_scores_without_a_clock_refuse_a_horizon(metric):
    """And say how to ask them."""
    scene = pusher()
    problem = resting(scene, horizon=0.5)
    with pytest.raises(ValueError, match=r"replace\(horizon=None, plan=None\)"):
        metric(problem)


def test_with_state_asks_the_same_of_another_state():
    """Measured contacts do not come along."""
    problem = ball(1.0)
    moved = problem.scene.pack(object={"position": (0.0, 0.0, 0.1)})
    other = problem.with_state(moved)
    assert np.array_equal(other.state, moved)
    assert other.horizon == problem.horizon


# -- the probability


@pytest.mark.parametrize("bound", [0.5, 5.0, 9.81])
def test_a_ball_in_free_fall_is_lost(bound):
    """However many rollouts, and as the undisturbed one says."""
    for rollouts in (10, 300):
        found = em.capture_probability(ball(bound), rollouts=rollouts, seed=3)
        assert found.captured <= 0.034
        assert not found.undisturbed
        assert found.undisturbed_time == pytest.approx(np.sqrt(2 * 0.5 / 9.81), abs=0.02)


def test_a_box_at_rest_stays():
    """With an interval beside its 1."""
    scene = pusher()
    found = em.capture_probability(resting(scene, horizon=0.5), rollouts=40)
    assert found.captured == 1.0
    assert found.mean_time == pytest.approx(0.5)
    low, high = found.interval()
    assert low == pytest.approx(0.025 ** (1 / 40))  # Clopper and Pearson, all of 40
    assert high == 1.0


def test_the_curve_falls_and_its_area_is_the_mean_time():
    """But for what lies between two looks."""
    found = em.capture_probability(ball(30.0), rollouts=500, seed=1)
    assert found.curve[0] == 1.0
    assert (np.diff(found.curve) <= 0).all()
    assert found.curve[-1] == found.captured
    area = np.sum(found.curve[:-1] * np.diff(found.times))
    assert found.mean_time == pytest.approx(area, abs=1e-9)


def test_threads_give_the_same_bits():
    """And so does a prefix of the rollouts."""
    curves = {
        em.capture_probability(ball(30.0), rollouts=60, threads=threads).curve.tobytes()
        for threads in (1, 2, 3)
    }
    assert len(curves) == 1


def test_a_start_outside_is_lost_at_once():
    """From the first time on."""
    problem = ball(5.0)
    outside = problem.scene.pack(object={"position": (0.0, 0.0, 2.0)})
    found = em.capture_probability(problem.replace(state=outside), rollouts=5)
    assert found.captured == found.curve[0] == found.mean_time == 0.0


def test_success_is_asked_at_the_horizon_whether_or_not_captured():
    """The effector pushes the box out of its place, and to where it is wanted."""
    scene = pusher()
    start = scene.pack(effector={"velocity": (0.5, 0.0, 0.0)})
    plan = em.Plan.hold(scene, start, 1.0)
    found = em.capture_probability(
        resting(scene, state=start, plan=plan), rollouts=10, success=True
    )
    assert found.captured == 0.0
    assert found.success == 1.0
    assert found.undisturbed_success


def test_a_short_excursion_does_not_count_with_a_dwell():
    """A ball that is thrown up out of its set comes back within 0.25 s."""
    problem = ball(0.001).replace(
        state=ball(0.001).scene.pack(object={"velocity": (0.0, 0.0, 3.3)}), horizon=0.6
    )
    assert not em.capture_probability(problem, rollouts=2).undisturbed
    assert em.capture_probability(problem.replace(dwell=0.25), rollouts=2).undisturbed


def test_a_tolerance_adds_rollouts_until_it_is_met():
    """At fixed looks, and the interval pays for them."""
    found = em.capture_probability(ball(30.0), tolerance=0.05, seed=2)
    low, high = found.interval()
    assert high - low <= 0.1 + 1e-9
    assert found.rollouts in (32, 64, 128, 256, 512, 1024, 2048)


def test_costly_paths_count_less_under_boltzmann():
    """A box that only a strong push gets out is safer; no weight is lost at rate 0."""
    scene = pusher()
    problem = resting(scene, horizon=0.5).replace(force=(15.0, 15.0, 0.0))
    models = em.disturbances
    plain = em.capture_probability(problem, rollouts=200)
    same = em.capture_probability(problem, rollouts=200, disturbance=models.Boltzmann(0.0))
    weighted = em.capture_probability(problem, rollouts=200, disturbance=models.Boltzmann(5.0))
    assert same.captured == pytest.approx(plain.captured)
    assert weighted.captured > plain.captured
    assert weighted.effective < 200 == same.effective


def test_the_noise_of_the_robot_alone_loses_a_ball_that_it_carries():
    """A plate under a ball trembles; without the noise it is still."""
    scene = em.Scene()
    scene.add_body("object", em.Sphere(0.05), mass=0.1, position=(0, 0, 0.06), role="object")
    scene.add_body("effector", em.Box((0.3, 0.3, 0.02)), mass=1.0, role="effector")
    state = scene.pack()
    problem = em.Problem(
        scene,
        state,
        force=(0.1, 0, 0),
        torque=(0, 0, 0),
        duration=0.1,
        captured=em.regions.Ball("object", (0, 0, 0.06), 0.05),
        plan=em.Plan.hold(scene, state, 0.5),
    )
    still = em.capture_probability(problem, disturbance=em.disturbances.of_plan(), rollouts=3)
    shaken = em.capture_probability(
        problem,
        disturbance=em.disturbances.of_plan(force=(0, 0, 400), hold=0.1),
        rollouts=20,
    )
    assert still.captured == 1.0
    assert shaken.captured < 0.5


def test_a_function_is_a_disturbance_too():
    """It gets a generator and the times."""

    def steady(random: np.random.Generator, times: np.ndarray) -> np.ndarray:
        assert times[1] == pytest.approx(STEP)
        return np.tile([0.0, 0.0, 9.81, 0.0, 0.0, 0.0], (len(times), 1))

    found = em.capture_probability(ball(1.0), disturbance=steady, rollouts=4)
    assert found.captured == 1.0
    assert not found.undisturbed


def test_the_time_of_such_a_function_counts_towards_the_timeout():
    def slow(random: np.random.Generator, times: np.ndarray) -> np.ndarray:
        time.sleep(0.05)
        return np.zeros((len(times), 6))

    with pytest.raises(TimeoutError):
        em.capture_probability(ball(1.0), disturbance=slow, rollouts=10, timeout=0.2)


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"rollouts": 0}, "rollouts is 0"),
        ({"disturbance": em.disturbances.Uniform(objects=2)}, "objects is 2"),
        ({"disturbance": em.disturbances.of_plan((1, 0, 0))}, "a problem with a plan"),
        ({"disturbance": lambda random, times: np.zeros((2, 6))}, "disturbance"),
        ({"disturbance": lambda random, times: np.zeros((120, 6)), "tolerance": 0.1}, "function"),
        ({"success": True}, "success set"),
        ({"by_object": True}, "for each object"),
        ({"tolerance": -1.0}, "tolerance is -1"),
    ],
)
def test_bad_questions_are_refused(keywords, words):
    """By the name of the argument."""
    with pytest.raises(ValueError, match=words):
        em.capture_probability(ball(1.0), **keywords)


def test_a_problem_without_a_clock_is_refused():
    """And told how to get one."""
    with pytest.raises(ValueError, match=r"replace\(horizon="):
        em.capture_probability(ball(1.0, horizon=None))


def test_intervals_hold():
    """Of 300 estimates from 20 rollouts, all but a few have the truth within their interval."""
    problem = ball(30.0)
    problem = problem.replace(horizon=0.3, captured=em.regions.Ball("object", (0, 0, 0), 0.55))
    truth = em.capture_probability(problem, rollouts=4000, seed=999, threads=2).captured
    assert 0.05 < truth < 0.95
    inside = 0
    for seed in range(300):
        low, high = em.capture_probability(problem, rollouts=20, seed=seed).interval()
        inside += low <= truth <= high
    assert inside >= 279  # 93 of 100


# -- as a metric


def test_a_batch_gives_the_bits_of_single_calls():
    """Each problem has its own stream; those with a clock have other metrics than those without."""
    problems = [ball(bound) for bound in (15.0, 20.0, 30.0)]
    table = em.score(problems, seed=4, rollouts=20, nodes=20)
    assert set(table.scores) == {"probability", "effort", "effort/est", "effort/rrt"}
    single = [
        em.capture_probability(problem, rollouts=20, seed=em.stream(4, i)).captured
        for i, problem in enumerate(problems)
    ]
    assert table["probability"].tolist() == single


def test_a_metric_that_the_problem_cannot_answer_is_refused():
    """By name, with what to do."""
    with pytest.raises(ValueError, match=r"replace\(horizon="):
        em.score([ball(1.0, horizon=None)], metrics=("probability",))


@pytest.mark.parametrize(
    "disturbance",
    [
        em.disturbances.Uniform(1.2),
        em.disturbances.Gaussian(0.7, 0.0, 0.1),
        lambda random, times: np.tile([random.normal(), 0, 0, 0, 0, 0], (len(times), 1)),
    ],
)
def test_a_part_of_the_rollouts_has_the_bits_of_the_whole(disturbance):
    """By the numbers of its rollouts."""
    asked = alone(horizon=0.5)
    words = {"disturbance": disturbance, "success": True, "seed": 3}
    whole = em.capture_probability(asked, rollouts=12, **words)
    parts = [
        em.capture_probability(asked, first=first, rollouts=count, undisturbed=False, **words)
        for first, count in ((0, 5), (5, 7))
    ]
    assert np.array_equal(whole.exit_times, np.concatenate([p.exit_times for p in parts]))
    assert np.array_equal(whole.successes, np.concatenate([p.successes for p in parts]))
    assert 0 < np.isinf(whole.exit_times).sum() < 12


def test_exit_times_are_those_of_the_curve():
    p = em.capture_probability(
        alone(horizon=0.5), disturbance=em.disturbances.Uniform(1.2), rollouts=40
    )
    captured = [(p.exit_times > time).mean() for time in p.times]
    assert np.allclose(p.curve, captured)
    assert p.mean_time == pytest.approx(np.minimum(p.exit_times, 0.5).mean())
    assert p.successes is None


def test_without_the_undisturbed_rollout_nothing_is_said_of_it():
    p = em.capture_probability(alone(horizon=0.5), rollouts=2, undisturbed=False)
    assert p.undisturbed is None and np.isnan(p.undisturbed_time)
    assert p.steps < em.capture_probability(alone(horizon=0.5), rollouts=2).steps
