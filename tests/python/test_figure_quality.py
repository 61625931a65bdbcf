"""`reproduce figure-quality`: six frames with their trees and scores."""

import csv

import numpy as np
import pytest
from typer.testing import CliRunner

import energymargin as em
from energymargin.cli import app
from energymargin.store import ScoreStore
from energymargin.store.scoring import begin_run, score_run
from energymargin_paper.paper import figure_quality as experiment

SMALL = experiment.Settings(trajectories=6, nodes=12, seed=4)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return experiment.STUDY.reproduce(SMALL, tmp_path_factory.mktemp("figure"), threads=1)


@pytest.fixture(scope="module")
def panels(result):
    return [
        ax for ax in experiment.figure_quality(result).axes if ax.get_title().startswith("t = ")
    ]


def test_there_are_three_frames_of_a_push_that_fails_and_of_one_that_succeeds(result):
    assert [frame.push for frame in result.frames] == ["failed"] * 3 + ["successful"] * 3
    for frame in result.frames:
        trajectory = result.dataset.trajectories[frame.trajectory]
        assert trajectory.success == (frame.push == "successful")
        assert trajectory.times[frame.frame] == frame.time
        assert result.dataset.frames()[frame.state] == (frame.trajectory, frame.frame)


def test_the_numbers_are_those_of_the_datasets_store(result, tmp_path):
    settings = em.SearchSettings(SMALL.nodes, SMALL.seed)
    with ScoreStore(tmp_path / "scores.db", create=True) as store:
        run = begin_run(store, result.dataset, ["capture", "success"], settings)
        assert score_run(result.dataset, run)
        scores = run.labelled_scores().scores
    for frame in result.frames:
        assert frame.capture == scores["capture"][frame.state]
        assert frame.success == scores["success"][frame.state]


def test_under_each_panel_stands_its_pair_of_success_and_capture(result, panels):
    written = [ax.get_xlabel().split("\n")[-1] for ax in panels]
    assert written == [frame.pair for frame in result.frames]
    first = result.frames[0]
    assert first.pair == f"({first.success:.2f}, {first.capture:.2f})"


def test_the_trees_that_are_drawn_are_those_of_the_scores(result, panels):
    problems = result.dataset.problems()
    for frame, ax in zip(result.frames, panels, strict=True):
        seed = em.stream(SMALL.seed, frame.state)
        score = em.capture_score(problems[frame.state], nodes=SMALL.nodes, seed=seed)
        assert (score.capture, score.success) == (frame.capture, frame.success)
        (dots,) = (dots for dots in ax.collections if dots.get_gid() == "nodes")
        assert np.array_equal(dots.get_array(), score.tree.costs)


def test_each_panel_has_three_ghosts_of_box_and_pusher(panels):
    for ax in panels:
        ghosts = [patch for patch in ax.patches if not patch.get_fill() and patch.get_alpha() < 0.5]
        assert len(ghosts) == 3 * 2


def test_the_command_writes_the_same_table_numbers_and_picture_again(tmp_path):
    command = ["reproduce", "figure-quality", "--quick", "--trajectories", "6", "--nodes", "8"]
    written = []
    for threads in ("1", "2"):
        done = CliRunner().invoke(app, [*command, "--threads", threads, "-o", str(tmp_path)])
        assert done.exit_code == 0, done.output
        assert (tmp_path / "figure_quality.md").read_text().strip() in done.output
        assert (tmp_path / "figure_quality.png").stat().st_size > 10_000
        written.append((tmp_path / "figure_quality.csv").read_text())
    assert written[0] == written[1]
    assert len(list(csv.DictReader(written[0].splitlines()))) == 6
