import math

import numpy as np
import pytest

import energymargin as em
from energymargin import World, datasets, tasks
from energymargin.tasks.topple import FORCE_WEIGHTS, FRICTION_RANGE, ToppleTask

STICKS, SLIDES = 0.9, 0.5  # friction


def state_of(pitch=0.0, velocity=(0, 0, 0), pitch_rate=0.0):
    """The box turned about its far lower edge, which stays on the ground at x = 3."""
    height = 0.5 * (math.cos(pitch) + math.sin(pitch))
    back = 0.5 * (math.cos(pitch) - math.sin(pitch))
    return (
        ToppleTask()
        .scene({"friction": STICKS})
        .pack(
            object={
                "position": (3.0 - back, 0.0, height),
                "orientation": (0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2)),
                "velocity": velocity,
                "angular_velocity": (0.0, pitch_rate, 0.0),
            }
        )
    )


def captured(state):
    return ToppleTask().captured(state).contains(ToppleTask().scene({"friction": STICKS}), state)


def succeeded(state):
    return ToppleTask().succeeded().contains(ToppleTask().scene({"friction": STICKS}), state)


@pytest.fixture(scope="module")
def toppled():
    return ToppleTask(friction=STICKS).rollout(seed=0)


@pytest.fixture(scope="module")
def pushed_away():
    return ToppleTask(friction=SLIDES).rollout(seed=0)


def test_the_scene_is_a_light_box_and_a_springy_finger_on_a_rail():
    made = ToppleTask().scene({"friction": 0.7})
    box, base, tip = made.bodies[1:]
    assert (made.step, made.bodies[0].friction, box.friction, tip.friction) == (
        1 / 240,
        0.7,
        0.7,
        0.2,
    )
    assert (box.mass, base.mass, tip.mass) == (0.3, 0.1, 0.1)
    assert tip.position[0] - base.position[0] == pytest.approx(0.7)
    (spring,) = made.springs
    assert (spring.stiffness, spring.rest_length) == (5.0, 1.0)
    assert {base.role, tip.role} == {"effector"}


def test_the_plugin_is_found_by_its_name_and_made_again_from_its_parameters():
    task = tasks.make("topple", friction=0.8, effector="drive")
    assert tasks.make("topple", **task.parameters).parameters == task.parameters


def test_a_seed_gives_the_same_trajectory_and_another_seed_another():
    first, again, other = (ToppleTask().rollout(seed) for seed in (3, 3, 4))
    assert np.array_equal(first.states, again.states)
    assert not np.array_equal(first.states, other.states)
    assert first.params == again.params
    assert FRICTION_RANGE[0] <= first.params["friction"] <= FRICTION_RANGE[1]


def test_a_box_that_sticks_to_the_ground_topples(toppled):
    assert toppled.success
    assert toppled.captured[0] and toppled.captured[-1]
    end = ToppleTask().scene({"friction": STICKS}).unpack(toppled.states[-1])["object"]
    assert end["position"][0] == pytest.approx(3.5, abs=0.05)  # over its edge at x = 3


def test_a_box_that_slides_is_pushed_away_upright(pushed_away):
    assert not pushed_away.success and not pushed_away.captured[2:].any()
    end = ToppleTask().scene({"friction": SLIDES}).unpack(pushed_away.states[-1])["object"]
    assert end["position"][0] > 2.6
    assert end["orientation"][3] == pytest.approx(1.0, abs=1e-4)


def test_about_every_second_box_topples_and_both_capture_labels_are_common():
    dataset = datasets.generate("topple", trajectories=50, frames=10, seed=0)
    assert 0.4 <= np.mean([t.success for t in dataset.trajectories]) <= 0.6
    assert 0.15 <= np.mean([t.captured for t in dataset.trajectories]) <= 0.85


@pytest.mark.parametrize("pitch", [0.0, 0.4, 1.2])
def test_a_box_that_turns_about_its_edge_is_captured_and_one_that_slides_is_not(pitch):
    rate = 2.0
    height = 0.5 * (math.cos(pitch) + math.sin(pitch))
    back = 0.5 * (math.cos(pitch) - math.sin(pitch))
    turning = np.array([rate * height, 0.0, rate * back])
    assert captured(state_of(pitch, turning, rate))
    assert captured(state_of(pitch, turning + np.array([0.099, 0, 0]), rate))
    assert not captured(state_of(pitch, turning + np.array([0.101, 0, 0]), rate))


def test_success_is_a_quarter_turn_within_3_degrees():
    assert succeeded(state_of(math.radians(90)))
    for edge in (87, 93):
        inside = 90 + 0.99 * (edge - 90)
        outside = 90 + 1.01 * (edge - 90)
        assert succeeded(state_of(math.radians(inside)))
        assert not succeeded(state_of(math.radians(outside)))
    assert not succeeded(state_of(math.radians(-90)))


def test_the_disturbance_alone_moves_no_box_at_rest():
    world = World(ToppleTask().scene({"friction": STICKS}))
    problem = ToppleTask(friction=STICKS).problem(world.scene.pack())
    wrench = np.concatenate([problem.force, problem.torque])
    far = world.scene.pack(base={"position": (-3, 0, 0.9)}, fingertip={"position": (-2, 0, 0.9)})
    end = world.rollout(far, wrench, problem.duration).state
    assert np.linalg.norm(end[:3] - far[:3]) < 1e-3


def test_every_frame_makes_a_problem_with_the_labels_that_were_recorded(toppled, pushed_away):
    for trajectory in (toppled, pushed_away):
        task = ToppleTask()
        for state, contacts, label in zip(
            trajectory.states, trajectory.contacts, trajectory.captured, strict=True
        ):
            problem = task.problem(state, trajectory.params, contacts)
            assert problem.captured.contains(problem.scene, state) == label
            assert problem.force_weights.ground_stick == FORCE_WEIGHTS.ground_stick


def test_scores_tell_a_box_on_a_rough_ground_from_one_on_a_smooth_ground(toppled, pushed_away):
    task = ToppleTask()
    rough, smooth = (
        task.problem(t.states[2], t.params, t.contacts[2]) for t in (toppled, pushed_away)
    )
    table = em.score([rough, smooth], nodes=50, threads=1)
    assert table["capture"][0] > 0.5 > table["capture"][1]
    assert table["effort/est"][0] > 0 == table["effort/est"][1]
    assert table["force"][0] > table["force"][1]


def test_without_a_friction_a_problem_is_refused_with_the_way_out():
    with pytest.raises(ValueError, match=r"params=trajectory\.params"):
        ToppleTask().problem(state_of())


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"friction": 0.0}, "friction is 0.0, expected a positive number"),
        ({"effector": "glide"}, "effector is 'glide', expected 'coast' or 'drive'"),
    ],
)
def test_bad_parameters_are_refused_by_name(parameters, message):
    with pytest.raises(ValueError, match=message):
        ToppleTask(**parameters)
