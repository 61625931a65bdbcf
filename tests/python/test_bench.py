"""`make bench` on little trees: that it works, and compares the same rollouts; not how fast."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from measurements import cost_of, problems_of

SCRIPT = Path(__file__).parents[2] / "python" / "bench" / "speed.py"


def run(*arguments):
    return subprocess.run(
        [sys.executable, SCRIPT, *arguments],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
    )


@pytest.mark.parametrize("task", ["push", "balance", "topple", "grasp"])
def test_bullet_and_pybullet_make_the_same_rollouts(task):
    cost = cost_of(problems_of(task, 6)[2], nodes=(10, 30), rounds=1)
    for pairs in (*cost.floor.values(), cost.pybullet):
        assert pairs.others_steps == pairs.steps > 0
        assert pairs.moved > 1e-3
    assert cost.floor[30].apart < 0.1 * cost.floor[30].moved
    if task != "grasp":  # where PyBullet controls the joints its own way
        assert cost.pybullet.apart < 0.1 * cost.pybullet.moved


def test_each_table_has_its_rows_with_positive_numbers(tmp_path):
    done = run("--quick", "--states", "1", "--tasks", "push", "--out", tmp_path / "speed.md")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "speed.md").read_text() in done.stdout
    rows = [
        [cell.strip().removeprefix("x ") for cell in line.strip("|").split("|")[1:]]
        for line in done.stdout.splitlines()
        if line.startswith("|")
    ]
    numbers = [[float(cell) for cell in row] for row in rows if is_number(row[0])]
    assert [len(row) for row in numbers] == [9, 3, *[3] * 3, *[2] * 2]
    assert np.isfinite(np.concatenate(numbers)).all()
    assert (np.concatenate(numbers) > 0.0).all()


def is_number(cell):
    return cell.replace(".", "", 1).isdigit()


def test_an_unknown_task_is_named():
    done = run("--tasks", "push,juggle")
    assert done.returncode != 0
    assert "'juggle'" in done.stderr
