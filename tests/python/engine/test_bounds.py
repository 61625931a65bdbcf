"""Lower bounds of the effort: below answers and escapes, and proofs of cages."""

from __future__ import annotations

import math
from functools import partial

import cages
import numpy as np
import planar_cages
import pytest
from known_answers import KNOWN, known_answers

import energymargin as em

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")

CELLS = 20_000
# Where the answer is a rise of potential energy alone, along any way that the object can go.
CONSERVATIVE = ("edge", "notch", "rim", "bowl")
OPEN_BOXES = ("boxes", "compound", "hulls")
TASKS = ("push", "balance", "topple", "grasp", "scoop")


def captured_state(name: str) -> em.Problem:
    """The middle one of the captured states of a task's trajectory."""
    task = em.tasks.make(name)
    trajectory = task.rollout(seed=0)
    captured = np.flatnonzero(trajectory.captured)
    frame = int(captured[len(captured) // 2])
    return task.problem(trajectory.states[frame], trajectory.params)


def known(name: str) -> tuple[em.Problem, float]:
    return KNOWN[name]().problem, KNOWN[name]().answer


# Problems with their answers on paper; nan: unknown.
QUESTIONS = {
    **{name: partial(known, name) for name in KNOWN},
    **{f"open box of {walls}": partial(cages.open_box, walls) for walls in OPEN_BOXES},
    **{
        f"gap of {gap} widths of the bar": lambda gap=gap: (planar_cages.pen(gap), math.nan)
        for gap in (0.0, 0.8, 0.9, 1.05, 1.2)
    },
    **{
        f"planar cage {k}": lambda k=k: (planar_cages.planar_cage(k)[0], math.inf) for k in range(3)
    },
    **{
        f"cage of {walls}": lambda k=k, walls=walls: (cages.random_cage(k, walls).problem, math.inf)
        for k, walls in enumerate(OPEN_BOXES)
    },
    **{task: lambda task=task: (captured_state(task), math.nan) for task in TASKS},
}


@pytest.mark.parametrize("name", QUESTIONS)
def test_no_bound_is_above_an_answer_or_an_escape_and_a_bound_of_0_alone_has_a_reason(
    name: str,
) -> None:
    problem, answer = QUESTIONS[name]()
    bound = em.effort_lower_bound(problem, cells=CELLS)
    assert bound.effort <= em.escape_effort(problem, nodes=100).effort
    assert math.isnan(answer) or bound.effort <= answer
    assert (bound.effort == 0.0) == bool(bound.reason)
    if name in CONSERVATIVE or name.startswith("open box"):
        assert bound.effort >= 0.8 * answer


def test_an_effort_is_between_its_bounds_and_says_how() -> None:
    (rim,) = known_answers(["rim"])
    escape = em.escape_effort(
        rim.problem, nodes=300, lower_bound=True, bound_cells=CELLS, bound_tolerance=0.1
    )
    assert 0.8 * rim.answer < escape.lower_bound < rim.answer < escape.effort
    assert escape.lower_bound == escape.bound.effort
    assert escape.bound.barrier == escape.bound.effort  # it starts at rest
    assert not escape.proved_cage
    alone = em.effort_lower_bound(rim.problem, cells=CELLS, tolerance=0.1)
    assert alone.effort == escape.lower_bound
    assert repr(alone).startswith("LowerBound(effort=0.01")


def test_without_asking_there_is_no_lower_bound() -> None:
    (rim,) = known_answers(["rim"])
    escape = em.escape_effort(rim.problem, nodes=10)
    assert escape.lower_bound is None and escape.bound is None and not escape.proved_cage


def test_a_closed_cage_is_proved_and_one_with_a_door_is_not() -> None:
    (cage,) = known_answers(["cage"])
    assert em.escape_effort(cage.problem, nodes=5, lower_bound=True).proved_cage
    problem, answer = cages.open_box("boxes")
    bound = em.effort_lower_bound(problem, cells=CELLS)
    assert not bound.cage and 0.8 * answer < bound.effort < answer


def test_a_pen_is_proved_if_it_is_closed_and_not_if_the_bar_fits_through_its_gap() -> None:
    assert em.effort_lower_bound(planar_cages.pen(0.0), cells=CELLS).cage
    bound = em.effort_lower_bound(planar_cages.pen(1.05), cells=CELLS)
    assert bound.effort == 0.0 and "never rises" in bound.reason
    with pytest.raises(ValueError, match=r"gap is 5\.0, expected"):
        planar_cages.pen(5.0)


@pytest.mark.parametrize(
    ("options", "message"),
    (
        ({"cells": 0}, "cells is 0"),
        ({"tolerance": 0.0}, "tolerance is 0"),
        ({"tolerance": math.nan}, "tolerance is nan"),
        ({"captured": "some"}, "captured is 'some'"),
        ({"timeout": -1.0}, "timeout is -1"),
    ),
)
def test_bad_options_are_named(options: dict[str, object], message: str) -> None:
    (rim,) = known_answers(["rim"])
    with pytest.raises(ValueError, match=message):
        em.effort_lower_bound(rim.problem, **options)


def test_a_cancel_leaves_what_is_certain() -> None:
    (rim,) = known_answers(["rim"])
    cancel = em.Cancel()
    cancel.set()
    bound = em.effort_lower_bound(rim.problem, cancel=cancel)
    assert not bound.complete and 0.0 <= bound.effort < rim.answer


def test_the_bits_are_the_same_each_time() -> None:
    (notch,) = known_answers(["notch"])
    first, second = (em.effort_lower_bound(notch.problem, cells=5000) for _ in range(2))
    assert (first.effort, first.cells) == (second.effort, second.cells)


@pytest.mark.parametrize("kind", ["stop", "loop"])
def test_what_is_pulled_home_at_the_start_may_lift_the_object(kind: str) -> None:
    scene = em.Scene()
    scene.add_plane("floor")
    scene.add_body("base", em.Box((0.02,) * 3), mass=0, position=(0, 0, -1))
    rail = {"linear_factor": (0, 0, 1), "angular_factor": (0, 0, 0)}
    free = {"position": (0, 0, 0.01), **rail} if kind == "loop" else {}
    scene.add_body("platform", em.Box((0.3, 0.3, 0.02)), mass=0.02, **free)
    joints = {}
    if kind == "stop":
        ends = {"origin": (0, 0, 1.31), "limits": (0.0, 0.01)}
        scene.add_joint(
            "lift", parent="base", child="platform", type="prismatic", axis=(0, 0, 1), **ends
        )
        joints = {"joints": {"lift": {"position": -0.3}}}
    else:
        scene.add_body("crane", em.Sphere(0.01), mass=0, position=(0.5, 0.5, 0.31))
        scene.add_loop("crane", "platform", point_a=(-0.5, -0.5, 0.0))
        scene.disable_collisions("crane", "platform")
    at = (0, 0, 0.07)
    scene.add_body("box", em.Box((0.1,) * 3), mass=1.0, role="object", position=at, **rail)
    near = em.regions.Ball("box", at, 0.1)
    asked = {"force": (0, 0, 1), "torque": (0, 0, 0), "duration": 0.2}
    bound = em.effort_lower_bound(em.Problem(scene, scene.pack(**joints), captured=near, **asked))
    assert bound.effort == 0.0 and not bound.cage
    assert "begin" in bound.reason


def test_in_bullets_engine_nothing_is_proved() -> None:
    problem = cages.random_cage(0, "boxes").problem
    assert em.effort_lower_bound(problem).cage
    problem = problem.with_engine("bullet")
    bound = em.effort_lower_bound(problem)
    assert bound.effort == 0.0 and not bound.cage and "'native'" in bound.reason
