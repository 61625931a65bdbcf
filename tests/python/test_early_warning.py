"""The study of early warnings, small: what counts, what the thresholds come from, what it keeps."""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path

import numpy as np
import pytest
from command_line import run_here
from published_data import write_data

from energymargin import Cancel, datasets, monitor
from energymargin_paper.evidence import early_warning, early_warning_states
from energymargin_paper.evidence.early_warning import Settings

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")

SMALL = Settings(tasks=("push",), trajectories=10, false_alarms=0.45, rollouts=3, nodes=3)
COMMAND = (
    *("reproduce", "early-warning", "--tasks", "push", "--trajectories", "10"),
    *("--false-alarms", "0.45", "--rollouts", "3", "--nodes", "3", "--threads", "2"),
)
SCORES = ["probability", "mean-time", "capture", "undisturbed", "distance"]
GROUPS = ["held out", "friction 0.1", "friction 0.6", "friction 0.6, believed 0.3"]

Study = tuple[early_warning.EarlyWarning, Path]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder = tmp_path_factory.mktemp("early")
    return early_warning.STUDY.reproduce(SMALL, folder, threads=2), folder


def runs_of(folder: Path) -> list[tuple[dict, dict]]:
    return [json.loads(line) for line in (folder / "runs.jsonl").read_text().splitlines()]


def calibration_of(folder: Path, score: str) -> tuple[list[list[float]], list[int | None]]:
    """By trajectory its values before the loss, and the loss: from the files alone."""
    found = {
        job["index"]: row["scores"] for job, row in runs_of(folder) if job["group"] == "calibration"
    }
    values, lost = [], []
    for t, trajectory in enumerate(datasets.load(folder / "push-0.h5").trajectories):
        lost.append(monitor.first_loss(trajectory.captured))
        last = len(trajectory) - 1 if lost[-1] is None else lost[-1]
        values.append([found[10 * t + k][score] for k in range(last)])
    return values, lost


def test_every_group_has_a_row_for_each_score(study: Study) -> None:
    result, folder = study
    rows = list(csv.DictReader((folder / "early_warning.csv").read_text().splitlines()))
    assert [(row["group"], row["score"]) for row in rows] == [
        (group, score) for group in GROUPS for score in SCORES
    ]
    assert result.failed == 0
    text = (folder / "early_warning.md").read_text()
    assert "false on at most 45% of the trajectories" in text and "0 states could not" in text
    assert all(f"## push, {group}\n" in text for group in GROUPS)


def test_states_are_scored_up_to_the_loss_but_for_the_last_frame(study: Study) -> None:
    _, folder = study
    for number, group in enumerate(["calibration", *GROUPS]):
        trajectories = datasets.load(folder / f"push-{number}.h5").trajectories
        assert len(trajectories) == (10 if number < 2 else 5)
        expected = [
            10 * t + k
            for t, trajectory in enumerate(trajectories)
            for k in range(9)
            if trajectory.captured[: k + 1].all()
        ]
        scored = sorted(job["index"] for job, _ in runs_of(folder) if job["group"] == group)
        assert scored == expected


def test_what_leaves_between_two_frames_is_lost_at_the_next_one() -> None:
    made = datasets.generate("push", trajectories=13, frames=10, seed=0)
    watched = early_warning_states.Trajectories("calibration", made)
    lost = [monitor.first_loss(trajectory.captured) for trajectory in made.trajectories]
    assert lost[12] == 6
    assert [episode.lost for episode in watched.episodes] == [*lost[:12], 5]


def test_the_threshold_of_a_score_is_that_of_the_calibration_for_every_group(study: Study) -> None:
    result, folder = study
    for row in result.rows:
        values, lost = calibration_of(folder, row.score)
        again = monitor.threshold(values, lost, false_alarms=0.45, ahead=5)
        assert row.threshold is not None and row.threshold.value == again.value
        assert row.threshold.level <= 0.45
        assert row.alarms is not None
        false, possible = row.alarms.false_alarms
        assert 0 <= false <= possible <= len(row.values)


