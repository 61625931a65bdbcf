"""One name, one number: `effort` is the least work found, the paper's efforts are as published."""

import json
import subprocess

import numpy as np
import pytest
from problem_files import EXECUTABLE

import energymargin as em
from energymargin.evaluate.searches import SearchSettings, metric_search

NODES = 200


@pytest.fixture(scope="module")
def problem():
    (found,) = em.datasets.generate("push", trajectories=2, frames=3, seed=1).problems([2])
    return found


@pytest.mark.parametrize("horizon", [None, 0.5])
def test_an_effort_is_the_least_work_found_from_every_door(problem, horizon, tmp_path):
    problem = problem.replace(horizon=horizon)
    seed = em.stream(0, 0)
    one = em.escape_effort(problem, nodes=NODES, seed=seed, warn=False)
    improved = em.escape_effort(problem, nodes=NODES, seed=seed, search="improved", warn=False)
    assert np.array_equal(one.tree.states, improved.tree.states)
    assert em.score([problem], ["effort"], nodes=NODES)["effort"] == [one.effort]
    settings = SearchSettings(nodes=NODES)
    assert metric_search(problem, "effort", settings, 0, warn=False).effort == one.effort
    ranked = em.rank([problem, problem], metric="effort", rollouts=1, nodes=NODES, race=False)
    assert ranked.standings[0].score == one.effort
    problem.save(tmp_path / "problem.json")
    command = [EXECUTABLE, tmp_path / "problem.json", "--metric", "effort"]
    command += ["--nodes", NODES, "--seed", seed]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["effort"] == one.effort


@pytest.mark.parametrize("horizon", [None, 0.5])
@pytest.mark.parametrize("planner", ["est", "rrt"])
def test_an_effort_with_the_name_of_a_planner_is_algorithm_1_as_published(
    problem, planner, horizon
):
    problem, seed = problem.replace(horizon=horizon), em.stream(0, 0)
    asked = {"planner": planner, "nodes": NODES, "seed": seed, "warn": False}
    published = em.escape_effort(problem, **asked, search="published").effort
    assert em.score([problem], [f"effort/{planner}"], nodes=NODES).scores == {
        f"effort/{planner}": [published]
    }
    assert em.escape_effort(problem, **asked).effort <= published


def test_a_margin_along_a_plan_has_the_least_work_found(problem):
    timed = problem.replace(horizon=0.5)
    profile = em.margin_profile(timed, every=0.5, rollouts=5, nodes=NODES)
    seed = em.stream(0, 0)
    assert profile.efforts[0] == em.escape_effort(timed, nodes=NODES, seed=seed).effort


def test_a_question_of_a_store_names_no_search():
    for metric in ("effort", "effort/est"):
        assert SearchSettings().of(metric) == {"nodes": 1000, "seed": 0, "stop_at_escape": False}
