import numpy as np
import pytest

import energymargin as em
from energymargin import datasets
from energymargin.tasks.grasp import CLENCHED, FRICTION_RANGE, GraspTask

TASK = GraspTask()
MIDDLE = {"friction": 0.6, "clench": 1.0}


@pytest.fixture(scope="module")
def trajectories():
    return datasets.generate(TASK, trajectories=50, frames=10, seed=0).trajectories


def simulated(params, steps, random=0):
    """A script's first steps, from the box under the middle of the hand."""
    scene = TASK.scene(params)
    drive = TASK.drive(params, np.random.default_rng(random))
    return scene, em.World(scene).simulate(
        scene.pack(),
        TASK.steps,
        drives=drive.wrenches,
        targets=drive.targets,
        record=[steps],
    )


def at_time(params, steps):
    """The state after some steps of the script."""
    scene, simulation = simulated(params, steps)
    return scene, simulation.states[0]


def height(scene, state):
    bodies = scene.unpack(state)
    return bodies["object"]["position"][2] - bodies["table"]["position"][2] - 0.1


def test_the_gripper_has_three_fingers_of_four_joints_on_a_fixed_palm():
    scene = TASK.scene(MIDDLE)
    assert len(scene.joints) == 12
    assert {joint.type for joint in scene.joints} == {"revolute"}
    masses = {body.name: body.mass for body in scene.bodies if "finger_1" in body.name}
    assert list(masses.values()) == [0.05, 0.15, 0.15, 0.05]
    assert next(body for body in scene.bodies if body.name == "palm").fixed


def test_about_half_of_the_grasps_hold(trajectories):
    assert 0.4 <= np.mean([trajectory.success for trajectory in trajectories]) <= 0.6


def test_both_labels_are_well_represented(trajectories):
    captured = np.concatenate([trajectory.captured for trajectory in trajectories])
    assert captured.mean() >= 0.2


@pytest.mark.xfail(strict=True, reason="0.802 in 0.14.0, which holds more grasps")
def test_at_most_four_fifths_of_the_states_are_captured(trajectories):
    captured = np.concatenate([trajectory.captured for trajectory in trajectories])
    assert captured.mean() <= 0.8


def test_a_seed_gives_the_same_trajectory_and_another_seed_another():
    first, again, other = (TASK.rollout(seed) for seed in (3, 3, 4))
    assert np.array_equal(first.states, again.states)
    assert not np.array_equal(first.states, other.states)
    assert FRICTION_RANGE[0] <= first.params["friction"] <= FRICTION_RANGE[1]


def test_a_firm_grasp_lifts_the_box_and_a_slippery_one_leaves_it_on_the_table():
    firm = at_time({"friction": 1.0, "clench": 1.0}, 480)
    slippery = at_time({"friction": 0.1, "clench": 1.0}, 480)
    assert height(*firm) == pytest.approx(0.165, abs=0.01)
    assert height(*slippery) == pytest.approx(0.0, abs=0.001)


def test_the_fingers_clench_until_the_box_stops_them():
    scene, simulation = simulated(MIDDLE, 60)
    joints = scene.unpack(simulation.states[0])["joints"]
    for finger in (1, 2, 3):
        assert 0.05 < joints[f"finger_{finger}_joint_1"]["position"] < CLENCHED[0] - 0.1
        assert joints[f"finger_{finger}_joint_0"]["position"] == 0.0
    pressing = {
        name
        for contact in simulation.contacts[0]
        for name in (contact.body_a, contact.body_b)
        if contact.normal_force > 1.0 and "finger" in name
    }
    assert {name[:8] for name in pressing} == {"finger_1", "finger_2", "finger_3"}


def test_held_in_the_hand_the_box_is_captured_and_lifted_and_dropped_it_is_neither():
    scene, held = at_time({"friction": 1.0, "clench": 1.0}, 480)
    dropped = held.copy()
    dropped[scene.slice("object").start + 2] -= 0.08
    captured, succeeded = TASK.labels(np.array([held, dropped]), {"friction": 1.0, "clench": 1.0})
    assert captured.tolist() == [True, False]
    assert succeeded.tolist() == [True, False]


def test_a_firm_grasp_scores_above_one_that_is_about_to_slip():
    scores = {}
    for friction in (0.2, 1.0):
        params = {"friction": friction, "clench": 1.0}
        _, state = at_time(params, 200)
        problem = TASK.problem(state, params)
        scores[friction] = em.capture_score(problem, nodes=40, seed=0).capture
    assert scores[1.0] > 0.99
    assert scores[0.2] < 0.5


def test_every_state_of_a_trajectory_makes_a_problem(trajectories):
    for trajectory in trajectories[:4]:
        for state, contacts in zip(trajectory.states, trajectory.contacts, strict=True):
            problem = TASK.problem(state, trajectory.params, contacts)
            assert em.Problem.from_json(problem.to_json()).to_json() == problem.to_json()


def test_a_problem_needs_the_friction_that_was_drawn():
    state = TASK.scene(MIDDLE).pack()
    with pytest.raises(ValueError, match="friction is drawn for each trajectory"):
        TASK.problem(state)
    assert GraspTask(friction=0.4).problem(state).effector == "coast"


@pytest.mark.parametrize("parameters", [{"friction": -1}, {"effector": "fly"}])
def test_a_parameter_out_of_range_is_refused(parameters):
    with pytest.raises(ValueError, match=next(iter(parameters))):
        GraspTask(**parameters)
