import numpy as np
import pytest

from energymargin import World
from energymargin.tasks.push_multi import (
    BAR_SIZE,
    BAR_Z,
    DISC_HEIGHT,
    DISC_RADIUS,
    DISCS,
    FORCE_BOUND,
    GOAL,
    SWEPT,
    PushMultiTask,
)

TASK = PushMultiTask()
SCENE = PushMultiTask().scene({"friction": 0.3})
FRICTION = {"friction": 0.3}
END = BAR_SIZE[0] / 2


def state_of(disc_0=(0.0, 0.3), bar=(0.0, 0.0), velocity=(0.0, 0.3), yaw=0.0, yaw_rate=0.0):
    """The first disc and the bar somewhere, the other discs far away."""
    others = {disc: {"position": (n, 9.0, 0.015)} for n, disc in enumerate(DISCS[1:])}
    return SCENE.pack(
        **others,
        **{DISCS[0]: {"position": (*disc_0, DISC_HEIGHT / 2)}},
        bar={
            "position": (*bar, BAR_Z),
            "velocity": (*velocity, 0.0),
            "yaw": yaw,
            "angular_velocity": (0.0, 0.0, yaw_rate),
        },
    )


def captured(disc_0, **bar):
    state = state_of(disc_0, **bar)
    return TASK.captured(state, FRICTION)[DISCS[0]].contains(SCENE, state)


def test_a_seed_gives_the_same_trajectory_and_another_seed_another():
    first, again, other = (TASK.rollout(seed) for seed in (3, 3, 4))
    assert np.array_equal(first.states, again.states) and first.params == again.params
    assert not np.array_equal(first.states, other.states)


def test_no_trajectory_starts_with_bodies_in_each_other():
    for seed in range(5):
        start = TASK.rollout(seed, frames=2).states[0]
        bodies = SCENE.unpack(start)
        places = np.array([bodies[disc]["position"][:2] for disc in DISCS])
        apart = np.linalg.norm(places[:, None] - places, axis=-1) + np.eye(len(DISCS))
        assert apart.min() > 2 * DISC_RADIUS
        assert min(World(SCENE).distance(start, disc, "bar") for disc in DISCS) > 0


@pytest.mark.parametrize(
    ("at", "inside"),
    [
        ((0.0, 0.01), True),
        ((0.0, -0.01), False),
        ((0.0, 0.3 * SWEPT["ahead"] - 0.01), True),
        ((0.0, 0.3 * SWEPT["ahead"] + 0.01), False),
        ((END - 0.01, 0.1), True),
        ((END + 0.01, 0.1), False),
        ((-END - 0.01, 0.1), False),
    ],
)
def test_straight_ahead_the_capture_set_is_as_wide_as_the_bar_and_1_5_s_long(at, inside):
    assert captured(at) == inside


def test_in_front_of_a_bar_that_is_turned_a_disc_is_captured_before_it_is_swept():
    # Turned by 0.4 rad to the left, the right end is ahead of the middle, and the left one behind.
    side = 0.8 * END
    assert captured((side * np.cos(0.4), side * np.sin(0.4) + 0.03), yaw=0.4)
    assert not captured((side * np.cos(0.4), side * np.sin(0.4) - 0.03), yaw=0.4)
    assert captured((-side * np.cos(0.4), -side * np.sin(0.4) + 0.03), yaw=0.4)


def test_a_turning_bar_sweeps_about_its_centre_of_rotation():
    # 0.3 m/s at 0.5 rad/s: the centre lies 0.6 m to the left, and 1.5 s are 0.75 rad.
    def ahead(angle):
        return (-0.6 + 0.6 * np.cos(angle), 0.6 * np.sin(angle))

    assert captured(ahead(0.74), yaw_rate=0.5) and not captured(ahead(0.76), yaw_rate=0.5)


def test_a_disc_that_the_bar_has_passed_by_is_lost():
    region = TASK.captured(state_of((0.1, 0.1)), FRICTION)[DISCS[0]]
    assert region.contains(SCENE, state_of((0.1, 0.1), bar=(0.0, 0.05)))
    assert not region.contains(SCENE, state_of((0.1, 0.1), bar=(0.0, 0.15)))


def test_a_disc_slips_past_the_end_of_the_bar_and_one_in_its_middle_does_not():
    steps = round(1.0 / TASK.step)
    for x, kept in ((0.05, True), (END + 0.02, False)):
        start = state_of((x, 0.06), velocity=(0.0, 0.4))
        end = SCENE.unpack(World(SCENE).simulate(start, steps, record=[steps]).states[0])
        assert (end[DISCS[0]]["position"][1] > end["bar"]["position"][1]) == kept


def test_success_is_a_disc_in_the_goal_region():
    goal = TASK.succeeded(FRICTION)[DISCS[0]]
    (left, right), (near, far) = GOAL
    for at in ((left + 0.01, near + 0.01), (right - 0.01, far - 0.01)):
        assert goal.contains(SCENE, state_of(at))
    for at in ((left - 0.01, near + 0.01), (0, near - 0.01), (right, far + 0.01)):
        assert not goal.contains(SCENE, state_of(at))


def test_both_labels_have_both_outcomes_and_all_states_make_a_problem():
    trajectories = [TASK.rollout(seed) for seed in range(20)]
    assert {trajectory.success for trajectory in trajectories} == {True, False}
    assert {trajectory.success_any for trajectory in trajectories} == {True, False}
    for trajectory in trajectories[:4]:
        for k, state in enumerate(trajectory.states):
            problem = TASK.problem(state, trajectory.params, trajectory.contacts[k])
            layout = problem.scene
            assert problem.captured.contains(layout, state) == trajectory.captured[k]
            assert problem.captured_any.contains(layout, state) == trajectory.captured_any[k]


def test_the_disturbance_grows_with_what_friction_can_hold():
    problem = TASK.problem(SCENE.pack(), params={"friction": 0.6})
    assert problem.force == pytest.approx((4 * FORCE_BOUND, 4 * FORCE_BOUND, 0))
    with pytest.raises(ValueError, match=r"params=trajectory\.params"):
        TASK.problem(SCENE.pack())
    assert PushMultiTask(friction=0.3, effector="drive").problem(SCENE.pack()).effector == "drive"
