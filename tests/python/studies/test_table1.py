"""The table as a user makes it, in a process of its own, and very small."""

import csv
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from stores import await_scores, score_count

from energymargin import datasets
from energymargin.store import ScoreStore
from energymargin_paper.pages import Head
from energymargin_paper.paper.table1 import STUDY, Settings

COMMAND = [str(Path(sys.executable).with_name("energymargin")), "reproduce", "table1"]
SMALL = ["--tasks", "push", "--trajectories", "4", "--nodes", "10", "--continuations", "3"]
SCORES = ["capture", "effort/est", "effort/rrt", "force"]


def run(*arguments, cwd):
    return subprocess.run(
        [*COMMAND, *arguments], cwd=cwd, check=False, capture_output=True, text=True, timeout=120
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder in which the table was made."""
    folder = tmp_path_factory.mktemp("table1")
    done = run(*SMALL, "-o", "t", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def rows(folder):
    with (folder / "t" / "table1.csv").open() as file:
        return list(csv.DictReader(file))


def test_the_files_are_there(folder):
    assert {path.name for path in (folder / "t").iterdir()} == {
        *("push.h5", "push-ceiling.db", "push-coast-scores.db", "push-drive-scores.db"),
        *("table1.csv", "table1.md", "push.png", "made.txt", ".energymargin"),
    }


def test_the_csv_has_every_cell_of_both_readings_and_of_the_ceiling(folder):
    found = [(row["effector"], row["score"], row["horizon"]) for row in rows(folder)]
    horizons = [str(h) for h in range(6)]
    for effector in ("drive", "coast"):
        assert {(effector, score, h) for score in SCORES for h in horizons} < set(found)
        assert (effector, "success", "") in found
    assert {("", "ceiling", h) for h in horizons} | {("", "ceiling/success", "")} < set(found)
    assert len(found) == len(set(found)) == 2 * 25 + 7


def test_the_force_score_and_the_labels_are_the_same_in_both_readings(folder):
    by_reading = {
        effector: [
            {**row, "effector": ""}
            for row in rows(folder)
            if row["score"] == "force" and row["effector"] == effector
        ]
        for effector in ("drive", "coast")
    }
    assert by_reading["drive"] == by_reading["coast"] != []
    positives = {(row["horizon"], row["positives"]) for row in rows(folder) if row["auc"]}
    assert len(positives) == len({horizon for horizon, _ in positives})


def test_the_table_says_how_it_is_made_again(folder):
    text = (folder / "t" / "table1.md").read_text()
    command = Head.of_folder(folder / "t").command.split()[3:]
    assert command == [
        *("--tasks", "push", "--trajectories", "4", "--nodes", "10", "--continuations", "3"),
    ]
    kept = {path.name: path.stat().st_mtime_ns for path in (folder / "t").glob("*.[hd]*")}
    done = run(*command, "-o", "t", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "t" / "table1.md").read_text() == text
    assert {path.name: path.stat().st_mtime_ns for path in (folder / "t").glob("*.[hd]*")} == kept


def test_the_terminal_shows_it_in_80_columns_with_the_papers_values(folder):
    shown = run(*SMALL, "-o", "t", cwd=folder).stdout
    assert max(map(len, shown.splitlines())) <= 80
    assert all(word in shown for word in ("drive", "coast", "ceiling", "positives", ".97/.99"))


def test_cells_below_the_papers_are_named(folder):
    text = (folder / "t" / "table1.md").read_text()
    for effector, section in zip(("drive", "coast"), text.split("## Table I")[1:], strict=True):
        summary = section.split("\n## ")[0]
        cells = {(r["score"], r["horizon"]): r for r in rows(folder) if r["effector"] == effector}
        names = {"capture": "capture", "effort/est": "effort EST", "effort/rrt": "effort RRT"}
        for score, name in names.items():
            cell = cells[score, "0"]
            below = cell["auc"] and any(
                round(float(cell[m]), 2) < float(cell[f"paper_{m}"]) for m in ("auc", "ap")
            )
            noted = re.search(rf"- push, {name}: (AUC|AP)[^:]* below the paper's", summary)
            assert (noted is not None) == bool(below)


def test_a_table_of_other_settings_leaves_the_scores_of_the_first(folder, tmp_path):
    shutil.copytree(folder / "t", tmp_path / "t")
    text = (tmp_path / "t" / "table1.md").read_text()
    assert run(*SMALL, "-o", "t", "--nodes", "11", cwd=tmp_path).returncode == 0
    assert "--nodes 11" in Head.of_folder(tmp_path / "t").command
    with ScoreStore(tmp_path / "t" / "push-drive-scores.db") as store:
        assert [one.settings["nodes"] for one in store.runs()] == [10, 11]
    assert run(*SMALL, "-o", "t", cwd=tmp_path).returncode == 0
    assert (tmp_path / "t" / "table1.md").read_text() == text


def test_a_folder_with_other_trajectories_is_refused_and_so_are_bad_options(folder):
    def refused(*options):
        done = run(*SMALL, "-o", "t", *options, cwd=folder)
        assert done.returncode == 2 and "Traceback" not in done.stderr
        return done.stderr

    assert "push.h5 holds other trajectories" in refused("--seed", "1")
    assert "tasks has 'shove', expected some of push" in refused("--tasks", "push,shove")
    assert "tasks has 'push', expected some of push" in refused("--tasks", "push,push")
    assert "threads is 0" in refused("--threads", "0")
    for option in ("--nodes", "--trajectories", "--continuations"):
        assert f"{option[2:]} is 0" in refused(option, "0", "-o", "none")
    assert not (folder / "none").exists()


def test_ctrl_c_keeps_what_is_done_and_the_same_command_goes_on_to_the_same_bits(tmp_path):
    options = [*SMALL, "--continuations", "20"]
    assert run(*options, "-o", "whole", cwd=tmp_path).returncode == 0
    process = subprocess.Popen(
        [*COMMAND, *options, "-o", "part"], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    shares = 7  # of each state: six horizons, and the success
    await_scores(process, tmp_path / "part" / "push-ceiling.db", 2 * shares)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=30)
    assert process.returncode == 130 and "Traceback" not in stderr
    assert 2 * shares <= score_count(tmp_path / "part" / "push-ceiling.db") < 40 * shares
    assert score_count(tmp_path / "part" / "push-coast-scores.db") == 0

    assert "What is done is kept in part; the same command goes on from there." in stderr
    done = run(*options, "-o", "part", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    part, whole = ((tmp_path / name / "table1.csv").read_bytes() for name in ("part", "whole"))
    assert part == whole
    for name in ("push-ceiling.db", "push-coast-scores.db", "push-drive-scores.db"):
        with (
            ScoreStore(tmp_path / "part" / name) as one,
            ScoreStore(tmp_path / "whole" / name) as two,
        ):
            ours, theirs = (store.run().labelled_scores().scores for store in (one, two))
        assert all(np.array_equal(ours[metric], theirs[metric]) for metric in theirs)


def test_the_share_that_is_done_rises_to_1(tmp_path):
    seen = []
    settings = Settings(tasks=("push",), trajectories=2, nodes=2, continuations=1)
    STUDY.reproduce(settings, tmp_path, progress=lambda what, share: seen.append((what, share)))
    shares = [share for _, share in seen]
    assert shares == sorted(shares) and shares[0] == 0 and shares[-1] == 1
    assert {what.split(",")[0] for what, _ in seen} >= {"push: scores", "push: ceiling"}


def test_the_weights_of_the_force_score_are_the_ones_of_the_problems(folder):
    weights = datasets.generate("push", trajectories=1, frames=2).problems()[0].force_weights
    text = (folder / "t" / "table1.md").read_text()
    assert f"push engage {weights.engage:g}, stick {weights.stick:g}, distance" in text


def test_quick_is_smaller_than_the_whole_and_its_help_says_how_small(folder):
    words = " ".join(run("--help", cwd=folder).stdout.replace("│", " ").split())
    quick = STUDY.quick
    assert (
        f"A first picture: --trajectories {quick.trajectories} --nodes {quick.nodes} "
        f"--continuations {quick.continuations}." in words
    )


def test_the_papers_tasks_come_in_its_order():
    assert Settings().tasks == ("push", "balance", "topple", "grasp")
