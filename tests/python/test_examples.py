"""The examples print what stands beside them; those in C++ are run by tests/cpp/consumer."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
PROBLEM = ROOT / "tests/golden/problem-grasp.json"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_prints_what_the_one_in_the_other_language_does(path):
    words = [] if path.stem == "03_own_scene" else [PROBLEM]
    done = subprocess.run(
        [sys.executable, path, *words], check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == path.with_suffix(".txt").read_text()
    assert path.with_suffix(".cpp").exists()


def test_there_are_three() -> None:
    assert len(EXAMPLES) == 3
