"""The study of foresight, small: what counts, what is kept, and what the plan knows."""

from __future__ import annotations

import csv
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import invoke

from energymargin import datasets, tasks
from energymargin.tasks import ScriptedTask
from energymargin_paper import probabilities
from energymargin_paper.evidence import foresight
from energymargin_paper.evidence.foresight import Settings
from energymargin_paper.evidence.foresight_figure import figure_foresight
from energymargin_paper.evidence.foresight_task import NAMES, TaskForesight

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")

SMALL = Settings(
    ("push", "topple"), trajectories=4, nodes=5, rollouts=4, fresh=4, continuations=2, seed=3
)
COMMAND = (
    *("reproduce", "foresight", "--tasks", "push,topple", "--trajectories", "4", "--nodes", "5"),
    *("--rollouts", "4", "--fresh", "4", "--continuations", "2", "--seed", "3", "--threads", "2"),
)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[foresight.Foresight, Path]:
    folder = tmp_path_factory.mktemp("foresight")
    return foresight.STUDY.reproduce(SMALL, folder, threads=2), folder


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text().splitlines()))


def test_every_score_has_a_row_for_each_task_and_horizon(
    study: tuple[foresight.Foresight, Path],
) -> None:
    result, folder = study
    rows = rows_of(folder / "foresight.csv")
    assert [(r["task"], r["score"], r["horizon"]) for r in rows] == [
        (task, name, str(h)) for task in SMALL.tasks for name in NAMES for h in range(1, 6)
    ]
    assert all(task.missing == 0 for task in result.tasks)
    text = result.to_markdown()
    rows = [line.split(" | ")[0] for line in text.splitlines()]
    assert all(rows.count(f"| {name}") == 2 for name in NAMES.values())
    assert rows.count("| push") == rows.count("| topple") == 2  # in short, and fresh rollouts
    assert "Uniform(strength=0.6, objects=2)" in text and "## Against fresh rollouts" in text


def test_states_count_that_are_captured_now_and_have_the_whole_horizon(
    study: tuple[foresight.Foresight, Path],
) -> None:
    result, folder = study
    push = result.tasks[0]
    trajectories = datasets.load(folder / "push.h5").trajectories
    expected = {
        10 * t + k: trajectory.captured[k : k + 4].all()
        for t, trajectory in enumerate(trajectories)
        for k in range(7)
        if trajectory.captured[k]
    }
    compared = push.compared("script", 3)
    assert dict(zip(compared.number.tolist(), compared.labels.tolist(), strict=True)) == expected


def test_a_longer_horizon_is_never_likelier(study: tuple[foresight.Foresight, Path]) -> None:
    result, _ = study
    for task in result.tasks:
        for name in ("coast", "hold", "script", "default", "fresh", "nominal", "ceiling"):
            shares = [task.scores[name][h] for h in range(1, 6)]
            for near, far in pairwise(shares):
                both = ~np.isnan(near) & ~np.isnan(far)
                assert (far[both] <= near[both]).all()


def test_a_study_that_was_stopped_goes_on_to_the_same_table(
    study: tuple[foresight.Foresight, Path], tmp_path: Path
) -> None:
    _, folder = study
    for name in ("push.h5", "topple.h5"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    lines = (folder / "runs.jsonl").read_text().splitlines(keepends=True)
    half = len(lines) // 2
    (tmp_path / "runs.jsonl").write_text("".join(lines[:half]) + lines[half][:30])
    result = invoke([*COMMAND, "-o", str(tmp_path), "--overwrite"])
    assert result.exit_code == 0, result.output
    for name in ("foresight.csv", "reliability.csv", "foresight.md"):
        assert (tmp_path / name).read_text() == (folder / name).read_text()
    again = (tmp_path / "runs.jsonl").read_text().splitlines(keepends=True)
    assert again[:half] == lines[:half] and len(again) == len(lines)


def test_the_picture_has_a_column_for_each_task(study: tuple[foresight.Foresight, Path]) -> None:
    pytest.importorskip("matplotlib")
    figure = figure_foresight(study[0].tasks)
    assert [ax.get_title() for ax in figure.axes[:2]] == ["push", "topple"]
    assert all(len(ax.lines) >= 6 for ax in figure.axes[:2])


def test_the_undisturbed_script_tells_when_a_push_is_lost() -> None:
    task = tasks.make("push")
    assert isinstance(task, ScriptedTask)
    right = []
    for seed in range(6):
        trajectory = task.rollout(seed)
        now, *later = trajectory.times[3:7]
        problem = task.future(trajectory.states[3], now, trajectory.params, later[-1] - now)
        shares, steps = probabilities.nominal(problem, np.array(later) - now)
        assert steps == 200 and set(shares) <= {0.0, 1.0}
        stays = np.logical_and.accumulate(trajectory.captured[3:7])[1:]
        right += list(np.array(shares) == stays)
    assert np.mean(right) > 0.9


def test_a_curve_is_read_at_the_last_look_before_a_frame() -> None:
    times, curve = np.array([0.0, 0.1, 0.2]), np.array([1.0, 0.8, 0.5])
    shares = probabilities.share_by_frame(times, curve, np.array([0.05, 0.1, 0.15, 0.2]))
    assert shares == [1.0, 0.8, 0.8, 0.5]


def test_a_learner_foresees_trajectories_that_it_has_not_seen() -> None:
    random = np.random.default_rng(0)
    trajectory = np.repeat(np.arange(40), 10)
    states = random.normal(size=(400, 3))
    stays = states[:, 0] > 0
    counts = random.uniform(size=400) < 0.9
    found = probabilities.learned(states, stays, trajectory, counts, seed=0)
    assert np.array_equal(np.isnan(found), ~counts)
    assert np.mean((found[counts] > 0.5) == stays[counts]) > 0.95


def test_a_learner_cannot_remember_a_trajectory() -> None:
    random = np.random.default_rng(1)
    trajectory = np.repeat(np.arange(200), 4)  # each has one state, and a label by chance
    states = random.normal(size=(200, 3))[trajectory]
    stays = (random.uniform(size=200) < 0.5)[trajectory]
    found = probabilities.learned(states, stays, trajectory, np.ones(800, dtype=bool), seed=0)
    assert 0.35 < np.mean((found > 0.5) == stays) < 0.65


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"tasks": ("push", "juggle")}, "tasks is 'juggle', expected some of push"),
        ({"tasks": ()}, "tasks is empty"),
        ({"rollouts": 0}, "rollouts is 0"),
        ({"strength": -1.0}, "strength is -1"),
    ],
)
def test_wrong_numbers_are_named(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Settings(**given)


def test_calibration_is_of_the_states_that_count() -> None:
    labels = {h: np.array([True, False, True]) for h in range(1, 6)}
    counts = {h: np.array([True, True, False]) for h in range(1, 6)}
    scores = {"script": {h: np.array([0.75, 0.25, np.nan]) for h in range(1, 6)}}
    task = TaskForesight("push", np.arange(3), labels, counts, scores, {"script": 1.0}, 0)
    assert task.calibration("script", 5) == pytest.approx((0.0625, 0.25))
    assert task.against_fresh(5, unsure=False) is None
