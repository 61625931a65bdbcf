"""Robots that react and begin in the middle, see noise, press with a force, or never answer."""

import threading
import time as clock

import numpy as np
import pytest
from reacting import PUSHED, SEEN, feedback, on_a_rail, policy, problem

import energymargin as em

NOTHING = em.disturbances.Uniform(strength=0.0)


def counting(seen, memory, now):
    """Pushes by how often it was asked and by the time."""
    return np.hstack([memory, memory * 0 + now, seen[:, :1]]), memory + 1


def robots():
    return {
        "late": feedback(0.05, delay=2),
        "policy": policy(period=0.05, delay=1),
        "uneven": policy(period=1 / 50),
        "counts": policy(counting, period=0.07, memory=1, delay=1),
    }


@pytest.mark.parametrize("name", robots())
@pytest.mark.parametrize("done", [0, 24, 55])
def test_a_robot_goes_on_in_the_middle_with_what_it_remembers(name, done):
    plan, scene, steps = robots()[name], problem().scene, 120
    start = scene.pack(ball={"position": (0.02, 0.01, 0)})
    whole = em.World(scene, plan).simulate(start, steps, record=[done, steps])
    rest = plan.rest(done, scene.step, whole.memory[0])
    later = em.World(scene, rest).simulate(whole.states[0], steps - done)
    assert np.array_equal(later.states[-1], whole.states[1])
    # Together, as a probability asks it, and as a file has it.
    asked = problem(rest, horizon=(steps - done) * scene.step, check=scene.step)
    asked = asked.with_state(whole.states[0])
    inside = em.regions.Ball("ball", (0, 0, 0), 0.5 * np.linalg.norm(start[:3]))
    seen = em.World(scene, plan).simulate(start, steps, record=range(done, steps + 1)).states
    out = np.flatnonzero(~inside.contains(scene, seen))
    found = em.capture_probability(asked.replace(captured=inside, start_outside=True),
                                   rollouts=1, disturbance=NOTHING)  # fmt: skip
    assert np.isnan(found.exit_times[0]) if not len(out) else (
        found.exit_times[0] == pytest.approx(out[0] * scene.step)
    )  # fmt: skip
    if name == "late":
        assert em.Plan.from_json(rest.to_json()).to_json() == rest.to_json()


def test_a_profile_asks_a_policy_later_what_it_would_do_then():
    """One that pushes from .4 s on is lost by then, also when asked in the middle."""

    def act(seen, memory, now):
        return np.full((len(seen), 3), 40.0 if now > 0.39 else 0.0) * [1, 0, 0]

    held = problem(policy(act, period=0.1), horizon=0.4)
    profile = em.margin_profile(
        held, every=0.1, ahead=0.2, rollouts=20, nodes=5, disturbance=NOTHING
    )
    assert (profile.probabilities[:3] == 1).all()
    later = policy(act, period=0.1).rest(48, held.scene.step)
    asks = {"rollouts": 20, "nodes": 5, "disturbance": NOTHING}
    after = em.margin_profile(held, later, every=0.1, ahead=0.4, **asks)
    assert after.probabilities[0] == 0


def test_a_profile_of_one_moment_keeps_what_the_robot_remembers():
    act = lambda seen, memory, now: (np.where(memory >= 3, 40.0, 0.0) * [1, 0, 0], memory + 1)  # noqa: E731
    plan, scene = policy(act, period=0.1, memory=1), problem().scene
    remembered = em.World(scene, plan).simulate(scene.pack(), 72, record=[72]).memory[0]
    held = problem(plan.rest(72, scene.step, remembered), horizon=0.2)
    asks = {"rollouts": 20, "nodes": 5, "disturbance": NOTHING}
    (one,) = em.margin_profile(held, every=0.5, **asks).probabilities
    assert one == em.capture_probability(held, rollouts=20, disturbance=NOTHING).captured == 0


