"""Escapes and plans played in MuJoCo: whether they lead out there, and at what work."""

import mujoco
import numpy as np
import pytest

import energymargin as em

# A ball in free space, captured within 1 m: work is force times way.
RADIUS = 1.0


def ball(**problem):
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("ball", em.Sphere(0.1), mass=1.0, role="object")
    inside = em.regions.Ball("ball", (0, 0, 0), RADIUS)
    bounds = {"force": (2, 0, 0), "torque": (0, 0, 0), "duration": 1.0, "captured": inside}
    return em.Problem(scene, scene.pack(), **bounds, **problem)


def at_start(problem):
    model = em.mujoco.model_of(problem.scene, problem.state)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data


def test_an_escape_without_contacts_leads_out_at_the_same_work():
    problem = ball()
    escape = em.escape_effort(problem, nodes=200, search="improved")
    found = em.mujoco.replay(*at_start(problem), problem, escape)
    assert found.escaped and found.least_scale == 1.0
    assert found.effort == pytest.approx(escape.effort, rel=1e-6)
    assert found.distance < 1e-6
    assert not problem.captured.contains(problem.scene, found.state)


def test_the_data_that_are_handed_in_stay_as_they_are():
    problem = ball()
    model, data = at_start(problem)
    em.mujoco.replay(model, data, problem, em.escape_effort(problem, nodes=100, search="improved"))
    assert data.time == 0.0 and not data.xfrc_applied.any()


def test_a_plan_that_carries_the_object_out_is_seen_without_an_escape():
    rows = np.tile([3.0, 0, 0, 0, 0, 0], (240, 1))
    plan = em.Plan(1 / 240, wrenches={"ball": rows})
    problem = ball(plan=plan)
    found = em.mujoco.replay(*at_start(problem), problem)
    assert found.escaped and found.effort == 0.0
    assert found.time == pytest.approx(np.sqrt(2 * RADIUS / 3.0), abs=1 / 60 + 1e-6)


def test_a_motor_of_a_plan_brings_its_body_to_the_velocity():
    rows = np.tile([0.5, 0, 0, 0, 0, 0], (120, 1))
    problem = ball(plan=em.Plan(1 / 240, velocities={"ball": rows}))
    found = em.mujoco.replay(*at_start(problem), problem)
    assert not found.escaped
    assert found.state[7] == pytest.approx(0.5, abs=1e-6)


def test_a_heavier_object_takes_stronger_wrenches_and_the_least_scale_is_told():
    """Pulled along a floor whose friction in MuJoCo is 5 % higher."""
    scene = em.Scene()
    scene.add_plane("floor", friction=1.0)
    scene.add_body(
        "box", em.Box((0.2, 0.2, 0.1)), mass=1.0, position=(0, 0, 0.05), friction=0.2, role="object"
    )
    inside = em.regions.Ball("box", (0, 0, 0.05), 0.02)
    bounds = {"force": (2.3, 0, 0), "torque": (0, 0, 0), "duration": 1.0, "captured": inside}
    problem = em.Problem(scene, scene.pack(), **bounds)
    escape = em.escape_effort(problem, nodes=300, search="improved")
    model, data = at_start(problem)
    same = em.mujoco.replay(model, data, problem, escape, largest_scale=1.3)
    model.pair_friction[:, :2] *= 1.05
    rough = em.mujoco.replay(model, data, problem, escape, largest_scale=1.3)
    assert not rough.escaped
    assert rough.least_scale is not None and same.least_scale is not None
    assert 1.0 < rough.least_scale <= 1.3 and rough.least_scale > same.least_scale
    assert rough.least_effort > escape.effort


def test_data_at_another_state_and_escapes_that_are_none_are_refused():
    problem = ball()
    model, data = at_start(problem)
    none = em.escape_effort(ball().replace(force=(1e-9, 0, 0)), nodes=5, search="improved")
    with pytest.raises(ValueError, match="escape has no path"):
        em.mujoco.replay(model, data, problem, none)
    with pytest.raises(ValueError, match="escape is None"):
        em.mujoco.replay(model, data, problem)
    escape = em.escape_effort(problem, nodes=200, search="improved")
    data.qpos[0] += 0.1
    with pytest.raises(ValueError, match="data has 'ball' off the problem's state by"):
        em.mujoco.replay(model, data, problem, escape)


def test_a_cancel_ends_a_replay():
    problem, cancel = ball(), em.Cancel()
    escape = em.escape_effort(problem, nodes=200, search="improved")
    cancel.set()
    with pytest.raises(em.Cancelled):
        em.mujoco.replay(*at_start(problem), problem, escape, cancel=cancel)


@pytest.mark.parametrize("timestep", [0.001, 0.002, 0.0025, 0.004, 0.005, 0.01])
def test_an_escape_leads_out_at_the_same_work_at_any_timestep(timestep):
    problem = ball()
    escape = em.escape_effort(problem, nodes=200, search="improved")
    model, data = at_start(problem)
    model.opt.timestep = timestep
    found = em.mujoco.replay(model, data, problem, escape, largest_scale=1.05)
    assert found.least_effort == pytest.approx(escape.effort, rel=0.06)
    assert found.distance < 0.01


@pytest.mark.parametrize("timestep", [0.001, 0.002, 0.0025, 0.004, 0.005, 0.01])
def test_a_plan_is_played_to_its_end_with_all_its_rows_at_any_timestep(timestep):
    """Rows of 1/240 s that push ever harder: N of them give sum(f) / 240 of momentum."""
    force = np.linspace(0.0, 2.0, 240)
    rows = np.zeros((240, 6))
    rows[:, 0] = force
    problem = ball(plan=em.Plan(1 / 240, wrenches={"ball": rows}))
    model, data = at_start(problem)
    model.opt.timestep = timestep
    found = em.mujoco.replay(model, data, problem)
    assert not found.escaped and found.time == pytest.approx(1.0)
    assert found.state[7] == pytest.approx(force.sum() / 240, rel=0.01)


def test_an_exit_counts_after_the_dwell_at_any_timestep():
    """The ball is out from the square root of 2 s / a on; it stays out."""
    rows = np.tile([3.0, 0, 0, 0, 0, 0], (240, 1))
    problem = ball(plan=em.Plan(1 / 240, wrenches={"ball": rows}), dwell=0.1)
    model, data = at_start(problem)
    model.opt.timestep = 0.002
    found = em.mujoco.replay(model, data, problem)
    assert found.escaped
    assert found.time == pytest.approx(np.sqrt(2 * RADIUS / 3.0), abs=1 / 60 + 0.002)
