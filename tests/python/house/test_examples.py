"""The examples print what stands beside them, in both languages; those in C++ are run by
tests/cpp/consumer."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "examples"
EXAMPLES = sorted(p for p in FOLDER.glob("*.py") if p.with_suffix(".txt").exists())
FETCH = FOLDER / "05_fetch_push.py"
APART = {"06_ros_node", "18_cluster"}  # test_ros_node.py, and below
PROBLEM = ROOT / "tests/golden/problem-grasp.json"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_prints_what_stands_beside_it(path):
    words = [PROBLEM] if "sys.argv" in path.read_text() else []
    done = subprocess.run(
        [sys.executable, path, *words], check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == path.with_suffix(".txt").read_text()


def test_each_example_is_run_and_named_on_a_page_and_in_the_list():
    names = {path.stem for path in FOLDER.glob("*.py")}
    run = {path.stem for path in EXAMPLES} | {FETCH.stem} | APART
    assert names == run
    listed = (FOLDER / "README.md").read_text()
    pages = "".join(page.read_text() for page in (ROOT / "docs").rglob("*.md"))
    for path in sorted(FOLDER.glob("[0-9]*.[pc][yp]*")):
        assert f"({path.name})" in listed
        assert f"examples/{path.stem}" in pages, path.name


def test_what_is_in_both_languages_is_run_in_both():
    ran = re.findall(r"\d\d_\w+", (ROOT / "tests/cpp/consumer/run.cmake").read_text())
    assert set(ran) == {path.stem for path in FOLDER.glob("*.cpp")}


def test_fetch_push_has_a_score_at_each_step_from_the_state_of_mujoco() -> None:
    done = subprocess.run([sys.executable, FETCH], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    pushes = re.split(r"pushed \d cm beside the middle\n", done.stdout)[1:]
    assert len(pushes) == 2
    for push in pushes:
        scores = [float(score) for score in re.findall(r"captured ([01]\.\d\d) \(", push)]
        assert len(scores) >= 4 and all(0 <= score <= 1 for score in scores)
    assert "pushed to the goal" in pushes[0]


@pytest.mark.parametrize(("package", "words"), [("dask_jobqueue", []), ("ray", ["ray"])])
def test_a_cluster_has_the_bits_of_one_machine(package, words):
    """Ray is in no extra: 80 MB. Where it is, it is tried."""
    pytest.importorskip(package)
    path = FOLDER / "18_cluster.py"
    done = subprocess.run(
        [sys.executable, path, *words], check=False, capture_output=True, text=True
    )
    assert done.stdout == "12 states, the same bits as on one machine\n", done.stderr
