import numpy as np
import pytest

from energymargin import World
from energymargin.tasks.scoop import (
    BEND_TIME,
    BOX_EDGE,
    BOXES,
    CAPTURE_AHEAD,
    FLOOR,
    FRICTION_RANGE,
    LENGTH,
    LIFT_SPEED,
    RAMP,
    SUCCESS_HEIGHT,
    WIDTH,
    ScoopTask,
)

TASK = ScoopTask()
SCENE = ScoopTask().scene({"friction": 0.2})
SMOOTH = {"friction": 0.2}
FRONT = LENGTH + RAMP  # of the scoop, in its frame


def state_of(box_0, speed=0.0, height=0.0):
    """The first box somewhere, the others far away; the scoop at (0, 0, height)."""
    others = {box: {"position": (9.0, n, BOX_EDGE / 2)} for n, box in enumerate(BOXES[1:])}
    scoop = {"position": (0, 0, height), "velocity": (speed, 0, 0)}
    return SCENE.pack(**others, scoop=scoop, **{BOXES[0]: {"position": box_0}})


def pushed(friction, seconds=0.6, speed=0.25):
    """Where a box ends, in the scoop's frame, that stood in its way."""
    start = state_of((FRONT + 0.03, 0, BOX_EDGE / 2), speed)
    steps = round(seconds / TASK.step)
    end = (
        World(ScoopTask().scene({"friction": friction}))
        .simulate(start, steps, record=[steps])
        .states[0]
    )
    bodies = SCENE.unpack(end)
    return bodies[BOXES[0]]["position"] - bodies["scoop"]["position"]


def test_a_seed_gives_the_same_trajectory_and_another_seed_another():
    first, again, other = (TASK.rollout(seed) for seed in (3, 3, 4))
    assert np.array_equal(first.states, again.states) and first.params == again.params
    assert not np.array_equal(first.states, other.states)
    assert FRICTION_RANGE[0] <= first.params["friction"] <= FRICTION_RANGE[1]


def test_no_trajectory_starts_with_bodies_in_each_other():
    for seed in range(20):
        start = TASK.rollout(seed, frames=2).states[0]
        world = World(SCENE)
        for n, box in enumerate(BOXES):
            others = (*BOXES[:n], "scoop")
            assert min(world.distance(start, box, other) for other in others) > 0


def test_a_smooth_scoop_gets_under_a_box_that_stands_still_and_a_rough_one_pushes_it_ahead():
    x, _, z = pushed(friction=0.1)
    assert x < FRONT - BOX_EDGE / 4 and z > BOX_EDGE / 2 + 0.002
    x, _, z = pushed(friction=1.5)
    assert x > FRONT and z == pytest.approx(BOX_EDGE / 2, abs=1e-3)


def test_what_lies_in_the_scoop_is_lifted_with_it():
    start = state_of((LENGTH / 2, 0, FLOOR + BOX_EDGE / 2))
    steps = round(0.5 / TASK.step)
    up = np.zeros((steps, 6))
    up[:24, 2] = 1000.0 * 2.0  # N: 0.2 m/s after 0.1 s
    world = World(SCENE)
    end = SCENE.unpack(world.simulate(start, steps, {"scoop": up}, record=[steps]).states[0])
    lifted = end["scoop"]["position"][2]
    assert lifted == pytest.approx(0.09, abs=0.002)
    assert end[BOXES[0]]["position"][2] == pytest.approx(lifted + FLOOR + BOX_EDGE / 2, abs=1e-3)


def test_the_script_goes_on_along_x_and_then_in_a_bend_up():
    trajectory = TASK.rollout(1, frames=41)
    scoop = [SCENE.unpack(state)["scoop"]["velocity"] for state in trajectory.states]
    before, after = trajectory.times < BEND_TIME, trajectory.times > BEND_TIME + 0.6
    straight, up = np.array(scoop)[before], np.array(scoop)[after]
    assert straight[:, 0] == pytest.approx(trajectory.params["speed"], abs=0.1)
    assert straight[:, 2] == pytest.approx(0, abs=0.005)
    assert up[:, 2] == pytest.approx(LIFT_SPEED, abs=0.01)
    assert abs(up[:, 0]).max() < 0.15


