"""The search of an effort that is not asked for by name: the one whose efforts rank states."""

import json
import subprocess

import numpy as np
import pytest
from problem_files import EXECUTABLE

import energymargin as em
from energymargin.searches import SearchSettings

NODES = 200


@pytest.fixture(scope="module")
def dataset():
    return em.datasets.generate("push", trajectories=2, frames=3, seed=1)


@pytest.fixture(scope="module")
def problems(dataset):
    """The same question without and with a clock."""
    (problem,) = dataset.problems([2])
    return {"published": problem, "improved": problem.replace(horizon=0.5)}


@pytest.mark.parametrize("search", ["published", "improved"])
def test_a_horizon_chooses_the_search_everywhere(problems, search, tmp_path):
    problem = problems[search]
    asked = {"nodes": NODES, "seed": 3}
    one = em.escape_effort(problem, **asked)
    named = em.escape_effort(problem, **asked, search=search)
    assert np.array_equal(one.tree.states, named.tree.states)
    scored = em.score([problem], ["effort/est"], nodes=NODES)
    same = em.score([problem], ["effort/est"], nodes=NODES, search=search)
    assert scored["effort/est"] == same["effort/est"]
    problem.save(tmp_path / "problem.json")
    command = [
        EXECUTABLE,
        tmp_path / "problem.json",
        "--metric",
        "effort",
        "--nodes",
        NODES,
        "--seed",
        3,
    ]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["effort"] == one.effort


def test_a_store_knows_the_search_that_was_chosen_by_its_name(dataset, tmp_path):
    path = tmp_path / "scores.db"
    em.store.score_dataset(dataset, path, metrics=["effort/est"], nodes=20)
    with em.store.ScoreStore(path) as store:
        (run,) = store.runs()
        assert run.settings["search"] == "published"
    before = path.read_bytes()
    em.store.score_dataset(dataset, path, metrics=["effort/est"], nodes=20, search="published")
    assert path.read_bytes() == before


def test_settings_say_nothing_of_a_search_until_there_is_a_problem():
    assert SearchSettings().search is None
    assert SearchSettings().of_clock(timed=True).search == "improved"
    assert SearchSettings(search="published").of_clock(timed=True).search == "published"
