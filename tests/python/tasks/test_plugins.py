"""Tasks that other packages bring: a whole one, installed and used as its author would, and broken
ones."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from energymargin import datasets, tasks
from energymargin.tasks.base import parameters_of, plane_of
from energymargin.tasks.registry import overview

EXAMPLE = Path(__file__).parents[2] / "example_package"
COMMAND = str(Path(sys.executable).with_name("energymargin"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the example package installed in it."""
    folder = tmp_path_factory.mktemp("plugin")
    options = ["--quiet", "--no-deps", "--no-build-isolation", "--disable-pip-version-check"]
    pip = [sys.executable, "-m", "pip", "install", *options]
    subprocess.run([*pip, "--target", folder / "site", EXAMPLE], check=True, timeout=600)
    return folder


def finished(folder, *arguments):
    return subprocess.run(
        [COMMAND, *map(str, arguments)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder / "site")},
        check=False,
        capture_output=True,
        text=True,
        timeout=600,
    )


def run(folder, *arguments):
    done = finished(folder, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_an_installed_task_is_listed_with_the_package_that_it_is_from(folder):
    shown = run(folder, "tasks")
    assert "shelf" in shown and "push" in shown
    assert "tilt=0.3" in shown and "from energymargin-shelf" in shown


def test_an_installed_task_is_generated_scored_and_evaluated_like_our_own(folder):
    options = ["--trajectories", 16, "--frames", 5, "-p", "tilt=0.4", "-p", "pull=2"]
    run(folder, "generate", "shelf", *options)
    dataset = datasets.load(folder / "shelf.h5")
    assert (dataset.task, dataset.parameters) == ("shelf", {"tilt": 0.4, "pull": 2.0})
    assert {trajectory.success for trajectory in dataset.trajectories} == {True, False}

    run(folder, "score", "shelf.h5", "--paper", "--nodes", 10)
    files = ["-o", "t.md", "-o", "t.csv"]
    shown = run(folder, "evaluate", "shelf-scores.db", *files)
    for text in (shown, (folder / "t.md").read_text(), (folder / "t.csv").read_text()):
        assert "effort/rrt" in text and "success" in text
        assert "paper" not in text


def test_an_installed_task_without_a_plan_is_asked_about_the_future_with_hold_or_none(folder):
    run(folder, "generate", "shelf", "--trajectories", 2, "--frames", 4, "-o", "few.h5")
    asked = ["score", "few.h5", "--frames", 1, "--metrics", "probability", "--rollouts", 2]
    for plan in ("hold", "none"):
        run(folder, *asked, "--plan", plan)
    shown = run(folder, "export", "few-scores.db")
    assert "horizon 1 frame, plan hold" in shown and "horizon 1 frame, plan none" in shown
    told = finished(folder, *asked).stderr
    assert (
        "no script says what the robot is about to do: it goes on as it moves, --plan hold" in told
    )
    done = finished(folder, *asked, "--plan", "script")
    assert done.returncode == 2
    assert "give ShelfTask a method `script(params)`" in done.stderr
    assert "its plan can be 'hold' or none" in done.stderr


def plugin(folder, package, entry, code="", module="strange"):
    """A package, as pip leaves it, with one entry point and one module."""
    about = folder / f"{package}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[energymargin.tasks]\n{entry}\n")
    (folder / f"{module}.py").write_text(code)


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder that packages can be put into."""
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    sys.modules.pop("strange", None)


WHOLE = "def rollout(self, seed, frames=10): ...\n    def problem(self, state): ...\n"


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import nothing_of_that_name", "cannot be loaded: ModuleNotFoundError: No module named"),
        ("1 / 0", "cannot be loaded: ZeroDivisionError"),
        ("", "cannot be loaded: AttributeError: .*'Odd'"),
        ("Odd = 'odd'", "is a str, expected a class"),
        ("class Odd:\n    name = 'odd'", "has no method 'rollout'"),
        ("class Odd:\n    name = 'odd'\n    def rollout(self): ...", "has no method 'problem'"),
        (f"class Odd:\n    name = 'even'\n    {WHOLE}", "has the name 'even', expected 'odd'"),
        (f"class Odd:\n    {WHOLE}", "has the name None, expected 'odd'"),
        (
            "from energymargin.tasks import ScriptedTask\nclass Odd(ScriptedTask): ...",
            "abstract class Odd .*scene",
        ),
    ],
)
def test_a_broken_task_is_refused_with_its_package_and_breaks_no_other(site, code, message):
    plugin(site, "odd-tasks", "odd = strange:Odd", code)
    whose = r"task 'odd' of odd-tasks \(entry point strange:Odd\)"
    with pytest.raises(tasks.TaskError, match=rf"{whose}.*{message}"):
        tasks.make("odd")
    assert tasks.make("push").name == "push"
    entries = {entry.name: entry for entry in overview()}
    assert entries["odd"].broken and "odd-tasks" in entries["odd"].note
    assert not entries["push"].broken and entries["push"].note == ""


def test_the_list_of_tasks_shows_a_broken_one_with_its_error_and_all_others(tmp_path):
    (tmp_path / "site").mkdir()
    plugin(tmp_path / "site", "odd-tasks", "odd = strange:Odd", "import nothing_of_that_name")
    shown = " ".join(run(tmp_path, "tasks").split())
    assert "push" in shown and "topple" in shown
    assert "odd-tasks" in shown and "nothing_of_that_name" in shown.replace(" ", "")


def test_a_task_that_fails_when_it_is_made_is_listed_with_what_it_says(site):
    code = f"class Odd:\n    def __init__(self): raise OSError('no camera')\n    {WHOLE}"
    plugin(site, "odd-tasks", "odd = strange:Odd", code)
    entries = {entry.name: entry for entry in overview()}
    assert entries["odd"].broken and entries["odd"].note == "OSError: no camera"


def test_a_name_that_two_packages_register_is_refused_with_both_and_breaks_no_other(site):
    plugin(site, "odd-tasks", "push = strange:Odd")
    with pytest.raises(
        tasks.TaskError,
        match=r"'push' is registered by energymargin \(.*:PushTask\) and odd-tasks \(strange:Odd\)",
    ):
        tasks.make("push")
    assert tasks.make("topple").name == "topple"


@dataclass
class Told:
    """A task that is no more than it has to be."""

    weight: float = 2.0
    name = "told"

    def rollout(self, seed, frames=10):
        return tasks.make("push").rollout(seed, frames)

    def problem(self, state, params=None, contacts=None):
        return tasks.make("push").problem(state, params, contacts)


def test_a_task_needs_no_more_than_a_name_rollouts_and_problems():
    task = Told(weight=3.0)
    assert parameters_of(task) == {"weight": 3.0} and plane_of(task) == ("x", "y")
    dataset = datasets.generate(task, trajectories=1, frames=2)
    assert (dataset.task, dataset.parameters) == ("told", {"weight": 3.0})


def test_a_parameter_that_a_task_does_not_tell_is_refused_with_the_way_out():
    class Silent(Told):
        def __init__(self, color):
            pass

    with pytest.raises(ValueError, match=r"Silent .*parameter 'color': set one of that name"):
        datasets.generate(Silent("red"), trajectories=1, frames=2)
