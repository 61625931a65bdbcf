"""Nothing gets through a wall: closed cages, shots, and a box without a lid."""

from __future__ import annotations

import itertools
import math

import cages
import numpy as np
import pytest
from projectiles import CASES, depth, random_shot

import energymargin as em

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")

ROOMS = tuple(itertools.product(cages.WALLS, cages.OBJECTS))
CAGES = 3 * len(ROOMS)
NODES = 30  # with which searches got out of 43 of the cages before collisions were continuous
SHOTS = 300
PLANNERS = ("est", "rrt")


@pytest.mark.parametrize("kind", cages.WALLS)
def test_no_search_gets_out_of_a_closed_cage(kind: str) -> None:
    if kind == "mesh":
        pytest.importorskip("trimesh")
    out = []
    for seed in range(CAGES):
        made_of, object_kind = ROOMS[seed % len(ROOMS)]
        if made_of != kind:
            continue
        problem = cages.random_cage(seed, made_of, object_kind).problem
        for planner in PLANNERS if seed < len(ROOMS) else PLANNERS[:1]:
            effort = em.escape_effort(
                problem, planner=planner, nodes=NODES, seed=seed, search="improved"
            ).effort
            if effort < math.inf:
                out.append((seed, planner, object_kind, effort))
    assert out == []


@pytest.mark.parametrize("case", CASES)
def test_no_shot_comes_out_on_the_far_side_of_a_wall(case: str) -> None:
    pytest.importorskip("trimesh")
    shots = {seed: random_shot(seed) for seed in range(SHOTS)}
    depths = {s: depth(shot) for s, shot in shots.items() if shot.case == case}
    assert len(depths) > 0.15 * SHOTS
    assert {s: depth for s, depth in depths.items() if depth > 0.5 * shots[s].thickness} == {}


@pytest.mark.parametrize("seed", (449, 526, 1512, 1602, 2832, 4451, 6814))
def test_no_shot_that_is_squeezed_or_spins_hard_comes_out(seed: int) -> None:
    """A spin of radians a step turns old normals into nonsense, and what moves a body out of a
    wall may press it into a paddle."""
    pytest.importorskip("trimesh")
    assert depth(random_shot(seed)) < 0


@pytest.mark.parametrize("spin", (1e-14, 1e-10, 1e-6))
def test_a_trace_of_spin_changes_nothing_at_a_wall(spin: float) -> None:
    """The root that says when bodies come closer loses its digits there."""

    def end(turning: float) -> np.ndarray:
        scene = em.Scene(gravity=(0, 0, 0))
        scene.add_body("wall", em.Box((0.005, 1, 1)), mass=0, position=(0.1, 0, 0))
        scene.add_body("object", em.Box((0.02,) * 3), mass=0.1, role="object")
        motion = {"velocity": (8, 0.3, 0.1), "angular_velocity": (0, 0, turning)}
        state = scene.pack(object=motion)
        return em.World(scene).rollout(state, np.zeros(6), 6 / 240).state[:3]

    assert end(spin) == pytest.approx(end(0.0), abs=1e-6)


@pytest.mark.parametrize("case", ("fixed", "moving"))
def test_every_shot_would_get_through_if_the_wall_were_not_there(case: str) -> None:
    pytest.importorskip("trimesh")
    shots = [random_shot(seed) for seed in range(40)]
    for shot in shots:
        shot.scene.disable_collisions("wall", "object")
    depths = [depth(shot) for shot in shots if shot.case == case]
    assert len(depths) > 5
    assert min(depths) > 0.0


@pytest.mark.parametrize("kind", cages.WALLS)
def test_a_box_without_a_lid_takes_the_weight_over_its_rim(kind: str) -> None:
    if kind == "mesh":
        pytest.importorskip("trimesh")
    problem, answer = cages.open_box(kind)
    assert answer == pytest.approx(0.03 * 9.81 * (0.03 + 0.9 * 0.002))
    efforts = [
        em.escape_effort(problem, nodes=3000, seed=seed, search="improved").effort
        for seed in range(2)
    ]
    assert 0.99 * answer < min(efforts) < 1.6 * answer
