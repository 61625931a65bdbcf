"""The examples print what stands beside them; those in C++ are run by tests/cpp/consumer."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
EXAMPLES = sorted(p for p in (ROOT / "examples").glob("*.py") if p.with_suffix(".cpp").exists())
FETCH = ROOT / "examples/05_fetch_push.py"
PROBLEM = ROOT / "tests/golden/problem-grasp.json"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_prints_what_the_one_in_the_other_language_does(path):
    words = [] if path.stem == "03_own_scene" else [PROBLEM]
    done = subprocess.run(
        [sys.executable, path, *words], check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == path.with_suffix(".txt").read_text()


def test_there_are_three() -> None:
    assert len(EXAMPLES) == 3


def test_fetch_push_has_a_score_at_each_step_from_the_state_of_mujoco() -> None:
    done = subprocess.run([sys.executable, FETCH], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    pushes = re.split(r"pushed \d cm beside the middle\n", done.stdout)[1:]
    assert len(pushes) == 2
    for push in pushes:
        scores = [float(score) for score in re.findall(r"captured ([01]\.\d\d) \(", push)]
        assert len(scores) >= 4 and all(0 <= score <= 1 for score in scores)
    assert "pushed to the goal" in pushes[0]
