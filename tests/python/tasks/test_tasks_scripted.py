from dataclasses import replace

import numpy as np
import pytest

from energymargin import Problem, Scene, Sphere, World, regions, tasks
from energymargin.tasks import Drive, ScriptedTask


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


class TwoBalls(ScriptedTask):
    """Two balls in free space: the one moves to the right, where it is lost, the other stays."""

    name = "two-balls"
    length = 0.1

    def scene(self, params):
        made = Scene(gravity=(0, 0, 0))
        made.add_body("runs", Sphere(0.1), mass=1.0, velocity=(1, 0, 0), role="object")
        made.add_body("stays", Sphere(0.1), mass=1.0, position=(0, 1, 0), role="object")
        return made

    def drive(self, params, random):
        return Drive()

    def captured(self, state, params):
        return {ball: regions.HalfSpace(ball, (1, 0, 0), 0.07) for ball in ("runs", "stays")}

    def succeeded(self, params):
        return {ball: regions.HalfSpace(ball, (-1, 0, 0), -0.07) for ball in ("runs", "stays")}

    def problem(self, state, params=None, contacts=None):
        return Problem(
            self.scene({}),
            state,
            force=(1, 1, 1),
            torque=(0, 0, 0),
            duration=0.1,
            captured=self.captured(state, {}),
            succeeded=self.succeeded({}),
        )


def test_several_objects_are_captured_and_succeed_all_or_at_least_one():
    trajectory = TwoBalls().rollout(0, frames=3)  # the one that runs is at 0, 0.05 and 0.1 m
    assert trajectory.captured.tolist() == [True, True, False]
    assert trajectory.captured_any.tolist() == [True, True, True]
    assert (trajectory.success, trajectory.success_any) == (False, True)


def test_the_labels_of_several_objects_are_those_of_the_problems_sets():
    task = TwoBalls()
    scene = task.scene({})
    states = np.array([scene.pack(runs={"position": (x, 0, 0)}) for x in (0.0, 0.1)])
    captured, succeeded = task.labels(states, {})
    captured_any, succeeded_any = task.labels_any(states, {})
    problems = [task.problem(state) for state in states]
    for labels, name in (
        (captured, "captured"),
        (succeeded, "succeeded"),
        (captured_any, "captured_any"),
        (succeeded_any, "succeeded_any"),
    ):
        sets = [getattr(problem, name) for problem in problems]
        held = [one.contains(scene, state) for one, state in zip(sets, states, strict=True)]
        assert labels.tolist() == held


def test_with_one_set_for_all_there_is_no_label_of_at_least_one(task, trajectory):
    assert trajectory.captured_any is None and trajectory.success_any is None
    assert task.labels_any(trajectory.states, trajectory.params) == (None, None)


def test_a_scripted_task_has_the_parameters_of_its_constructor_and_starts_as_its_scene():
    task = TwoBalls(effector="drive")
    assert task.parameters == {"effector": "drive"}
    assert np.array_equal(task.rollout(0, frames=2).states[0], task.scene({}).pack())
    with pytest.raises(ValueError, match="effector is 'fly'"):
        TwoBalls(effector="fly")


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"states": np.zeros((2, 26))}, r"states has shape \(2, 26\)"),
        ({"states": np.zeros(3)}, r"states has shape \(3,\), expected \(K, n\)"),
        (
            {"captured": np.ones(3)},
            r"captured has shape \(3,\) of float64, expected \(3,\) of bool",
        ),
        ({"captured_any": np.ones(2, dtype=bool)}, r"captured_any has shape \(2,\)"),
        ({"contacts": [[]]}, "contacts has 1 lists, expected one a frame"),
    ],
)
def test_a_trajectory_whose_arrays_do_not_fit_is_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        replace(TwoBalls().rollout(0, frames=3), **wrong)
