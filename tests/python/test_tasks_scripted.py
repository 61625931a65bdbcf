import numpy as np
import pytest

from energymargin import World, tasks
from energymargin.tasks import Drive


@pytest.fixture(scope="module")
def task():
    return tasks.make("push")


@pytest.fixture(scope="module")
def trajectory(task):
    return task.rollout(seed=5)


def resumed(task, trajectory, frame=4, seed=7, **options):
    times = trajectory.times[frame:]
    state = trajectory.states[frame]
    return task.resume(state, times[0], trajectory.params, seed, times[1:], **options)


def test_a_script_goes_on_the_same_way_for_the_same_seed_and_another_way_for_another(
    task, trajectory
):
    states = resumed(task, trajectory)
    assert states.shape == trajectory.states[5:].shape
    assert np.array_equal(states, resumed(task, trajectory))
    assert not np.array_equal(states, resumed(task, trajectory, seed=8))


def test_a_world_that_is_handed_over_changes_nothing(task, trajectory):
    world = World(task.scene(trajectory.params))
    for _ in range(2):
        assert np.array_equal(resumed(task, trajectory, world=world), resumed(task, trajectory))


def test_a_script_that_goes_on_from_its_start_is_the_whole_script(task, trajectory):
    steps = np.round(trajectory.times / task.step).astype(int).tolist()
    drive = task.drive(trajectory.params, np.random.default_rng(7))
    whole = World(task.scene(trajectory.params)).simulate(
        trajectory.states[0], task.steps, drives=drive.wrenches, record=steps
    )
    assert np.array_equal(resumed(task, trajectory, frame=0), whole.states[1:])


def test_from_the_middle_on_the_later_rows_of_the_drive_are_used(task, trajectory):
    first = round(trajectory.times[4] / task.step)
    drive = task.drive(trajectory.params, np.random.default_rng(7)).between(first, task.steps)
    assert drive.wrenches["effector"].shape == (task.steps - first, 6)
    end = World(task.scene(trajectory.params)).simulate(
        trajectory.states[4],
        task.steps - first,
        drives=drive.wrenches,
        record=[task.steps - first],
    )
    assert np.array_equal(resumed(task, trajectory)[-1], end.states[0])


def test_a_part_of_a_drive_is_a_part_of_all_its_rows():
    drive = Drive({"palm": np.arange(12.0).reshape(2, 6)}, {"knuckle": np.array([0.1, 0.2])})
    part = drive.between(1, 2)
    assert part.wrenches["palm"].tolist() == [[6, 7, 8, 9, 10, 11]]
    assert part.targets["knuckle"].tolist() == [0.2]


def test_labels_are_those_that_the_trajectory_recorded(task):
    for seed in range(5):
        trajectory = task.rollout(seed)
        captured, succeeded = task.labels(trajectory.states, trajectory.params)
        assert np.array_equal(captured, trajectory.captured)
        assert succeeded[-1] == trajectory.success


@pytest.mark.parametrize("times", [[], [0.5], [1.0, 0.9], [1.0, 1.0], [1.0, 2.6], [1.001]])
def test_times_that_do_not_rise_to_the_end_of_the_script_are_refused(task, trajectory, times):
    now = 1.0 if times == [1.001] else 0.5
    with pytest.raises(
        ValueError, match=r"times is .*, expected to rise from after .* at most 2.5"
    ):
        task.resume(trajectory.states[0], now, trajectory.params, 0, times)
