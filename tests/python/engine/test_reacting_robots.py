"""What a robot that reacts feels, remembers and is disturbed by, whoever plays it."""

import numpy as np
import pytest
from reacting import on_a_rail

import energymargin as em

STEP = 1 / 240
SPACE = {"force": (1, 1, 1), "torque": (0, 0, 0), "duration": 0.1}


def pressed_on_a_spring() -> em.Problem:
    """A finger that gives way to half of what it feels: 10 N - f / 2 = f on a spring of 100 N/m."""
    scene = em.Scene(gravity=(0, 0, 0))
    rail = {"linear_factor": (1, 0, 0), "angular_factor": (0, 0, 0), "linear_damping": 20.0}
    scene.add_body("anchor", em.Sphere(0.01), mass=0, position=(1, 0, 0))
    scene.add_body("box", em.Box((0.1,) * 3), mass=1, role="object", **rail)
    finger = {"position": (-0.1, 0, 0), "role": "effector", **rail}
    scene.add_body("finger", em.Box((0.1,) * 3), mass=1, **finger)
    scene.add_spring("anchor", "box", stiffness=100.0, rest_length=1.0)
    law = em.Feedback(
        [[0.5]],
        observed=["force(finger, box)"],
        corrected=["finger.fx"],
        period=STEP,
        wrenches={"finger": np.array([[10.0, 0, 0, 0, 0, 0]])},
    )
    near = em.regions.Ball("box", (0, 0, 0), 0.085)  # 10 N alone: 0.1 m
    asked = {"force": (1, 0, 0), "torque": (0, 0, 0), "duration": 0.1, "horizon": 2.0}
    return em.Problem(scene, scene.pack(), captured=near, plan=law, **asked)


def test_a_robot_feels_what_presses_under_noise_of_its_actuators_too() -> None:
    none, noise = em.disturbances.Uniform(strength=0.0), em.disturbances.of_plan()
    for disturbance in (none, noise):
        held = em.capture_probability(pressed_on_a_spring(), disturbance=disturbance, rollouts=2)
        assert held.captured == 1.0


def test_noise_goes_on_behind_the_last_row_of_a_plan_that_reacts() -> None:
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("ball", em.Sphere(0.05), mass=1.0, role="object")
    noise = em.disturbances.of_plan(force=(2, 2, 2), torque=(0, 0, 0))
    found = []
    for rows in (1, 12, 240):
        still = {"wrenches": {"ball": np.zeros((rows, 6))}, "step": STEP, "period": STEP}
        law = em.Feedback([[0.0]], observed=["ball.x"], corrected=["ball.fx"], **still)
        near = em.regions.Ball("ball", (0, 0, 0), 0.15)
        problem = em.Problem(scene, scene.pack(), captured=near, horizon=1.0, plan=law, **SPACE)
        found.append(
            em.capture_probability(problem, disturbance=noise, rollouts=100, seed=1).captured
        )
    assert found[0] == found[1] == found[2] > 0.9  # a bias for a second would take it 1 m away


def test_a_search_begins_with_what_the_robot_remembers() -> None:
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("ball", em.Sphere(0.05), mass=1.0, role="object")
    law = em.Feedback(  # an answer acts 0.1 s after it is asked
        [[100.0]], observed=["ball.x"], corrected=["ball.fx"], period=STEP, delay=24
    )
    whole = em.World(scene, law).simulate(scene.pack(ball={"position": (0.1, 0, 0)}), 144)
    rest = law.rest(48, STEP, whole.memory[47])
    far = em.regions.HalfSpace("ball", (-1, 0, 0), 0.05)  # x above -0.05
    problem = em.Problem(
        scene, whole.states[47], captured=far, plan=rest, horizon=96 * STEP, **SPACE
    )
    leaves = 48 + int(np.flatnonzero(whole.states[48:, 0] < -0.05)[0]) + 1
    found = em.escape_effort(problem, nodes=5)
    assert found.effort == 0.0
    assert found.undisturbed_exit == pytest.approx((leaves - 48) * STEP, abs=4.5 * STEP)


def test_the_rest_of_a_plan_whose_rows_are_no_whole_steps_is_what_is_left() -> None:
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("hand", em.Box((0.1,) * 3), mass=1.0, kinematic=True, role="effector")
    rows = np.zeros((200, 6))
    rows[:, 0] = np.arange(200)
    plan = em.Plan(0.01, velocities={"hand": rows})  # 2.4 steps a row
    whole = em.World(scene, plan).simulate(scene.pack(), 480)
    for done in (1, 239, 240, 479):
        rest = plan.rest(done, STEP)
        assert rest.duration == pytest.approx(2.0 - done * STEP)
        part = em.World(scene, rest).simulate(whole.states[done - 1], 480 - done)
        np.testing.assert_allclose(part.states[-1], whole.states[-1], rtol=0, atol=1e-9)
    with pytest.raises(ValueError, match="done is 480, expected 0 to 479"):
        plan.rest(480, STEP)


def test_a_servo_without_a_torque_holds_a_base_without_a_shape() -> None:
    scene = em.Scene()
    inertial = em.Inertial((0, 0, 0), inertia=(0.01,) * 3)
    scene.add_body("base", em.Compound([]), mass=2.0, role="effector", inertial=inertial)
    scene.add_body("arm", em.Box((0.3, 0.02, 0.02)), mass=0.2)
    scene.add_joint("j", parent="base", child="arm", type="fixed", child_origin=(-0.15, 0, 0))
    held = em.Plan.hold(scene, scene.pack(), 1.0)
    end = em.World(scene, held).simulate(scene.pack(), 240).states[-1]
    np.testing.assert_allclose(scene.unpack(end)["base"]["angular_velocity"], 0, atol=1e-6)


def test_two_steps_that_a_timeout_ends_early_are_counted_or_an_error() -> None:
    held = on_a_rail(horizon=0.5, force=(20, 0, 0), spring=True)
    problem = held.replace(captured=em.regions.Ball("ball", (0, 0, 0), 0.2))
    asked = {"step": 4 * STEP, "rollouts": 2_000_000, "threads": 1, "undisturbed": False}
    noise = em.disturbances.Uniform(hold=0.1)
    with pytest.raises(TimeoutError):
        em.capture_probability(problem, disturbance=noise, timeout=0.3, warn=False, **asked)


def follower_at_rest(kinematic: bool) -> float:
    """Velocity of a joint on a tree of its own that follows a drive which holds it."""
    scene = em.Scene()
    scene.add_body("palm", em.Box((0.1,) * 3), mass=float(kinematic), kinematic=kinematic)
    for name in ("left", "right"):
        scene.add_body(name, em.Box((0.02, 0.02, 0.1)), mass=0.1)
    rail = {"parent": "palm", "type": "prismatic", "axis": (0, 0, 1)}
    drive = {"stiffness": 2000.0, "damping": 20.0, "target": 0.0}
    scene.add_joint("l", child="left", origin=(0, -0.1, -0.2), **rail, **drive)
    scene.add_joint("r", child="right", origin=(0, 0.1, -0.2), mimic=em.Mimic("l"), **rail)
    end = em.World(scene).simulate(scene.pack(), 960).states[-1]
    return float(scene.unpack(end)["right"]["velocity"][2])


@pytest.mark.parametrize("kinematic", [False, True])
def test_what_follows_a_joint_at_rest_is_at_rest(kinematic: bool) -> None:
    assert follower_at_rest(kinematic) == pytest.approx(0.0, abs=1e-6)
