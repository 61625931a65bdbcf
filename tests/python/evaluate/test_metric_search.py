"""A state with the same settings has the same scores wherever it is asked about."""

from dataclasses import replace

import numpy as np
import pytest

import energymargin as em
from energymargin.act.gym.wrapper import score_of
from energymargin.datasets import Future
from energymargin.evaluate.searches import SearchSettings, metric_search, value_of
from energymargin.look.report.pictures import SearchRepeater
from energymargin.look.viewer import view
from energymargin.monitor import Monitor
from energymargin.store import ScoreStore, score_dataset

SETTINGS = SearchSettings(
    nodes=120,
    seed=5,
    nodes_per_edge=4,
    least_likelihood=0.1,
    stop_at_escape=True,
    rollouts=12,
    strength=2.0,
    common_random_numbers=True,
)
CLOCKLESS = ("capture", "success", "effort", "force")
TIMED = ("probability", "probability/success", "effort")
LATER = Future(3, "hold")


@pytest.fixture(scope="module")
def dataset():
    return em.datasets.generate("balance", trajectories=1, frames=8, seed=4)


def in_a_store(dataset, path, metrics, future):
    score_dataset(dataset, path, metrics, settings=SETTINGS, future=future)
    with ScoreStore(path) as store:
        scores = store.run().labelled_scores().scores
    return {metric: scores[metric][0] for metric in metrics}


def on_the_page(dataset, path):
    """Of the viewer, which is told of the file of scores alone."""
    (scored,) = view(dataset, scores=path, trajectory=0, frame=0).scored
    found = {"effort": scored.escape.effort}
    if scored.capture is None:
        return found | scored.values
    force = scored.force.force
    return found | {
        "capture": scored.capture.capture,
        "success": scored.capture.success,
        "force": force,
    }


@pytest.mark.parametrize(("metrics", "future"), [(CLOCKLESS, None), (TIMED, LATER)])
def test_store_viewer_report_and_gym_give_the_same_bits(dataset, tmp_path, metrics, future):
    stored = in_a_store(dataset, tmp_path / "s.db", metrics, future)
    assert np.isfinite(list(stored.values())).all()
    problem = dataset.problems([0], future=future)[0]
    repeater = SearchRepeater(dataset, SETTINGS.all(), future)
    assert {m: repeater.repeat(0, m).score for m in metrics} == stored
    gym = {m: score_of(problem, m, SETTINGS, threads=2)["score"] for m in metrics}
    assert gym == stored
    page = on_the_page(dataset, tmp_path / "s.db")
    assert {m: page[m] for m in metrics} == stored


def test_a_monitor_gives_the_bits_of_the_store(dataset, tmp_path):
    stored = in_a_store(dataset, tmp_path / "s.db", ("probability",), LATER)
    problem = dataset.problems([0], future=LATER)[0]
    asked = {"rollouts": SETTINGS.rollouts, "seed": SETTINGS.seed}
    with Monitor(
        lambda state, time: problem.with_state(state), disturbance=SETTINGS.disturbance, **asked
    ) as monitor:
        monitor.push(0.0, problem.state)
        assert monitor.wait(60.0)
    assert monitor.latest.value == stored["probability"]


@pytest.mark.parametrize(
    ("metric", "change"),
    [
        ("capture", {"nodes_per_edge": 1}),
        ("capture", {"least_likelihood": 0.0}),
        ("effort", {"stop_at_escape": False}),
        ("capture", {"seed": 6}),
    ],
)
def test_each_setting_of_a_metric_counts(dataset, metric, change):
    problem = dataset.problems([0])[0]
    found = [
        value_of(metric, metric_search(problem, metric, settings, 0))
        for settings in (SETTINGS, replace(SETTINGS, **change))
    ]
    assert found[0] != found[1]


def test_a_problem_alone_has_the_seed_itself(dataset):
    problem = dataset.problems([0])[0]
    settings = SearchSettings(nodes=30, seed=7)
    found = metric_search(problem, "capture", settings)
    assert np.array_equal(
        found.tree.states, em.capture_score(problem, nodes=30, seed=7).tree.states
    )


def test_the_page_of_a_margin_along_a_plan_gives_its_scores_again(dataset):
    problem = dataset.problems([0], future=LATER)[0]
    asked = {"rollouts": 9, "nodes": 60, "seed": 3}
    along = em.margin_profile(problem, every=0.5, **asked)
    (scored,) = view(along).scored
    assert scored.probability.captured == along.probabilities[0]
    assert scored.escape.effort == along.efforts[0] < np.inf