def test_what_a_feedback_sees_has_noise_in_rollouts_and_in_rare_losses():
    noisy = em.Feedback([[0.0, 0.0]], observed=["ball.x", "ball.vx"], corrected=["ball.fx"],
                        period=1 / 60, noise=[0.0, 0.1])  # fmt: skip
    blind = on_a_rail(noisy)
    assert em.capture_probability(blind, rollouts=50, disturbance=NOTHING).captured == 1
    # A gain on noise alone is a random push, of 100 N/m x .1 m.
    deaf = em.Feedback([[0.0, 100.0]], observed=["ball.x", "ball.y"], corrected=["ball.fx"],
                       period=1 / 60, noise=[0.0, 0.1])  # fmt: skip
    shaken = on_a_rail(deaf, horizon=0.5)
    one = em.capture_probability(shaken, rollouts=2000, seed=1, disturbance=NOTHING)
    assert 0.01 < one.captured < 0.99
    again = em.capture_probability(shaken, rollouts=100, seed=1, disturbance=NOTHING, threads=2)
    assert np.array_equal(one.exit_times[:100], again.exit_times, equal_nan=True)
    rare = em.capture_probability(shaken, rollouts=1000, seed=2, disturbance=NOTHING, rare=True)
    assert rare.interval(0.999)[0] <= one.captured <= rare.interval(0.999)[1]
    saved = em.Problem.from_json(shaken.to_json())
    back = em.capture_probability(saved, rollouts=100, seed=1, disturbance=NOTHING)
    assert np.array_equal(back.exit_times, again.exit_times, equal_nan=True)


def test_a_policy_sees_the_noise_of_its_branch_in_rare_losses():
    held = on_a_rail(em.Policy(lambda seen, memory, now: 100 * seen[:, 1:], period=1 / 60,
                               observe=["ball.x", "ball.y"], command=["ball.fx"], noise=[0, 0.1]),
                     horizon=0.5)  # fmt: skip
    whole = em.capture_probability(held, rollouts=1000, seed=1, disturbance=NOTHING)
    rare = em.capture_probability(held, rollouts=300, seed=2, disturbance=NOTHING, rare=True)
    assert rare.interval(0.999)[0] <= whole.captured <= rare.interval(0.999)[1]


@pytest.mark.parametrize("noise", [[1.0], -1.0, [0.0, np.nan, 0, 0, 0, 0]])
def test_noise_that_cannot_be_is_refused(noise):
    with pytest.raises(ValueError, match="noise is"):
        feedback(noise=noise)


def test_a_finger_presses_with_its_force():
    """F = k (x - face) + k c (5 N - F) at rest, for a servo of stiffness k and compliance c."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("wall", em.Box((0.01, 0.1, 0.1)), mass=0.0, position=(0.06, 0, 0))
    scene.add_body("base", em.Box((0.01, 0.01, 0.01)), mass=0.0, position=(0, 0, -0.1))
    scene.add_body("finger", em.Box((0.01, 0.01, 0.01)), mass=0.1, role="object")
    scene.add_joint("slide", parent="base", child="finger", type="prismatic", axis=(1, 0, 0),
                    origin=(0, 0, 0.1), target=0.0, stiffness=1000.0, damping=20.0)  # fmt: skip
    given = {"force": 5.0, "compliance": 5e-4, "targets": {"slide": [0.052]}, "period": 1 / 100}
    plan = em.Feedback.admittance({"slide": "force(finger, wall)"}, **given)
    done = em.World(scene, plan).simulate(scene.pack(), 480, record=[480])
    assert sum(c.normal_force for c in done.contacts[0]) == pytest.approx(3.0, rel=0.05)
    with pytest.raises(ValueError, match="observed is with 'force"):
        em.World(scene, em.Feedback.admittance({"slide": "force(finger, none)"}, **given))


# What hangs


def loops(seen, memory, now):
    if now > 0.2:
        while True:
            pass
    return np.zeros((len(seen), 3))


def sleeps(seen, memory, now):
    if now > 0.2:
        clock.sleep(1000)
    return np.zeros((len(seen), 3))


@pytest.mark.parametrize("act", [loops, sleeps])
def test_a_hang_is_cut_by_the_timeout(act):
    held = problem(em.Policy(act, period=1 / 20, observe=SEEN, command=PUSHED))
    with pytest.raises(TimeoutError):
        em.capture_probability(held, rollouts=3, timeout=0.3)
    if act is loops:
        assert em.escape_effort(held, nodes=100, timeout=0.3) is not None
    assert em.capture_probability(problem(feedback()), rollouts=3).captured >= 0


def test_another_thread_cancels_a_hang():
    cancel = em.Cancel()
    threading.Timer(0.3, cancel.set).start()
    held = problem(em.Policy(loops, period=1 / 20, observe=SEEN, command=PUSHED))
    with pytest.raises(em.Cancelled):
        em.capture_probability(held, rollouts=3, cancel=cancel)


def test_what_the_policy_raises_itself_goes_on():
    def act(seen, memory, now):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        em.capture_probability(problem(policy(act)), rollouts=3, timeout=100)
