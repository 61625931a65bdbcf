"""Lower bounds of the effort: below answers and escapes, and proofs of cages."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from command_line import invoke

import energymargin as em
from energymargin_paper.evidence import bounds, bounds_idea, cages, planar_cages
from energymargin_paper.evidence.known_answers import known_answers

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")

CELLS = 20_000


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[bounds.Bounds, Path]:
    folder = tmp_path_factory.mktemp("bounds")
    return bounds.STUDY.reproduce(bounds.STUDY.quick, folder, threads=1), folder


def test_no_bound_is_above_an_answer_or_an_escape(quick: tuple[bounds.Bounds, Path]) -> None:
    result, _ = quick
    assert result.wrong() == []
    assert {row.kind for row in result.rows} == set(bounds.KINDS)


def test_bounds_of_rises_of_potential_energy_are_near_the_answer(
    quick: tuple[bounds.Bounds, Path],
) -> None:
    rows = quick[0].of("conservative")
    assert {row.name for row in rows} >= set(bounds.CONSERVATIVE)
    assert {row.name for row in rows if row.lower < bounds.BAR * row.answer} == set()


def test_a_bound_of_0_has_a_reason_and_any_other_has_none(
    quick: tuple[bounds.Bounds, Path],
) -> None:
    for row in quick[0].rows:
        assert (row.lower == 0.0) == bool(row.reason), row


def test_the_tables_name_what_is_not_proved(quick: tuple[bounds.Bounds, Path]) -> None:
    result, folder = quick
    text = (folder / "bounds.md").read_text()
    assert text == result.to_markdown()
    assert "Lower bounds above an answer or an escape: 0." in text
    assert "| rim |" in text and "## Closed cages in a plane" in text
    lines = (folder / "bounds.csv").read_text().splitlines()
    assert len(lines) == 1 + len(result.rows)


def test_the_picture_shows_them(quick: tuple[bounds.Bounds, Path], tmp_path: Path) -> None:
    bounds.figure_bounds(quick[0]).savefig(tmp_path / "bounds.png", dpi=50)
    assert (tmp_path / "bounds.png").stat().st_size > 5_000


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


def test_the_idea_s_flood_comes_out_below_the_barrier_and_nearer_with_more_cells() -> None:
    few, many = (bounds_idea.flood(level) for level in bounds_idea.LEVELS)
    barrier = bounds_idea.WALLS[2][3] + bounds_idea.RADIUS
    assert few.level < many.level < barrier
    assert many.level > 0.95 * barrier


def test_the_command_refuses_no_cells(tmp_path: Path) -> None:
    result = invoke(["reproduce", "bounds", "--cells", "0", "-o", str(tmp_path)])
    assert result.exit_code == 2
    assert "cells is 0" in result.output
