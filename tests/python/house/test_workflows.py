"""The workflows of .github make what docs/engineering/releasing.md says, and publish it once."""

import re
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[3]
WORKFLOWS = {path.stem: yaml.safe_load(path.read_text()) for path in ROOT.glob(".github/*/*.yml")}
RELEASING = (ROOT / "docs/engineering/releasing.md").read_text()


def commands(workflow):
    return [
        step["run"] for job in workflow["jobs"].values() for step in job["steps"] if "run" in step
    ]


def test_wheels_are_made_on_each_machine_that_the_page_names():
    machines = WORKFLOWS["wheels"]["jobs"]["wheels"]["strategy"]["matrix"]["machine"]
    assert len(machines) == 3 and all(f"`{machine}`" in RELEASING for machine in machines)


def test_only_a_tag_publishes_and_only_with_all_files():
    jobs = WORKFLOWS["wheels"]["jobs"]
    publish = jobs["publish"]
    assert "refs/tags/v" in publish["if"] and set(publish["needs"]) == {*jobs} - {"publish"}
    assert "environment `pypi`" in RELEASING and publish["environment"]["name"] == "pypi"


@pytest.mark.parametrize("name", sorted(WORKFLOWS))
def test_nothing_but_publishing_may_write(name):
    workflow = WORKFLOWS[name]
    assert workflow["permissions"] == {}
    for job_name, job in workflow["jobs"].items():
        writes = {what for what, how in job["permissions"].items() if how == "write"}
        assert writes == ({"id-token"} if job_name == "publish" else set())


def test_the_targets_that_tests_run_are_those_of_the_makefile():
    targets = re.findall(r"(?m)^([\w-]+):", (ROOT / "Makefile").read_text())
    (made,) = (text for text in commands(WORKFLOWS["tests"]) if text.startswith("make "))
    assert set(made.split()[1:]) <= set(targets)


def test_cibuildwheel_has_a_version():
    assert any(re.search(r"cibuildwheel==\d", text) for text in commands(WORKFLOWS["wheels"]))
