import math

import numpy as np
import pytest

import energymargin as em
from energymargin import World, datasets, tasks
from energymargin.tasks.balance import FRICTION, SUPPORT_MASS, BalanceTask, scene

ARRIVES, FALLS = 4, 3  # seeds
NO_WRENCH = np.zeros(6)


def state_of(tilt=0.0, along=0.0, above=0.3, support_y=4.5, turning=0.0):
    """The support tilted, and the square's centre in its frame; both turn as one."""
    across = np.array([math.cos(tilt), math.sin(tilt), 0.0])
    up = np.array([-across[1], across[0], 0.0])
    offset = along * across + above * up
    return scene().pack(
        object={
            "position": np.array([5.5, support_y, 0.0]) + offset,
            "yaw": tilt,
            "velocity": turning * np.array([-offset[1], offset[0], 0.0]),
            "angular_velocity": (0.0, 0.0, turning),
        },
        effector={
            "position": (5.5, support_y, 0.0),
            "yaw": tilt,
            "angular_velocity": (0.0, 0.0, turning),
        },
    )


def captured(state):
    return BalanceTask().captured(state).contains(scene(), state)


def succeeded(state):
    return BalanceTask().succeeded().contains(scene(), state)


def later(state, seconds):
    """After some time on the support that is held against its own weight."""
    world = World(scene(holding=SUPPORT_MASS * 9.81))
    return world.rollout(state, NO_WRENCH, seconds).state


def slid(before, after):
    """How far the square moved along the support [m]."""
    places = []
    for state in (before, after):
        bodies = scene().unpack(state)
        tilt = bodies["effector"]["yaw"]
        offset = bodies["object"]["position"] - bodies["effector"]["position"]
        places.append(math.cos(tilt) * offset[0] + math.sin(tilt) * offset[1])
    return places[1] - places[0]


@pytest.fixture(scope="module")
def trajectories():
    return {seed: BalanceTask().rollout(seed) for seed in (ARRIVES, FALLS)}


def test_the_scene_is_a_square_on_a_heavy_bar_in_the_plane_of_a_slope():
    floor, square, bar = scene().bodies
    assert floor.fixed and floor.position[1] + floor.shape.size[1] / 2 == pytest.approx(0)
    assert (square.mass, bar.mass, square.friction, bar.friction) == (1.0, 1000.0, 0.4, 0.4)
    assert scene().gravity.tolist() == [0.0, -9.81, 0.0]
    for body in (square, bar):
        assert body.linear_factor.tolist() == [1, 1, 0]
        assert body.angular_factor.tolist() == [0, 0, 1]


def test_the_plugin_is_found_by_its_name_and_made_again_from_its_parameters():
    task = tasks.make("balance", effector="drive")
    assert tasks.make("balance", **task.parameters).parameters == task.parameters


def test_a_seed_gives_the_same_trajectory_and_another_seed_another():
    first, again, other = (BalanceTask().rollout(seed) for seed in (3, 3, 4))
    assert np.array_equal(first.states, again.states)
    assert not np.array_equal(first.states, other.states)


def test_one_square_arrives_on_the_support_and_one_falls(trajectories):
    arrives, falls = trajectories[ARRIVES], trajectories[FALLS]
    assert arrives.success and arrives.captured.all()
    assert not falls.success and falls.captured[0] and not falls.captured[-1]
    bodies = scene().unpack(falls.states[-1])
    assert bodies["object"]["position"][1] < bodies["effector"]["position"][1]


def test_about_every_second_square_arrives_and_both_capture_labels_are_common():
    dataset = datasets.generate("balance", trajectories=50, frames=10, seed=0)
    assert 0.4 <= np.mean([t.success for t in dataset.trajectories]) <= 0.6
    kept = [t.captured[k : k + 3].all() for t in dataset.trajectories for k in range(len(t))]
    assert 0.15 <= np.mean(kept) <= 0.85


def test_a_square_at_rest_on_a_level_support_stays_captured():
    start = state_of(above=0.3 - 1e-5)
    assert captured(start) and captured(later(start, 1.0))
    assert abs(slid(start, later(start, 1.0))) < 1e-3


def test_a_square_on_a_steep_support_slides_off_and_is_lost():
    start = state_of(tilt=-0.4, along=0.2, above=0.3 - 1e-5)
    assert captured(start) and not captured(later(start, 1.0))


def test_a_square_on_a_support_that_turns_slides_from_the_angle_of_friction_on():
    grip = math.atan(FRICTION**2)
    start = state_of(tilt=-0.5 * grip, above=0.3 - 1e-5, turning=-0.15)
    seconds = 0.5 * grip / 0.15
    assert abs(slid(start, later(start, seconds))) < 5e-3
    assert slid(start, later(start, seconds + 0.6)) > 0.03


@pytest.mark.parametrize("tilt", [0.0, 0.5, -1.0])
@pytest.mark.parametrize(
    ("place", "inside"),
    [
        ({"along": 0.59}, True),
        ({"along": 0.61}, False),
        ({"along": -0.61}, False),
        ({"above": 0.383}, True),
        ({"above": 0.41}, False),
        ({"above": -0.3}, False),
    ],
)
def test_the_capture_set_is_the_upper_side_of_the_support_however_it_stands(tilt, place, inside):
    assert captured(state_of(tilt, **place)) == inside


def test_success_is_on_the_support_and_above_the_goal_height():
    assert succeeded(state_of(support_y=5.51)) and not succeeded(state_of(support_y=5.49))
    assert not succeeded(state_of(support_y=6.0, along=0.7))


def test_every_frame_makes_a_problem_with_the_label_that_was_recorded(trajectories):
    task = BalanceTask()
    for trajectory in trajectories.values():
        for state, contacts, label in zip(
            trajectory.states, trajectory.contacts, trajectory.captured, strict=True
        ):
            problem = task.problem(state, trajectory.params, contacts)
            assert problem.captured.contains(problem.scene, state) == label


def test_while_it_is_scored_the_support_is_held_with_the_square_on_it():
    problem = BalanceTask().problem(state_of(above=0.3 - 1e-5))
    end = World(problem.scene).rollout(problem.state, NO_WRENCH, 1.0).state
    for body in ("object", "effector"):
        start_y, end_y = (s[problem.scene.slice(body)][1] for s in (problem.state, end))
        assert end_y == pytest.approx(start_y, abs=1e-3)


def test_scores_tell_a_level_support_from_a_steep_one():
    level, steep = (
        BalanceTask().problem(state_of(tilt, along=0.2, above=0.3 - 1e-5)) for tilt in (0.0, -0.5)
    )
    table = em.score([level, steep], nodes=50, threads=1)
    assert table["capture"][0] > table["capture"][1]
    assert table["effort/est"][0] > table["effort/est"][1]


def test_an_unknown_reading_of_the_effector_is_refused_by_name():
    with pytest.raises(ValueError, match="effector is 'glide', expected 'coast' or 'drive'"):
        BalanceTask(effector="glide")
