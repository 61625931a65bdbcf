"""One language: the same argument has one name, one default and one meaning in every function."""

import inspect
import sys
from pathlib import Path

import pytest

import energymargin as em

sys.path.insert(0, str(Path(__file__).parents[3] / "tools"))
signatures = pytest.importorskip("signatures")
# What pictures and reports ask of one problem, within a call of their own.
WITHIN = ("em.futures.", "em.searches.")
FUNCTIONS = {n: f for n, f in signatures.public() if not n.startswith(WITHIN)}
# Of one problem: the core runs them, on threads alone.
OF_ONE_PROBLEM = {
    f"em.{name}"
    for name in (
        *("capture_probability", "capture_score", "compare_engines", "escape_effort"),
        "longest_step",
    )
}
# What has no number of parts to count, and what is over in seconds.
NOT_COUNTED = {"em.effort_lower_bound", "em.escape_energy", "em.scenes.from_mjcf"}
SHORT = {"em.evaluation.evaluate", "em.grasps.baselines"}


def of(name):
    return inspect.signature(FUNCTIONS[name]).parameters


def those_with(argument):
    return [name for name in FUNCTIONS if argument in of(name)]


def test_the_page_is_of_these_functions():
    assert signatures.PAGE.read_text() == signatures.page(), "python tools/signatures.py"


@pytest.mark.parametrize(
    ("argument", "default"),
    [
        ("disturbance", None),
        ("uncertainty", None),
        ("store", None),
        ("executor", None),
        ("threads", None),
        ("progress", None),
        ("timeout", None),
        ("cancel", None),
        ("overwrite", False),
        ("seed", 0),
        ("confidence", 0.95),
    ],
)
def test_an_argument_has_one_default(argument, default):
    found = {name: of(name)[argument].default for name in those_with(argument)}
    assert found and all(value in (default, inspect.Parameter.empty) for value in found.values()), (
        found
    )


def test_what_takes_long_can_be_watched_limited_and_stopped():
    for name in FUNCTIONS:
        there = {"progress", "timeout", "cancel"} & set(of(name))
        whole = {"timeout", "cancel"} if name in NOT_COUNTED else {"progress", "timeout", "cancel"}
        whole = {"progress"} if name in SHORT else whole
        assert there in (set(), whole), f"{name} has {sorted(there)}"


def test_what_runs_on_threads_runs_on_an_executor():
    alone = {name for name in those_with("threads") if "executor" not in of(name)}
    assert alone <= OF_ONE_PROBLEM


def test_no_argument_is_a_file_that_goes_on_but_store():
    assert not [name for name in those_with("file") if name in ("em.improve", "em.rank")]


@pytest.mark.parametrize(
    ("result", "name"),
    [
        (em.CaptureProbability, "captured"),
        (em.CaptureScore, "capture"),
        (em.EscapeEffort, "effort"),
        (em.EscapeEnergy, "energy"),
        (em.LowerBound, "effort"),
        (em.ForceScore, "force"),
    ],
)
def test_a_result_has_a_value_and_its_name(result, name):
    assert hasattr(result, "value") and hasattr(result, name)
    assert f"`{name}`" in result.value.__doc__
