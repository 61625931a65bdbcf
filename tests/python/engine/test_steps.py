"""How long a step may be, and the same question with another step."""

import numpy as np
import pytest

import energymargin as em

STEP = 1 / 240
QUIET = {"force": (1e-9,) * 3, "torque": (1e-9,) * 3, "duration": 0.1}
HEIGHT = 2.0**2 / (2 * 9.81)  # of a ball thrown up at 2 m/s


def thrown(below, **changes):
    """Whether a ball stays below a height; a step h lets it rise by 2 m/s h / 2 less."""
    scene = em.Scene()
    scene.add_body("ball", em.Sphere(0.02), mass=0.1, role="object", velocity=(0, 0, 2.0))
    captured = em.regions.HalfSpace("ball", (0.0, 0.0, 1.0), below)
    keywords = {"horizon": 0.5, "captured": captured, **QUIET, **changes}
    return em.Problem(scene, scene.pack(), **keywords)


def test_the_longest_step_is_the_first_that_answers_as_the_finest():
    choice = em.longest_step(thrown(HEIGHT - 0.01), rollouts=200, threads=1)
    assert choice.settled and choice.step == pytest.approx(2 * STEP)
    assert [each.captured.tolist() for each in choice.tried] == [[1.0], [1.0], [0.0], [0.0]]
    assert [each.worse.tolist() for each in choice.tried] == [[0], [0], [0], [0]]
    assert choice.tried[0].differences.tolist() == [1.0]
    assert choice.tried[-1].step == pytest.approx(STEP / 4)


def test_one_state_of_many_that_is_off_is_enough():
    easy = [thrown(HEIGHT + 0.2) for _ in range(60)]
    choice = em.longest_step([*easy, thrown(HEIGHT - 0.01)], rollouts=50, error=0.05, threads=2)
    first = choice.tried[0]
    low, high = first.interval()
    assert low >= -0.05 and high <= 0.05  # the mean alone would do
    assert choice.step == pytest.approx(2 * STEP)


def test_where_no_step_holds_that_is_told():
    choice = em.longest_step(thrown(HEIGHT - 0.01), rollouts=10, threads=1)
    assert not choice.settled and choice.step == pytest.approx(STEP / 4)
    assert str(choice).startswith("No step is within 0.02 of the finest")


def test_a_step_that_does_not_fit_is_told():
    choice = em.longest_step(thrown(HEIGHT + 0.2, horizon=0.1, check=0.025), rollouts=200)
    assert choice.step == pytest.approx(2 * STEP)  # 0.025 s are 6 of the scene's steps
    assert "check" in choice.tried[0].refused and "check" in str(choice)
    with pytest.raises(ValueError, match=r"check is 0\.025, expected whole steps"):
        thrown(HEIGHT, check=0.025).with_step(4 * STEP)


def test_with_its_own_step_a_problem_is_the_same():
    problem = thrown(HEIGHT)
    assert problem.with_step(STEP).to_json() == problem.to_json()
    assert problem.with_step(2 * STEP).scene.step == pytest.approx(2 * STEP)


def test_a_plan_of_longer_steps_has_means_and_the_last_targets():
    task = em.tasks.make("push")
    push = task.rollout(seed=1)
    ahead = task.future(push.states[2], push.times[2], push.params, horizon=0.1, plan="script")
    coarse = ahead.with_step(4 * STEP)
    rows = ahead.plan.wrenches["effector"]
    assert coarse.plan.rows == 6 and coarse.plan.step == pytest.approx(4 * STEP)
    assert np.allclose(coarse.plan.wrenches["effector"], rows.reshape(6, 4, 6).mean(1))
    back = coarse.with_step(STEP)  # fine rows are what rows of a longer step are taken as
    assert back.plan.step == pytest.approx(4 * STEP) and back.scene.step == STEP


