"""Results tell how many of their steps did not converge, and how much time was lost."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import energymargin as em

STEP = 1 / 240


@pytest.fixture(autouse=True)
def new_to_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test is warned anew."""
    monkeypatch.setattr("energymargin.base.plausibility._known", set())


def tower(iterations: int, horizon: float | None = None) -> em.Problem:
    """Ten bricks on top of each other, of which the uppermost is the object."""
    scene = em.Scene(solver_iterations=iterations)
    scene.add_plane("table")
    for i in range(10):
        role = "object" if i == 9 else "none"
        position = (0.0, 0.0, 0.02 + 0.04 * i)
        scene.add_body(
            f"brick {i}", em.Box((0.1, 0.1, 0.04)), mass=0.5, position=position, role=role
        )
    return em.Problem(
        scene,
        scene.pack(),
        force=(2.0, 2.0, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.1,
        captured=em.regions.Ball("brick 9", (0.0, 0.0, 0.38), 0.05),
        horizon=horizon,
    )


def closing_hand(limit: float, target: float) -> em.Scene:
    """Three fingers of three links, whose drives are at their limits once they hold a cube."""
    scene = em.Scene()
    scene.add_plane("table", friction=0.6)
    cube = em.Box((0.06, 0.06, 0.06))
    scene.add_body("cube", cube, mass=0.5, position=(0, 0, 0.03), role="object", friction=0.7)
    for i in range(3):
        yaw = 2 * np.pi * i / 3
        parent, end = f"palm {i}", 0.0
        place = (0.1 * np.cos(yaw), 0.1 * np.sin(yaw), 0.14)
        scene.add_body(parent, em.Box((0.01, 0.01, 0.01)), mass=0, position=place, yaw=yaw)
        for j, length in enumerate((0.05, 0.04, 0.035)):
            name = f"link {i}{j}"
            shape = em.Box((0.012, 0.015, length))
            scene.add_body(name, shape, mass=0.05, role="effector", friction=0.7)
            scene.add_joint(
                f"joint {i}{j}",
                **{"parent": parent, "child": name, "axis": (0, 1, 0)},
                **{"origin": (0, 0, end), "child_origin": (0, 0, length / 2)},
                **{"stiffness": 1000.0, "damping": 20.0, "limits": (-2.0, 2.0)},
                **{"target": target, "torque_limit": limit},
            )
            parent, end = name, -length / 2
    return scene


@pytest.mark.parametrize("target", (0.3, 0.4))
@pytest.mark.parametrize("limit", (0.2, 0.5, 1.0, 2.0, 5.0))
def test_a_hand_whose_drives_are_at_their_limits_converges(limit, target):
    scene = closing_hand(limit, target)
    rollout = em.World(scene).rollout(scene.pack(), [0.0] * 6, 0.5)
    assert rollout.unconverged <= 0.02 * rollout.steps


def press() -> em.Problem:
    """A block between two bodies that nothing stops, and that drive into it."""
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body("object", em.Box((0.1, 0.1, 0.1)), mass=1.0, role="object")
    for name, side in {"left": -1.0, "right": 1.0}.items():
        scene.add_body(
            name,
            em.Box((0.1, 0.1, 0.1)),
            mass=1.0,
            position=(0.105 * side, 0.0, 0.0),
            velocity=(-side, 0.0, 0.0),
            kinematic=True,
        )
    return em.Problem(
        scene,
        scene.pack(),
        force=(1.0, 1.0, 1.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.1,
        captured=em.regions.Ball("object", (0.0, 0.0, 0.0), 1.0),
        horizon=0.1,
    )


def test_a_rollout_and_a_simulation_tell_the_same() -> None:
    for problem in (tower(1), press()):
        world = em.World(problem.scene)
        rollout = world.rollout(problem.state, [0.0] * 6, 60 * STEP)
        simulation = world.simulate(problem.state, 60, record=[10, 60])
        assert (rollout.steps, simulation.steps) == (60, 60)
        assert rollout.unconverged == simulation.unconverged
        assert rollout.lost_time == pytest.approx(simulation.lost_time)
        assert rollout.unconverged > 30 or rollout.lost_time > 0.03


def test_steps_that_do_not_converge_are_counted_and_warned_of() -> None:
    match = "contact solver did not converge in .* raise solver_iterations"
    with pytest.warns(em.PlausibilityWarning, match=match):
        escape = em.escape_effort(tower(1), nodes=20)
    with pytest.warns(em.PlausibilityWarning, match="contact.md"):
        em.capture_score(tower(2), nodes=20)
    timed = tower(1, horizon=0.1)
    p = em.capture_probability(timed, rollouts=5, warn=False)
    rare = em.capture_probability(timed, rollouts=40, rare=True, warn=False)
    for result in (escape, p, rare):
        assert 0.01 * result.steps < result.unconverged <= result.steps
        assert any("did not converge" in text for text in result.warnings)


def test_lost_time_is_summed_up_and_warned_of() -> None:
    with pytest.warns(em.PlausibilityWarning, match="nothing moved in .* % of"):
        p = em.capture_probability(press(), rollouts=5)
    assert 0.01 * p.steps * STEP < p.lost_time <= p.steps * STEP


def test_sums_do_not_depend_on_threads() -> None:
    def sums(threads: int) -> list[tuple[int, int, float]]:
        results = (
            em.capture_probability(press(), rollouts=8, threads=threads, warn=False),
            em.capture_score(tower(1), nodes=10, trees=3, threads=threads, warn=False),
        )
        return [(one.steps, one.unconverged, one.lost_time) for one in results]

    assert sums(1) == sums(3)


def test_a_table_sums_up_its_rows_and_warns_of_all_steps_once() -> None:
    problems = [tower(1)] * 3
    metrics = ["capture", "effort"]
    with pytest.warns(em.PlausibilityWarning) as caught:
        table = em.score(problems, metrics, nodes=10, threads=1)
    assert len(caught) == 1
    again = em.score(problems, metrics, nodes=10, threads=3)
    for name in ("steps", "unconverged", "lost_time"):
        assert getattr(table, name).tolist() == getattr(again, name).tolist()
        assert table.to_rows()[1][name] == getattr(table, name)[1]
    capture = em.capture_score(problems[0], nodes=10, seed=em.stream(0, 0), warn=False)
    effort = em.escape_effort(problems[0], nodes=10, seed=em.stream(0, 0), warn=False)
    assert table.unconverged[0] == capture.unconverged + effort.unconverged
    assert set(table.warnings) == {0, 1, 2}
    assert any("did not converge" in text for text in table.warnings[0])


def test_an_effort_above_0_of_what_falls_out_by_itself_is_contradicted() -> None:
    scene = em.Scene()
    scene.add_body("object", em.Sphere(0.05), mass=1.0, role="object")
    problem = em.Problem(
        scene,
        scene.pack(),
        force=(50.0, 50.0, 50.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.5,
        captured=em.regions.Ball("object", (0.0, 0.0, 0.0), 0.5),
    )
    with pytest.warns(em.PlausibilityWarning, match="without any disturbance the state leaves"):
        escape = em.escape_effort(problem, nodes=50, search="published")
    assert escape.effort > 0 and escape.undisturbed_exit == pytest.approx(20 / 60)
    assert len(escape.warnings) == 1
    assert escape.warnings[0][1:] in escape._repr_html_()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        waits = em.escape_effort(problem, nodes=50, search="improved")
    assert waits.effort == 0.0 and waits.warnings == ()