def test_a_mean_time_is_at_least_the_probability_and_a_distance_is_negative(study: Study) -> None:
    _, folder = study
    for _, row in runs_of(folder):
        scores = row["scores"]
        assert scores["probability"] <= scores["mean-time"] <= 1
        assert 0 <= scores["undisturbed"] <= 1 and scores["distance"] < 0


def test_a_study_that_was_stopped_goes_on_to_the_same_table(study: Study, tmp_path: Path) -> None:
    _, folder = study
    for path in folder.glob("*.h5"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    lines = (folder / "runs.jsonl").read_text().splitlines(keepends=True)
    (tmp_path / "runs.jsonl").write_text("".join(lines[:-9]) + lines[-9][:30])
    done = run_here(*COMMAND, "-o", ".", "--overwrite", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for name in ("early_warning.csv", "early_warning.md"):
        assert (tmp_path / name).read_text() == (folder / name).read_text()
    assert (tmp_path / "early_warning.png").stat().st_size > 10_000


def test_a_share_that_so_few_trajectories_cannot_guarantee_has_no_threshold(
    study: Study, tmp_path: Path
) -> None:
    _, folder = study
    for path in (*folder.glob("*.h5"), folder / "runs.jsonl"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    strict = Settings(**{**vars(SMALL), "false_alarms": 0.01})
    result = early_warning.STUDY.reproduce(strict, tmp_path)
    assert all(row.threshold is None and row.alarms is None for row in result.rows)
    assert "| capture score | — | — | — | — | — |" in result.to_markdown()
    early_warning.figure_early_warning(result)


def test_each_half_of_the_recordings_is_held_against_a_threshold_of_the_other(
    tmp_path: Path,
) -> None:
    pytest.importorskip("trimesh")
    data = write_data(tmp_path / "data")
    one, other = early_warning_states.recordings_of(data, 1)
    assert one.group == "recordings, one half" and other.group == "recordings, other half"
    assert len(one.episodes) == len(other.episodes) == 1
    job = early_warning_states.Job("0", "recordings", one.group, 1, next(one.scored), 3, 3, 0)
    found = early_warning_states.run({("recordings", one.group): one}, job, Cancel())
    assert found.error is None and list(found.scores) == [*SCORES, "theirs"]
    assert found.scores["theirs"] == 1.0 - 0.01 * job.index  # as the folder's file has it


def test_an_episode_is_the_longest_time_in_which_it_is_captured() -> None:
    longest = early_warning_states._longest
    assert longest(np.array([0, 1, 1, 0, 1, 1, 1, 0], bool)) == (4, 7)
    assert longest(np.array([1, 1, 0, 1, 1], bool)) == (0, 2)
    assert longest(np.array([1, 1, 1], bool)) == (0, 3)
    assert longest(np.array([0, 0], bool)) == (0, 0)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--tasks", "juggle"), "tasks is 'juggle', expected some of push, balance"),
        (("--tasks", "push,push"), "tasks is push, push, expected some of"),
        (("--trajectories", 0), "trajectories is 0"),
        (("--false-alarms", 1), "false_alarms is 1, expected a number between 0 and 1"),
        (("--lead", 0), "lead is 0"),
        (("--tasks", "recordings", "--data", "."), "has no published data"),
        (("--data", "."), "data has the recordings"),
    ],
)
def test_bad_settings_are_refused(words: tuple, message: str, tmp_path: Path) -> None:
    done = run_here(*COMMAND[:2], "--quick", *words, "-o", tmp_path / "out", cwd=tmp_path)
    assert done.returncode == 2 and message in " ".join(done.stderr.split())
    assert not list(tmp_path.rglob("runs.jsonl"))


@pytest.mark.skipif(
    "ENERGYMARGIN_PUBLISHED" not in os.environ, reason="ENERGYMARGIN_PUBLISHED names no folder"
)
def test_half_of_the_authors_recordings_can_calibrate() -> None:
    """More than 19 of each half have a frame in which an alarm would be false."""
    data = Path(os.environ["ENERGYMARGIN_PUBLISHED"])
    for half in early_warning_states.recordings_of(data, 5):
        lost = [episode.lost for episode in half.episodes]
        assert sum(loss is None or loss > half.ahead for loss in lost) >= 19
