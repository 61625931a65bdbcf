"""How near the effort of escape comes to the least work, small and fast."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from energymargin_paper.evidence import least_efforts, reference_search
from energymargin_paper.evidence.energy_barriers import BARRIERS
from energymargin_paper.evidence.known_answers import KNOWN

pytest.importorskip("cma")


def test_a_reference_search_finds_work_that_is_known_and_never_less() -> None:
    problem = KNOWN["push"]()
    found = reference_search.least_effort(problem.problem, 3000, 0, None)
    assert 0.99 <= found.effort / problem.answer < 4.0
    assert 3000 <= found.rollouts < 4500
    again = reference_search.least_effort(problem.problem, 3000, 0, None)
    assert again.effort == found.effort


def test_a_body_that_leaves_by_itself_needs_no_search_and_a_cage_gets_a_short_one() -> None:
    leaving, cage = KNOWN["leaving"]().problem, KNOWN["cage"]().problem
    assert reference_search.leaves_by_itself(leaving)
    assert not reference_search.leaves_by_itself(cage)
    assert reference_search.least_effort(leaving, 1000, 0, None).effort == 0.0
    found = reference_search.least_effort(cage, 5000, 0, None)
    assert found.effort == math.inf
    assert found.rollouts < 2500


@pytest.mark.parametrize("name", BARRIERS)
def test_no_effort_is_below_a_barrier_by_more_than_the_simulations_own_error(name: str) -> None:
    problem = BARRIERS[name]()
    job = least_efforts.SearchJob("", name, 800, 0)
    found = least_efforts.search(problem.problem, job)
    assert 0.99 <= found.effort(800) / problem.answer < math.inf


def test_the_study_compares_efforts_with_the_best_known_and_goes_on_with_what_is_missing(
    tmp_path: Path,
) -> None:
    study, settings = least_efforts.STUDY, least_efforts.STUDY.quick
    result = study.reproduce(settings, tmp_path, threads=1)
    state = next(name for name in result.answers if name.startswith("topple"))
    assert result.answers[state] <= result.searches[state][0].effort(settings.nodes)
    assert (result.ratios("states of topple", settings.nodes) >= 1.0).all()
    assert set(BARRIERS) < set(result.groups)
    lines = (tmp_path / "searches.jsonl").read_text().splitlines(keepends=True)
    (tmp_path / "searches.jsonl").write_text("".join(lines[:-1]))
    again = study.reproduce(settings, tmp_path, threads=1)
    assert again.to_csv() == result.to_csv()
    assert len(result.to_csv().splitlines()) == 1 + len(lines)
    assert [name for name, _ in study.figures(result)] == ["least_efforts.png"]


def test_negligible_efforts_count_as_the_same() -> None:
    search = least_efforts.Search([(10, 1e-12)], 100)
    result = least_efforts.LeastEfforts(100, {"push 0 0": 1e-15}, {"push 0 0": [search]})
    assert result.ratios("states of push", 100).tolist() == [1.0]
    assert np.isinf(result.ratios("states of push", 5)).all()


def test_settings_out_of_range_and_tasks_that_cannot_be_lost_are_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="states is 0"):
        replace(least_efforts.STUDY.quick, states=0)
    with pytest.raises(ValueError, match="no task 'juggle'"):
        unknown = replace(least_efforts.STUDY.quick, tasks=("juggle",))
        least_efforts.STUDY.reproduce(unknown, tmp_path, threads=1)


def test_without_searches_of_known_answers_the_states_stand_alone(tmp_path: Path) -> None:
    settings = replace(least_efforts.STUDY.quick, answer_seeds=0, nodes=50, rollouts=1500)
    result = least_efforts.STUDY.reproduce(settings, tmp_path, threads=1)
    assert set(result.groups) == {"states of topple"}
