"""The margin along a plan: its answers where they are known, and what may not change them."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from futures import STEP, carried, waving
from matplotlib.colors import same_color
from sliding import EDGE, MASS, diverging, problem

import energymargin as em

FORCE = 10.0  # N
SPEED, AHEAD = 0.5, 0.5  # m/s, s


def one_push(random, times):
    """A force along x that stays the same, even within +-FORCE."""
    wrenches = np.zeros((len(times), 6))
    wrenches[:, 0] = random.uniform(-FORCE, FORCE)
    return wrenches


def coasting():
    """A box on its way to an edge, at 0.75 m from the middle at last."""
    return problem(0.0, SPEED).replace(horizon=2.0)


@pytest.fixture(scope="module")
def coasted():
    return em.margin_profile(
        coasting(), every=0.25, ahead=AHEAD, disturbance=one_push, rollouts=400, nodes=300
    )


def gate():
    """A box that its plan pushes along x, through a gate in the middle of the way."""
    wide = em.regions.Box("box", (0.1, 0.0, 0.0), (1.0, 0.2, 1.0))
    jambs = em.regions.Box("box", (0.1, 0.0, 0.0), (0.06, 0.2, 1.0))
    opening = em.regions.Box("box", (0.1, 0.0, 0.0), (0.06, 0.012, 1.0))
    return carried(1.4).replace(captured=(wide & ~jambs) | opening, force=(0.0, 0.1, 0.0))


@pytest.fixture(scope="module")
def through_the_gate():
    return em.margin_profile(gate(), ahead=0.3, rollouts=60, nodes=150)


def test_probabilities_are_those_of_the_closed_form(coasted):
    assert coasted.times == pytest.approx(np.arange(0.0, 1.6, 0.25))
    way = EDGE - SPEED * coasted.times - SPEED * AHEAD
    largest = way * 2 * MASS / AHEAD**2  # the force with which it just stays
    expected = np.clip((largest + FORCE) / (2 * FORCE), 0.0, 1.0)
    assert np.all(coasted.low <= expected + 0.02) and np.all(expected - 0.02 <= coasted.high)
    assert expected[-1] == pytest.approx(0.5) and coasted.probabilities[0] == 1.0


def test_the_same_draws_everywhere_make_the_probability_fall_from_moment_to_moment(coasted):
    assert np.all(np.diff(coasted.probabilities) <= 0.0)
    assert coasted.weakest.number == len(coasted) - 1


def test_efforts_are_near_the_least_work_and_no_less(coasted):
    """The full force at first, then coasting, is the least that reaches the edge in time."""
    reached = coasted.times > 0.9
    missing = EDGE - SPEED * coasted.times[reached] - SPEED * AHEAD
    acceleration = FORCE / MASS
    pushing = AHEAD - np.sqrt(AHEAD**2 - 2 * missing / acceleration)
    least = MASS / 2 * ((SPEED + acceleration * pushing) ** 2 - SPEED**2)
    efforts = coasted.efforts[reached]
    assert np.all(efforts >= 0.99 * least) and np.all(efforts < 1.6 * least + 0.01)
    assert np.isinf(coasted.efforts[0])  # no force within the bounds is enough


def test_a_push_through_a_gate_is_weakest_there(through_the_gate):
    weakest = through_the_gate.weakest
    box = through_the_gate.problems[weakest.number].scene
    assert weakest.probability == through_the_gate.probabilities.min() < 0.8
    assert through_the_gate.probabilities[0] == through_the_gate.probabilities[-1] == 1.0
    assert box.step == STEP and 0.2 <= weakest.time <= 0.8
    assert weakest.effort == through_the_gate.efforts.min() < through_the_gate.efforts[0]
    assert f"weakest at {weakest.time:.4g} s" in repr(through_the_gate)


def test_each_moment_has_the_scores_of_its_problem_alone(through_the_gate):
    number = through_the_gate.weakest.number
    one = through_the_gate.problems[number]
    p = em.capture_probability(one, rollouts=60, seed=0)
    assert through_the_gate.probabilities[number] == pytest.approx(p.captured, abs=1e-15)
    ends = through_the_gate.low[number], through_the_gate.high[number]
    assert ends == pytest.approx(p.interval())
    effort = em.escape_effort(one, nodes=150, seed=em.stream(0, 0)).effort
    assert through_the_gate.efforts[number] == effort


def test_moments_follow_the_plan_and_have_what_is_left_of_it():
    whole = waving(0.5)
    found = em.margin_profile(whole, rollouts=1, effort=False)
    rows = np.asarray(whole.plan.wrenches["pusher"])
    steps = [round(time / STEP) for time in found.times]
    assert steps == [0, 24, 48, 72, 96]
    states = em.World(whole.scene, whole.plan).simulate(whole.state, 96, record=steps).states
    assert np.array_equal(found.states, states)
    for first, one in zip(steps, found.problems, strict=True):
        assert np.array_equal(one.plan.wrenches["pusher"], rows[first:])
        assert one.horizon == pytest.approx(0.5 - first * STEP)


def test_another_plan_takes_the_place_of_the_problems_own():
    rows = np.zeros((48, 6))
    found = em.margin_profile(
        carried(), em.Plan(STEP, wrenches={"pusher": rows}), effort=False, rollouts=1
    )
    assert found.times.tolist() == [0.0, 0.1]
    assert found.problems[1].plan.wrenches["pusher"].shape == (24, 6)


def test_moments_after_the_exit_are_not_captured_and_never_the_weakest():
    found = em.margin_profile(carried(), ahead=0.1, effort=False, rollouts=20)
    assert found.captured.tolist() == [True, True, True, True, False, False]
    assert np.all(found.probabilities[~found.captured] == 0.0)
    assert found.weakest.number == 3
    assert "6 moments, 2 of them not captured" in repr(found)


def test_the_last_moment_looks_no_further_than_the_end():
    rest = em.margin_profile(coasting(), every=0.5, rollouts=1, effort=False)
    assert rest.ahead == pytest.approx([2.0, 1.5, 1.0, 0.5])
    ahead = em.margin_profile(coasting(), every=0.5, ahead=1.2, rollouts=1, effort=False)
    assert ahead.times == pytest.approx([0.0, 0.5])
    assert ahead.ahead == pytest.approx([1.2, 1.2])


@pytest.mark.parametrize("workers", [{"threads": 1}, {"executor": em.executors.Processes(2)}])
def test_bits_depend_on_no_executor(through_the_gate, workers):
    again = em.margin_profile(gate(), ahead=0.3, rollouts=60, nodes=150, **workers)
    assert again.to_csv() == through_the_gate.to_csv()


def test_without_efforts_they_are_missing():
    found = em.margin_profile(coasting(), every=0.5, effort=False, rollouts=2)
    assert np.isnan(found.efforts).all() and "effort" not in repr(found)


def test_progress_counts_rollouts_and_searches():
    seen = []
    em.margin_profile(
        coasting(), every=0.5, rollouts=2, nodes=10, progress=lambda *done: seen.append(done)
    )
    assert seen[-1] == (12, 12) and [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_a_cancel_keeps_what_is_done_and_says_so():
    cancel = em.Cancel()
    found = em.margin_profile(
        coasting(),
        every=0.05,
        rollouts=2,
        nodes=10,
        progress=lambda done, total: cancel.set() if done >= 8 else None,
        cancel=cancel,
    )
    assert not found.complete and "stopped early" in repr(found)
    there = ~np.isnan(found.probabilities)
    assert there.any() and not np.isnan(found.low[there]).any()
    assert np.isnan(found.efforts).all()
    with pytest.raises(em.Cancelled):
        em.margin_profile(coasting(), cancel=cancel)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"problem": 1}, "problem is 1, expected a Problem"),
        ({"plan": "hold"}, "plan is 'hold', expected a Plan"),
        ({"problem": coasting().replace(horizon=None)}, "problem is without plan and horizon"),
        ({"every": 0.001}, "every is 0.001 s, expected at least a step of 0.00416667 s"),
        ({"every": 0.0}, "every is 0.0, expected a positive number"),
        ({"ahead": 2.5}, "ahead is 2.5 s, expected at most the 2 s there are"),
        ({"ahead": 0.001}, "ahead is 0.001 s, expected whole steps"),
        ({"rollouts": 0}, "rollouts is 0"),
        ({"nodes": 0}, "nodes is 0"),
        ({"effort": 1}, "effort is 1, expected true or false"),
        ({"disturbance": em.disturbances.Boltzmann(1.0)}, "disturbance is Boltzmann(rate=1.0"),
    ],
)
def test_bad_input_is_refused(given, message):
    with pytest.raises(ValueError) as error:
        em.margin_profile(**{"problem": coasting(), **given})
    assert str(error.value).startswith(message)


def test_moments_at_50_hz_are_50_a_second():
    found = em.margin_profile(coasting(), every=0.02, ahead=1.0, rollouts=1, effort=False)
    assert np.round(found.times[:6] * 240, 6).tolist() == [0, 5, 10, 14, 19, 24]
    assert len(found) == 51 and found.times[-1] == pytest.approx(1.0)


def test_a_plan_of_50_hz_is_followed():
    problem = coasting()
    body = next(body.name for body in problem.scene.bodies if not body.fixed)
    plan = em.Plan(0.02, wrenches={body: np.zeros((20, 6))})
    found = em.margin_profile(problem, plan, every=0.1, rollouts=1, effort=False)
    assert found.times[-1] + found.ahead[-1] == pytest.approx(0.4)


def test_a_line_for_each_moment_of_a_table(through_the_gate):
    head, *lines = through_the_gate.to_csv().splitlines()
    assert head == "time,ahead,captured,probability,low,high,effort"
    assert len(lines) == len(through_the_gate) == 12
    assert lines[0].split(",")[3] == "1.0"


def test_it_can_be_pickled_and_shown(through_the_gate):
    again = pickle.loads(pickle.dumps(through_the_gate))
    assert again.to_csv() == through_the_gate.to_csv()
    html = through_the_gate._repr_html_()
    assert "Margin along a plan" in html and "data:image/png" in html


def test_the_picture_marks_the_weakest_moment_in_both_axes(through_the_gate):
    above, below = em.plots.figure_margin_profile(through_the_gate).axes
    weakest = through_the_gate.weakest
    for ax, value in ((above, weakest.probability), (below, weakest.effort)):
        (mark,) = (line for line in ax.lines if line.get_marker() == "D")
        assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (weakest.time, value)
    assert (
        len(
            em.plots.figure_margin_profile(
                em.margin_profile(coasting(), effort=False, rollouts=1)
            ).axes
        )
        == 1
    )


def test_the_picture_shades_what_is_not_captured():
    found = em.margin_profile(carried(), ahead=0.1, effort=False, rollouts=5)
    ax = em.plots.plot_margin_profile(found)
    shades = [p for p in ax.patches if same_color(p.get_facecolor()[:3], "#D55E00")]
    assert len(shades) == 2
    with pytest.raises(ValueError, match="profile is 1, expected a MarginProfile"):
        em.plots.plot_margin_profile(1)


@pytest.mark.parametrize(("most", "scale"), [(20.0, "linear"), (40.0, "log")])
def test_efforts_that_differ_much_have_a_logarithmic_axis(through_the_gate, most, scale):
    efforts = np.full(len(through_the_gate), np.inf)
    efforts[:2] = 1.0, most
    _, below = em.plots.figure_margin_profile(replace(through_the_gate, efforts=efforts)).axes
    low, high = below.get_ylim()
    assert below.get_yscale() == scale
    assert low < 1.0 and high > most
    assert "no escape found" in [text.get_text() for text in below.get_legend().texts]


def test_another_plan_takes_the_place_of_a_drive():
    task = em.tasks.make("push", friction=0.3)
    push = task.rollout(seed=3)
    driven = task.problem(push.states[0], push.params)
    assert driven.effector == "drive"
    rows = np.zeros((60, 6))
    rows[:, 1] = 9.0
    plan = em.Plan(1 / 240, wrenches={"effector": rows})
    along_it = em.margin_profile(driven, plan, every=0.125, rollouts=4, effort=False)
    assert len(along_it) == 2 and along_it.problems[0].effector == "coast"


def test_the_moments_end_where_a_state_makes_no_problem():
    """A box that leaves the bounds of the states: the moments before it are told, and why."""
    bounds = em.regions.HalfSpace("object", (1, 0, 0), 0.9)
    moving = problem(0.0, 2.0, within=bounds)
    found = em.margin_profile(moving, every=0.25, rollouts=4, effort=False)
    assert np.allclose(found.times, [0.0, 0.25]) and found.complete
    assert "after 0.5 s of the nominal motion: state is outside" in found.ended
    assert found.ended in repr(found)
    assert em.margin_profile(problem(), every=0.5, rollouts=4, effort=False).ended is None


def test_results_are_themselves_alone():
    """They hold arrays, which have no one answer to ==."""
    first, second = (
        em.margin_profile(problem(), every=0.5, rollouts=4, effort=False) for _ in range(2)
    )
    assert first != second and len({first, second}) == 2


def test_rollouts_that_diverge_do_not_count_at_a_moment_and_too_many_are_an_error():
    asked = problem(horizon=0.5)
    found = em.margin_profile(
        asked, every=0.25, rollouts=20, disturbance=diverging(1), effort=False, threads=1
    )
    assert found.diverged.tolist() == [1, 0]
    assert not np.isnan(found.probabilities).any()
    with pytest.raises(em.DivergedError, match="2 of 20 rollouts of the moment at 0 s diverged"):
        em.margin_profile(asked, every=0.25, rollouts=20, disturbance=diverging(2), threads=1)
