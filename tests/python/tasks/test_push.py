import math

import numpy as np
import pytest

from energymargin import World
from energymargin.tasks.push import FORCE_BOUND, FRICTION_RANGE, PushTask, scene


def state_of(velocity=(0, 0, 0), yaw_rate=0.0, object_at=(1.0, 0.4)):
    """The pusher at (1, 0), and the box wherever."""
    return scene(0.3).pack(
        object={"position": (*object_at, 0.05)},
        effector={
            "position": (1, 0, 0.05),
            "velocity": velocity,
            "angular_velocity": (0, 0, yaw_rate),
        },
    )


def captured(at, velocity, yaw_rate=0.0):
    state = state_of(velocity, yaw_rate, at)
    return PushTask().captured(state).contains(scene(0.3), state)


def test_a_seed_gives_the_same_trajectory_and_another_seed_another():
    first, again, other = (PushTask().rollout(seed) for seed in (3, 3, 4))
    assert np.array_equal(first.states, again.states)
    assert not np.array_equal(first.states, other.states)
    assert first.params == again.params
    assert FRICTION_RANGE[0] <= first.params["friction"] <= FRICTION_RANGE[1]


def test_the_friction_of_the_task_holds_for_its_trajectories():
    assert PushTask(friction=0.25).rollout(0, frames=2).params == {"friction": 0.25}


@pytest.mark.parametrize("frames", [2, 7, 10])
def test_frames_are_evenly_spaced_from_the_start_to_the_end(frames):
    times = PushTask().rollout(0, frames).times
    assert times == pytest.approx(np.linspace(0, 2.5, frames), abs=0.5 / 240)


def test_fewer_frames_are_frames_of_the_same_motion():
    many, few = PushTask().rollout(5, 9), PushTask().rollout(5, 5)
    assert np.array_equal(many.states[::2], few.states)


@pytest.mark.parametrize("frames", [1, 602, 2.5])
def test_a_number_of_frames_that_cannot_be_is_refused(frames):
    with pytest.raises(ValueError, match=r"frames is .*, expected a whole number from 2 to 601"):
        PushTask().rollout(0, frames)


def test_no_trajectory_starts_with_box_and_pusher_in_each_other():
    for seed in range(30):
        trajectory = PushTask().rollout(seed, frames=2)
        world = World(scene(trajectory.params["friction"]))
        assert world.distance(trajectory.states[0], "object", "effector") > 0


def test_the_labels_say_where_the_box_ends_and_which_frames_are_captured():
    task = PushTask()
    for seed in range(10):
        trajectory = task.rollout(seed)
        layout = scene(trajectory.params["friction"])
        y = layout.unpack(trajectory.states[-1])["object"]["position"][1]
        assert trajectory.success == (abs(y - 1.4) < 0.2)
        for state, label in zip(trajectory.states, trajectory.captured, strict=True):
            assert task.problem(state, trajectory.params).captured.contains(layout, state) == label


@pytest.mark.parametrize(
    ("at", "inside"),
    [
        ((1, 0.74), True),
        ((1, 0.76), False),
        ((1, -0.05), True),
        ((1, -0.06), False),
        ((1.56, 0.3), True),
        ((0.42, 0.3), False),
    ],
)
def test_straight_ahead_the_capture_set_is_a_strip_of_1_5_s_of_motion(at, inside):
    assert captured(at, velocity=(0, 0.5, 0)) == inside


@pytest.mark.parametrize(("side", "yaw_rate"), [(-1, 0.5), (1, -0.5)])
def test_a_turning_pusher_sweeps_about_its_centre_of_rotation(side, yaw_rate):
    # 0.5 m/s at 0.5 rad/s: the centre lies 1 m to the side to which it turns, and 1.5 s are 0.75
    # rad.
    def ahead(angle, radius=1.0):
        return (1 + side - side * radius * math.cos(angle), radius * math.sin(angle))

    def holds(at):
        return captured(at, velocity=(0, 0.5, 0), yaw_rate=yaw_rate)

    assert holds(ahead(0.74)) and not holds(ahead(0.76))
    assert holds(ahead(-0.056)) and not holds(ahead(-0.058))
    assert holds(ahead(0.4, 1.56)) and not holds(ahead(0.4, 1.58))
    assert holds(ahead(0.4, 0.44)) and not holds(ahead(0.4, 0.42))


def test_a_slow_pusher_captures_in_a_disc():
    for angle in np.linspace(0, math.tau, 7):
        near, far = ((1 + r * math.cos(angle), r * math.sin(angle)) for r in (0.85, 0.86))
        assert captured(near, velocity=(0.29, 0, 0), yaw_rate=1.0)
        assert not captured(far, velocity=(0.29, 0, 0), yaw_rate=1.0)


def test_a_box_that_the_pusher_has_passed_by_is_lost_though_it_lies_in_what_was_to_be_swept():
    region = PushTask().captured(state_of(velocity=(0, 1, 0)))
    layout = scene(0.3)

    def later(pusher_y):
        return layout.pack(
            object={"position": (1.3, 0.8, 0.05)},
            effector={"position": (1, pusher_y, 0.05), "velocity": (0, 1, 0)},
        )

    assert region.contains(layout, later(0.7)) and not region.contains(layout, later(0.9))


def test_a_pusher_that_spins_fast_has_a_capture_set_all_the_same():
    assert captured((1, 0), velocity=(0, 0.31, 0), yaw_rate=20.0)


def test_the_disturbance_grows_with_the_friction_of_the_trajectory():
    problem = PushTask().problem(state_of(), params={"friction": 0.4})
    assert problem.force == pytest.approx((FORCE_BOUND * 4 / 3, FORCE_BOUND * 4 / 3, 0))
    assert problem.torque == pytest.approx((0, 0, 0.05 * 4 / 3))


def test_a_problem_without_a_friction_is_refused_with_the_way_out():
    with pytest.raises(ValueError, match=r"params=trajectory\.params"):
        PushTask().problem(state_of())
    assert PushTask(friction=0.3).problem(state_of()).rate == 5.0


@pytest.mark.parametrize("seed", range(4))
def test_a_pusher_that_hits_the_wall_stands_upright_on_its_whole_rim(seed):
    random = np.random.default_rng(seed)
    world = World(scene(0.3))
    start = world.scene.pack(
        object={"position": (-1.0, 0.0, 0.05)},
        effector={
            "position": (1.0, 1.1, 0.05),
            "velocity": (random.uniform(-0.5, 0.5), random.uniform(0.5, 1.3), 0.0),
        },
    )
    ahead = np.tile([random.uniform(-5, 5), 12.0, 0, 0, 0, 0], (240, 1))
    ran = world.simulate(start, 240, {"effector": ahead}, record=range(241))
    pusher = [world.scene.unpack(state)["effector"] for state in ran.states]
    assert pusher[-1]["position"][1] == pytest.approx(1.5, abs=1e-3)  # at the wall
    assert max(np.hypot(*body["orientation"][:2]) for body in pusher) < 1e-4
    assert max(abs(body["position"][2] - 0.05) for body in pusher) < 1e-4
    for contacts in ran.contacts:
        ground = [c for c in contacts if {c.body_a, c.body_b} == {"effector", "table"}]
        assert len(ground) == 8
