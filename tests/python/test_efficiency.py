"""`reproduce efficiency`: success prediction and time a state, against nodes."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import energymargin as em
from energymargin.cli import app
from energymargin.evaluation.labelled import HORIZON, captured_labels, trajectory_score
from energymargin.store import ScoreStore
from energymargin_paper.paper import efficiency

SMALL = efficiency.Settings(trajectories=6, nodes=(5, 10), seeds=2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("efficiency")


@pytest.fixture(scope="module")
def result(folder):
    return efficiency.STUDY.reproduce(SMALL, folder, threads=1)


def rows(text):
    return list(csv.DictReader(text.splitlines()))


def test_the_numbers_are_those_of_the_same_searches_alone(result, folder):
    from sklearn.metrics import average_precision_score, roc_auc_score

    dataset = em.datasets.load(folder / "push.h5")
    table = em.score(dataset.problems(), ["capture", "success"], nodes=10, seed=1, threads=1)
    by_push = table["success"].reshape(SMALL.trajectories, -1)
    labels = np.array([captured_labels(t.captured, HORIZON) for t in dataset.trajectories])
    labels = labels[:, :-HORIZON].ravel()  # of the states with as many frames left
    capture = table["capture"].reshape(SMALL.trajectories, -1)[:, :-HORIZON].ravel()
    predicted = [trajectory_score(own) for own in by_push]
    (run,) = (run for run in result.runs if (run.nodes, run.seed) == (10, 1))
    assert run.values["success_auc"] == roc_auc_score(dataset.successes, predicted)
    assert run.values["success_ap"] == average_precision_score(dataset.successes, predicted)
    assert run.values["capture_auc"] == roc_auc_score(labels, capture)
    assert run.values["capture_ap"] == average_precision_score(labels, capture)


def test_the_time_is_the_mean_of_the_seconds_in_the_store(result, folder):
    with ScoreStore(folder / "scores.db") as store:
        seconds = {
            (run.settings["nodes"], run.settings["seed"]): np.mean([row[6] for row in run.rows()])
            for run in store.runs()
        }
    assert {(run.nodes, run.seed): run.values["seconds"] for run in result.runs} == pytest.approx(
        seconds
    )


def test_it_goes_on_from_an_interruption_to_the_same_scores_and_keeps_the_times(result, tmp_path):
    def stop_half_way(done, total):
        if done >= total / 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        efficiency.STUDY.reproduce(SMALL, tmp_path, threads=1, progress=stop_half_way)
    first = efficiency.STUDY.reproduce(SMALL, tmp_path, threads=1).to_csv()
    assert efficiency.STUDY.reproduce(SMALL, tmp_path, threads=1).to_csv() == first
    for ours, undisturbed in zip(rows(first), rows(result.to_csv()), strict=True):
        for timed in (ours, undisturbed):
            assert float(timed.pop("seconds")) > 0 and float(timed.pop("seconds_sd")) >= 0
        assert ours == undisturbed


def test_mean_and_deviation_are_those_of_the_seeds():
    values = [dict.fromkeys(efficiency.QUANTITIES, auc) for auc in (0.8, 0.9, 1.0)]
    runs = [efficiency.Measurement(10, seed, own) for seed, own in enumerate(values)]
    made = efficiency.Efficiency(replace(SMALL, nodes=(10,), seeds=3), runs)
    assert made.mean_sd(10, "success_auc") == pytest.approx((0.9, 0.1))
    assert "0.900 ± 0.100" in made.to_markdown()
    alone = efficiency.Efficiency(replace(SMALL, nodes=(10,), seeds=1), runs[:1])
    assert alone.mean_sd(10, "success_auc") == (0.8, 0.0)


def test_the_command_writes_table_numbers_and_picture(tmp_path):
    command = ["reproduce", "efficiency", "--quick", "--trajectories", "6", "--nodes", "4,8"]
    done = CliRunner().invoke(app, [*command, "--threads", "1", "-o", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "efficiency.png").stat().st_size > 10_000
    assert (tmp_path / "efficiency.md").read_text().strip() in done.output
    assert [row["nodes"] for row in rows((tmp_path / "efficiency.csv").read_text())] == ["4", "8"]


def test_the_papers_curve_is_drawn_beside_ours(result):
    left, right = efficiency.figure_efficiency(result).axes
    assert left.get_xscale() == "log"
    assert len(left.containers) == 4 and len(right.containers) == 2
    (time,) = (drawn for drawn in right.containers if drawn.get_label() == "paper: time")
    assert time.lines[0].get_ydata().tolist() == [0.0237, 0.0608, 0.1938, 1.7498]
