"""What tasks say of the future: the plan of their script, and capture sets that go along."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import energymargin as em
from energymargin import Plan, Problem, Scene, Sphere, World, regions, tasks
from energymargin.tasks import Drive, ScriptedTask

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")

NAMES = ("push", "balance", "topple", "grasp", "scoop", "push-multi", "push-real")
SEVERAL = ("scoop", "push-multi")
SEEDS = {name: 2 if name in SEVERAL else 3 for name in NAMES}


@pytest.fixture(scope="module", params=NAMES)
def recorded(request: pytest.FixtureRequest) -> tuple[ScriptedTask, list[tasks.Trajectory]]:
    task = tasks.make(request.param)
    assert isinstance(task, ScriptedTask)
    return task, [task.rollout(seed) for seed in range(SEEDS[request.param])]


class Runner(ScriptedTask):
    """A ball that is pushed to the right; captured while it is no faster than it was at a state."""

    name = "runner"
    length = 0.1

    def scene(self, params: tasks.Params) -> Scene:
        made = Scene(gravity=(0, 0, 0))
        made.add_body("object", Sphere(0.1), mass=1.0, role="object")
        made.add_body("hand", Sphere(0.1), mass=1.0, position=(0, 5, 0), role="effector")
        return made

    def drive(self, params: tasks.Params, random: np.random.Generator) -> Drive:
        return Drive({"hand": random.uniform(0.0, 2.0, (self.steps, 6))})

    def captured(self, state: Any, params: tasks.Params) -> regions.Region:
        speed = float(np.linalg.norm(self.scene(params).unpack(state)["object"]["velocity"]))
        return regions.Speed("object", 0.5 * speed + 0.1)

    def succeeded(self, params: tasks.Params) -> regions.Region:
        return regions.Ball("object", (0, 0, 0), 1.0)

    def problem(self, state: Any, params: Any = None, contacts: Any = None) -> Problem:
        captured = self.captured(state, {})
        bounds = {"force": (1, 1, 1), "torque": (0, 0, 0), "duration": 0.1}
        scene = self.scene({})
        return Problem(scene, state, captured=captured, **bounds, start_outside=True)


def test_the_capture_set_of_the_first_frame_labels_all_frames(
    recorded: tuple[ScriptedTask, list[tasks.Trajectory]],
) -> None:
    task, trajectories = recorded
    for trajectory in trajectories:
        problem = task.future(trajectory.states[0], 0.0, trajectory.params, 0.5)
        inside = problem.captured.contains(problem.scene, trajectory.states)
        assert np.array_equal(inside, trajectory.captured)
        if trajectory.captured_any is None:
            assert problem.captured_any is None
        else:
            some = problem.captured_any.contains(problem.scene, trajectory.states)
            assert np.array_equal(some, trajectory.captured_any)


def test_the_capture_set_that_goes_along_has_a_file_format(
    recorded: tuple[ScriptedTask, list[tasks.Trajectory]],
) -> None:
    task, (trajectory, *_) = recorded
    future = task.future(trajectory.states[0], 0.0, trajectory.params, 0.5)
    problem = future.replace(horizon=None, plan=None)
    read = Problem.from_json(problem.to_json())
    states = np.concatenate([trajectory.states, _scattered(problem.scene, trajectory.states)])
    inside = problem.captured.contains(problem.scene, states)
    assert np.array_equal(read.captured.contains(read.scene, states), inside)


def test_the_plan_is_the_mean_of_many_drives(
    recorded: tuple[ScriptedTask, list[tasks.Trajectory]],
) -> None:
    task, (trajectory, *_) = recorded
    plan = task.plan(trajectory.states[0], 0.0, trajectory.params)
    drives = [task.drive(trajectory.params, np.random.default_rng(n)) for n in range(40)]
    planned = {**plan.wrenches, **plan.targets}
    assert planned.keys() == {**drives[0].wrenches, **drives[0].targets}.keys()
    assert plan.rows == task.steps and plan.step == pytest.approx(task.step)
    for name, rows in planned.items():
        drawn = np.array([{**drive.wrenches, **drive.targets}[name] for drive in drives])
        error = drawn.std(axis=0) / np.sqrt(len(drives))
        scale = 1e-9 * max(1.0, np.abs(drawn).max())
        assert (np.abs(drawn.mean(axis=0) - rows) <= 6 * error + scale).all()


def test_a_plan_from_the_middle_is_the_rest_of_the_whole_plan(
    recorded: tuple[ScriptedTask, list[tasks.Trajectory]],
) -> None:
    task, (trajectory, *_) = recorded
    state, time, params = trajectory.states[4], trajectory.times[4], trajectory.params
    whole = _rows(task.plan(trajectory.states[0], 0.0, params))
    first = round(time / task.step)
    for name, rows in _rows(task.plan(state, time, params)).items():
        assert np.array_equal(rows, whole[name][first:])
    for name, rows in _rows(task.plan(state, time, params, horizon=0.25)).items():
        assert np.array_equal(rows, whole[name][first : first + 60])


def test_behind_its_end_a_script_lets_go_and_keeps_its_targets(
    recorded: tuple[ScriptedTask, list[tasks.Trajectory]],
) -> None:
    task, (trajectory, *_) = recorded
    state, params = trajectory.states[-1], trajectory.params
    plan = task.plan(state, task.length - 0.1, params, horizon=0.3)
    assert plan.rows == 72
    after = task.afterwards(params)
    for body, rows in plan.wrenches.items():
        assert np.array_equal(rows[24:], np.tile(after.get(body, np.zeros(6)), (48, 1)))
    for rows in plan.targets.values():
        assert (rows[24:] == rows[23]).all()


def test_a_robot_that_follows_its_plan_does_what_its_script_does_on_average() -> None:
    task = tasks.make("push")
    assert isinstance(task, ScriptedTask)
    trajectory = task.rollout(0)
    problem = task.future(trajectory.states[0], 0.0, trajectory.params, task.length)
    record = np.round(trajectory.times / task.step).astype(int).tolist()
    world = World(problem.scene, problem.plan)
    states = world.simulate(problem.state, task.steps, record=record).states
    tool = problem.scene.slice("effector")
    assert np.abs(states[:, tool][:, :2] - trajectory.states[:, tool][:, :2]).max() < 0.05


def test_a_lift_that_holds_the_weight_itself_gets_no_other_force() -> None:
    task = tasks.make("balance")
    assert isinstance(task, ScriptedTask)
    state = task.rollout(0).states[3]
    lifted = task.future(state, 0.8, {}, 0.5)
    for problem, rises in ((lifted, True), (task.future(state, 0.8, {}, 0.5, "hold"), False)):
        world = World(problem.scene, problem.plan)
        end = world.simulate(state, 120, record=[120]).states[0]
        before, after = (problem.scene.unpack(z)["effector"]["velocity"][1] for z in (state, end))
        assert after - before == pytest.approx(0.25 if rises else 0.0, abs=0.02)


def test_without_a_plan_the_robot_coasts_and_with_hold_it_goes_on() -> None:
    task = tasks.make("push")
    assert isinstance(task, ScriptedTask)
    trajectory = task.rollout(0)
    coasting, holding = (
        task.future(trajectory.states[4], trajectory.times[4], trajectory.params, 0.5, plan)
        for plan in (None, "hold")
    )
    assert coasting.plan is None and coasting.horizon == 0.5 and coasting.effector == "coast"
    assert holding.plan is not None and list(holding.plan.velocities) == ["effector"]
    with pytest.raises(ValueError, match="plan is 'none', expected 'script', 'hold' or None"):
        task.future(trajectory.states[4], 0.0, trajectory.params, 0.5, "none")


def test_a_task_without_a_script_scores_and_is_told_how_to_give_a_plan() -> None:
    task = Runner()
    state = task.scene({}).pack()
    assert em.capture_score(task.problem(state), nodes=5).capture > 0
    with pytest.raises(ValueError, match=r"'runner' has no script .* give Runner a method `script"):
        task.plan(state, 0.0, {})
    coasting = task.future(state, 0.0, {}, 0.05, plan=None)
    assert coasting.horizon == 0.05 and coasting.plan is None


def test_a_set_that_a_task_does_not_write_down_is_asked_for_at_each_state() -> None:
    task = Runner()
    scene = task.scene({})
    speeds = (0.0, 0.1, 0.19, 0.21, 1.0)
    states = np.array([scene.pack(object={"velocity": (speed, 0, 0)}) for speed in speeds])
    problem = task.future(states[0], 0.0, {}, 0.05, plan=None)
    assert problem.captured.contains(scene, states).tolist() == [True, True, True, False, False]


@pytest.mark.parametrize(("time", "horizon"), [(2.5, None), (-0.1, None), (0.0, 0.001)])
def test_a_plan_of_no_step_is_refused(time: float, horizon: float | None) -> None:
    task = tasks.make("push")
    assert isinstance(task, ScriptedTask)
    with pytest.raises(ValueError, match=r"time is .* the script ends at 2.5 s"):
        task.plan(np.zeros(1), time, {"friction": 0.3}, horizon)


def test_params_that_lack_a_draw_are_named() -> None:
    task = tasks.make("scoop")
    assert isinstance(task, ScriptedTask)
    with pytest.raises(ValueError, match="params has no 'bend', expected those of a trajectory"):
        task.plan(np.zeros(1), 0.0, {"friction": 0.3})


def test_a_half_space_reaches_ahead_of_a_body_that_moves_towards_it() -> None:
    scene = Scene(gravity=(0, 0, 0))
    scene.add_body("object", Sphere(0.1), mass=1.0, role="object")
    scene.add_body("hand", Sphere(0.1), mass=1.0, role="effector")
    half = regions.HalfSpace("object", (1, 0, 0), 0.2, frame="hand", ahead=2.0)

    def inside(x: float, speed: float, yaw: float = 0.0) -> bool:
        place = {"position": (x, 0.0, 0.0)}
        moved = {"velocity": (speed, 0.3, 0.0), "yaw": yaw}
        return bool(half.contains(scene, scene.pack(object=place, hand=moved)))

    assert inside(0.19, 0.0) and not inside(0.21, 0.0)
    assert inside(0.79, 0.3) and not inside(0.81, 0.3)
    assert inside(0.19, -5.0) and not inside(0.21, -5.0)
    assert inside(-0.79, -0.3, np.pi) and not inside(-0.81, -0.3, np.pi)
    with pytest.raises(ValueError, match="ahead is 1, expected 0 without a frame"):
        regions.HalfSpace("object", (1, 0, 0), 0.2, ahead=1.0)
    with pytest.raises(ValueError, match="ahead is -1"):
        regions.HalfSpace("object", (1, 0, 0), 0.2, frame="hand", ahead=-1.0)


def _rows(plan: Plan) -> dict[str, Any]:
    return {**plan.wrenches, **plan.targets}


def _scattered(scene: Scene, states: np.ndarray) -> np.ndarray:
    """States near those, with the objects' positions and velocities moved at random."""
    random = np.random.default_rng(0)
    moved = states.copy()
    for body in scene.bodies:
        if body.role != "object":
            continue
        place = scene.slice(body.name).start
        moved[:, place : place + 3] += random.normal(0.0, 0.1, (len(states), 3))
        moved[:, place + 7 : place + 10] += random.normal(0.0, 0.1, (len(states), 3))
    return moved
