"""What more of each rollout gives: its states as nodes, and its end at the escape."""

from dataclasses import replace

import numpy as np
import pytest
from command_line import invoke

import energymargin as em
from energymargin.store import ScoreStore, score_dataset


@pytest.fixture(scope="module")
def dataset():
    return em.datasets.generate("topple", trajectories=2, frames=3, seed=0)


@pytest.fixture(scope="module")
def problem(dataset):
    return dataset.problems()[1]


def test_states_on_the_way_are_ends_of_shorter_rollouts_from_the_same_parent(problem):
    score = em.capture_score(problem, nodes=41, seed=3, nodes_per_edge=4)
    tree, world = score.tree, em.World(problem.scene)
    assert score.nodes == 41
    for node in range(1, len(tree)):
        parent = tree.parents[node]
        rollout = world.rollout(tree.states[parent], tree.controls[node], tree.durations[node])
        assert np.array_equal(rollout.state, tree.states[node])
        assert rollout.effort + tree.costs[parent] == tree.costs[node]


def test_the_settings_of_a_batch_are_those_of_the_two_metrics(problem):
    table = em.score([problem], nodes=40, seed=5, nodes_per_edge=4, stop_at_escape=True)
    own = em.stream(5, 0)
    assert (
        table["capture"][0]
        == em.capture_score(problem, nodes=40, seed=own, nodes_per_edge=4).capture
    )
    escape = em.escape_effort(problem, nodes=40, seed=own, stop_at_escape=True)
    assert table["effort"][0] == escape.effort


def test_bad_numbers_of_nodes_an_edge_are_refused(problem):
    for call in (
        lambda n: em.capture_score(problem, nodes_per_edge=n),
        lambda n: em.score([problem], nodes_per_edge=n),
    ):
        with pytest.raises(ValueError, match="nodes_per_edge is 0, expected"):
            call(0)


def test_a_least_likelihood_that_cannot_be_is_refused(problem):
    for wrong in (-0.1, 1, float("nan")):
        for call in (em.capture_score, lambda p, **named: em.score([p], **named)):
            with pytest.raises(ValueError, match=r"least_likelihood is .*, expected"):
                call(problem, least_likelihood=wrong)


def test_nothing_grows_where_the_likelihood_is_below_the_least():
    task = em.tasks.make("balance")
    trajectory = task.rollout(0)
    problem = task.problem(trajectory.states[2], trajectory.params, trajectory.contacts[2])
    tree = em.capture_score(problem, nodes=60, least_likelihood=0.5).tree
    likelihoods, world = np.exp(-problem.rate * tree.costs), em.World(problem.scene)
    ended = np.flatnonzero(likelihoods <= 0.5)
    assert len(ended) > 0 and np.all(likelihoods[tree.parents[1:]] > 0.5)
    for node in ended:
        parent = tree.parents[node]
        shorter = tree.durations[node] - problem.scene.step
        before = world.rollout(tree.states[parent], tree.controls[node], shorter)
        assert np.exp(-problem.rate * (tree.costs[parent] + before.effort)) > 0.5


def test_other_nodes_an_edge_are_another_run_but_of_an_effort(dataset, tmp_path):
    path, settings = tmp_path / "s.db", em.SearchSettings(nodes=8)
    score_dataset(dataset, path, ["capture", "effort/est"], settings=settings)
    score_dataset(
        dataset, path, ["capture", "effort/est"], settings=replace(settings, nodes_per_edge=2)
    )
    with ScoreStore(path) as store:
        one, two = store.runs()
        assert one.asked["capture"] != two.asked["capture"]
        assert one.asked["effort/est"] == two.asked["effort/est"]


def test_the_command_hands_all_settings_on(dataset, tmp_path):
    dataset.save(tmp_path / "data.h5")
    options = ["--nodes-per-edge", "2", "--least-likelihood", "0.1", "--stop-at-escape"]
    command = ["score", str(tmp_path / "data.h5"), "--paper", "--nodes", "10", *options]
    assert invoke(command).exit_code == 0
    with ScoreStore(tmp_path / "data-scores.db") as store:
        settings, scores = store.run().settings, store.run().labelled_scores().scores
    chosen = {"nodes_per_edge": 2, "least_likelihood": 0.1, "stop_at_escape": True}
    assert chosen.items() <= settings.items()
    table = em.score(dataset.problems(), nodes=10, **chosen)
    assert all(np.array_equal(scores[metric], table[metric]) for metric in scores)