def test_a_policy_keeps_its_control_times_with_a_longer_step():
    push = (task := em.tasks.make("push")).rollout(seed=1)
    ahead = task.future(push.states[2], push.times[2], push.params, horizon=0.5, plan="script")
    asked: list[float] = []

    def act(seen, memory, time):
        asked.append(time)
        return np.zeros((len(seen), 1))

    def problem(period):
        policy = em.Policy(act, observe=["effector.x"], command=["effector.fy"], period=period)
        return ahead.replace(plan=policy)

    em.capture_probability(problem(0.1).with_step(4 * STEP), rollouts=4, threads=1, warn=False)
    assert sorted(set(asked)) == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    with pytest.raises(ValueError, match="at least a step of the scene"):
        problem(STEP).with_step(4 * STEP)


def test_threads_and_other_problems_change_no_choice():
    problems = [thrown(HEIGHT - 0.01), thrown(HEIGHT + 0.2)]
    one, two = (em.longest_step(problems, rollouts=200, threads=n) for n in (1, 2))
    assert one.step == two.step
    for a, b in zip(one.tried, two.tried, strict=True):
        assert np.array_equal(a.captured, b.captured) and np.array_equal(a.worse, b.worse)


def test_a_spring_that_is_too_stiff_for_a_longer_step_is_refused():
    scene = em.Scene()
    scene.add_body("ball", em.Sphere(0.02), mass=0.1, role="object")
    scene.add_body("post", em.Box((0.01, 0.01, 0.01)), mass=0.0, position=(0, 0, 1.0))
    scene.add_spring("ball", "post", stiffness=1000.0, rest_length=1.0)
    captured = em.regions.HalfSpace("ball", (0.0, 0.0, 1.0), 9.0)
    problem = em.Problem(scene, scene.pack(), captured=captured, **QUIET)
    with pytest.raises(ValueError, match="stiffness"):
        problem.with_step(8 * STEP)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"problems": []}, "0 steps"),
        ({"problems": [thrown(1.0), thrown(1.0).with_step(STEP / 2)]}, "2 steps"),
        ({"problems": thrown(1.0, horizon=None)}, "no horizon"),
        ({"problems": thrown(1.0), "error": 2.0}, "error"),
        ({"problems": thrown(1.0), "rollouts": 0}, "rollouts"),
    ],
)
def test_what_is_asked_badly_is_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        em.longest_step(**arguments)


def test_a_cancel_ends_it():
    cancel = em.Cancel()
    cancel.set()
    with pytest.raises(em.Cancelled):
        em.longest_step(thrown(1.0), cancel=cancel)


def diverging_from(step, rollouts):
    """Pushes with which so many rollouts diverge if steps are that long: on one thread."""
    left = {}

    def pushes(random, times):
        wrenches = np.zeros((len(times), 6))
        length = round(1 / (times[1] - times[0]))
        left[length] = left.get(length, rollouts) - 1
        if times[1] - times[0] > 0.9 * step and left[length] >= 0:
            wrenches[:] = 1e308
        return wrenches

    return pushes


def test_a_step_that_diverges_is_too_long():
    choice = em.longest_step(
        thrown(HEIGHT + 0.2), rollouts=200, threads=1, disturbance=diverging_from(4 * STEP, 3)
    )
    assert choice.settled and choice.step == pytest.approx(2 * STEP)
    assert ["3 of 200 rollouts" in one.refused for one in choice.tried[:2]] == [True, True]
    assert "diverged" in str(choice)


def test_a_rollout_in_a_hundred_that_diverges_is_left_out_of_its_pair():
    choice = em.longest_step(
        thrown(HEIGHT + 0.2), rollouts=200, threads=1, disturbance=diverging_from(4 * STEP, 2)
    )
    assert choice.step == pytest.approx(8 * STEP)
    assert choice.tried[0].pairs.tolist() == [198] and choice.tried[0].captured.tolist() == [1.0]


def test_a_finest_step_that_diverges_has_no_answer():
    with pytest.raises(em.DivergedError, match=r"200 of 200 rollouts of problem 0 with a step of"):
        em.longest_step(
            thrown(HEIGHT + 0.2), rollouts=200, threads=1, disturbance=diverging_from(0.0, 200)
        )
