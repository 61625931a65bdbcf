"""Acting on the margin: the path of a scoop."""

import numpy as np
import pytest

from energymargin._core import Cancel, World
from energymargin.tasks.scoop import BEND_TIME, BOXES, LIFT_SPEED, ScoopTask
from energymargin_paper.evidence.act_scoop import BEND, SPEED, ScoopDemo
from energymargin_paper.evidence.act_trials import ENGINES, run

WORLDS = 8
FAST = {
    **{"speed": 0.59, "begin": 0.37, "rise": 0.52, "lift": 0.29},
    **{"tilt": 0.53, "lag": 0.12, "brake": 0.9},
}


@pytest.fixture(scope="module")
def demo():
    return ScoopDemo()


def path(problem, times):
    """Of the scoop, as dicts, at some times [s]."""
    rows = [round(time / problem.scene.step) for time in times]
    simulation = World(problem.scene, problem.plan).simulate(problem.state, rows[-1], record=rows)
    return [problem.scene.unpack(state)["scoop"] for state in simulation.states]


def test_the_nominal_scoop_moves_as_the_script_of_the_task(demo):
    task = ScoopTask(0.35)
    own = demo.problem(demo.nominal)
    script = task.plan(own.state, 0.0, {"friction": 0.35, "speed": SPEED, "bend": BEND})
    times = (BEND_TIME, BEND_TIME + BEND / 2, task.length)
    here, there = path(own, times), path(_with_the_tasks_scoop(task, script), times)
    for one, other in zip(here, there, strict=True):
        assert one["position"] == pytest.approx(other["position"], abs=3e-3)
        assert one["velocity"] == pytest.approx(other["velocity"], abs=3e-3)
    assert here[-1]["velocity"] == pytest.approx([0.0, 0.0, LIFT_SPEED], abs=1e-3)


def _with_the_tasks_scoop(task, script):
    scene = task.scene({"friction": 0.35})
    state = scene.pack(scoop={"velocity": (SPEED, 0.0, 0.0)})
    problem = task.problem(state, {"friction": 0.35})
    return problem.replace(plan=script, horizon=task.length, effector="coast")


def test_a_tilt_turns_the_front_up_by_as_much_and_no_further(demo):
    problem = demo.problem({**demo.nominal, "tilt": 0.4})
    _, tilted, end = path(problem, (0.5, BEND_TIME + BEND + 0.1, 2.0))
    turn = [2 * np.arcsin(one["orientation"][1]) for one in (tilted, end)]
    assert np.abs(turn) == pytest.approx([0.4, 0.4], abs=0.02)
    x, y, z, w = end["orientation"]
    assert 2 * (x * z - w * y) > 0.3  # height of its own x axis


def test_each_box_has_a_mass_a_place_and_a_disturbance_of_its_own(demo):
    random = np.random.default_rng(0)
    bodies = {body.name: body for body in demo.problem(FAST, demo.draw(random)).scene.bodies}
    assert len({bodies[box].mass for box in BOXES}) == len(BOXES)
    rows = demo.wrenches(random, np.arange(480) / 240)
    assert rows.shape == (480, 6 * len(BOXES))
    assert np.linalg.matrix_rank(rows) == 6 * len(BOXES)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_scoop_that_brakes_late_and_tilts_loses_fewer_boxes_in_both_engines(demo, engine):
    worlds = range(WORLDS if engine == "bullet" else 2)
    lost = [run(demo, FAST, engine, world, Cancel()).lost for world in worlds]
    assert sum(lost) < len(lost) / 2


def test_the_nominal_scoop_loses_boxes_in_some_worlds_and_none_in_others(demo):
    lost = [run(demo, demo.nominal, "bullet", world, Cancel()).lost for world in range(WORLDS)]
    assert 0 < sum(lost) < WORLDS