@pytest.mark.parametrize(
    ("box", "speed", "height", "inside"),
    [
        ((LENGTH / 2, 0.0, 0.03), 0.0, 0.0, True),
        ((FRONT - 0.001, 0.0, 0.02), 0.0, 0.0, True),
        ((FRONT + 0.001, 0.0, 0.02), 0.0, 0.0, False),
        ((FRONT + 0.3 * CAPTURE_AHEAD - 0.001, 0.0, 0.02), 0.3, 0.0, True),
        ((FRONT + 0.3 * CAPTURE_AHEAD + 0.001, 0.0, 0.02), 0.3, 0.0, False),
        ((FRONT + 0.1, WIDTH / 2 - 0.001, 0.02), 0.3, 0.0, True),
        ((FRONT + 0.1, WIDTH / 2 + 0.001, 0.02), 0.3, 0.0, False),
        ((FRONT + 0.1, 0.0, 0.02), 0.3, 0.019, True),
        ((FRONT + 0.1, 0.0, 0.02), 0.3, 0.021, False),
        ((FRONT - 0.01, 0.0, 0.02), -0.3, 0.0, True),
        ((-0.001, 0.0, 0.03), 0.3, 0.0, False),
    ],
)
def test_a_box_is_captured_in_the_scoop_and_in_what_it_is_about_to_sweep(
    box, speed, height, inside
):
    state = state_of(box, speed, height)
    assert TASK.captured(state, SMOOTH)[BOXES[0]].contains(SCENE, state) == inside


def test_the_capture_set_goes_with_the_scoop():
    region = TASK.captured(state_of((0.3, 0, 0.02), speed=0.2), SMOOTH)[BOXES[0]]
    later = state_of((0.3, 0, 0.02))
    later[SCENE.slice("scoop")][:3] = (0.5, 0.0, 0.0)
    assert not region.contains(SCENE, later)


def test_success_is_a_box_in_the_scoop_and_lifted():
    success = TASK.succeeded(SMOOTH)[BOXES[0]]
    for z, expected in ((SUCCESS_HEIGHT + 0.001, True), (SUCCESS_HEIGHT - 0.001, False)):
        lifted = state_of((LENGTH / 2, 0, z), height=z - 0.03)
        assert success.contains(SCENE, lifted) == expected
        beside = state_of((LENGTH / 2, 0.2, z), height=z - 0.03)
        assert not success.contains(SCENE, beside)


def test_both_labels_have_both_outcomes_and_all_states_make_a_problem():
    trajectories = [TASK.rollout(seed) for seed in range(12)]
    assert {trajectory.success for trajectory in trajectories} == {True, False}
    assert {trajectory.success_any for trajectory in trajectories} == {True, False}
    for trajectory in trajectories:
        assert trajectory.captured[0]
        for k, state in enumerate(trajectory.states):
            problem = TASK.problem(state, trajectory.params, trajectory.contacts[k])
            layout = problem.scene
            assert problem.captured.contains(layout, state) == trajectory.captured[k]
            assert problem.captured_any.contains(layout, state) == trajectory.captured_any[k]


def test_the_friction_is_the_trajectorys_or_the_tasks_own():
    state = SCENE.pack()
    with pytest.raises(ValueError, match=r"params=trajectory\.params"):
        TASK.problem(state)
    problem = ScoopTask(friction=0.3, effector="drive").problem(state)
    assert problem.effector == "drive"
    (scoop,) = (body for body in problem.scene.bodies if body.role == "effector")
    assert scoop.friction == 0.3
    with pytest.raises(ValueError, match="friction is -1"):
        ScoopTask(friction=-1.0)
