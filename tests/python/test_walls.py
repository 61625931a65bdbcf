"""Nothing gets through a wall: closed cages, shots, and a box without a lid."""

from __future__ import annotations

import csv
import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import energymargin as em
from energymargin.cli import app
from energymargin_paper.evidence import cages, projectiles, walls

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")

ROOMS = tuple(itertools.product(cages.WALLS, cages.OBJECTS))
CAGES = 3 * len(ROOMS)
NODES = 30  # with which searches got out of 43 of the cages before collisions were continuous
SHOTS = 300
SMALL = ("--cages", "2", "--shots", "6", "--nodes", "5", "--threads", "2")


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
        for planner in walls.PLANNERS if seed < len(ROOMS) else walls.PLANNERS[:1]:
            effort = em.escape_effort(
                problem, planner=planner, nodes=NODES, seed=seed, search="improved"
            ).effort
            if effort < math.inf:
                out.append((seed, planner, object_kind, effort))
    assert out == []


@pytest.mark.parametrize("case", projectiles.CASES)
def test_no_shot_comes_out_on_the_far_side_of_a_wall(case: str) -> None:
    pytest.importorskip("trimesh")
    shots = {seed: projectiles.random_shot(seed) for seed in range(SHOTS)}
    depths = {s: projectiles.depth(shot) for s, shot in shots.items() if shot.case == case}
    assert len(depths) > 0.15 * SHOTS
    assert {s: depth for s, depth in depths.items() if depth > 0.5 * shots[s].thickness} == {}


@pytest.mark.parametrize("seed", (449, 526, 1512, 1602, 2832, 4451, 6814))
def test_no_shot_that_is_squeezed_or_spins_hard_comes_out(seed: int) -> None:
    """A spin of radians a step turns old normals into nonsense, and what moves a body out of a
    wall may press it into a paddle."""
    pytest.importorskip("trimesh")
    assert projectiles.depth(projectiles.random_shot(seed)) < 0


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
    shots = [projectiles.random_shot(seed) for seed in range(40)]
    for shot in shots:
        shot.scene.disable_collisions("wall", "object")
    depths = [projectiles.depth(shot) for shot in shots if shot.case == case]
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


def test_the_command_goes_on_where_it_was_stopped(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    command = ["reproduce", "walls", *SMALL, "-o", str(tmp_path)]
    assert CliRunner().invoke(app, command).exit_code == 0
    table, runs = (tmp_path / "walls.csv").read_text(), tmp_path / "runs.jsonl"
    lines = runs.read_text().splitlines(keepends=True)
    assert len(lines) == 2 * 2 + 6
    runs.write_text("".join(lines[:-3]) + lines[-3][:40])  # the last line is cut in two
    assert CliRunner().invoke(app, command).exit_code == 0
    again = runs.read_text().splitlines(keepends=True)
    assert again[: len(lines) - 3] == lines[:-3] and len(again) == len(lines)
    for before, after in zip(
        _rows(table), _rows((tmp_path / "walls.csv").read_text()), strict=True
    ):
        assert before.pop("seconds") and after.pop("seconds")
        assert before == after


def test_the_page_names_each_passage_and_each_slow_search_by_its_seed() -> None:
    def row(kind: str, seed: int, result: float, seconds: float = 1.0) -> walls.Outcome:
        case = "fixed" if kind == walls.SHOT else "cage"
        return walls.Outcome(kind, seed, 5, case, "mesh", "box", 0.002, 3.0, result, seconds)

    cage = [row("est", 1, math.inf, 61.0), row("est", 2, 0.5), row("rrt", 1, math.inf)]
    text = walls.Walls(
        [*cage, row(walls.SHOT, 7, -0.001), row(walls.SHOT, 8, 0.0015)]
    ).to_markdown()
    assert text.count("**1 of 2**") == 2 and "**0 of 1**" in text
    assert "random_cage(2), est: mesh, box, 2.00 mm, 3.0 weights, 0.5 J" in text
    assert "random_shot(8): fixed, mesh, box, 2.00 mm, 3.0 m/s, 1.50 mm" in text
    assert "random_cage(1), est: mesh, box, 2.00 mm, 3.0 weights, inf J: 61 s" in text
    assert "random_shot(7)" not in text and "random_cage(1), rrt" not in text


def _rows(table: str) -> list[dict[str, str]]:
    return list(csv.DictReader(table.splitlines()))
