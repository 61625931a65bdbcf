"""What notebooks show: tables that are HTML, say what is infinite, and never raise."""

import base64
import io
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import reacting
from futures import carried, resting, two_balls
from rich.console import Console

from energymargin import (
    Box,
    Cancel,
    Contact,
    Plan,
    Problem,
    Scene,
    capture_probability,
    capture_score,
    datasets,
    disturbances,
    escape_effort,
    escape_energy,
    evaluation,
    force_score,
    regions,
    score,
    tasks,
)
from energymargin.evaluate.scoring import ScoreTable
from energymargin.evaluate.searches import SearchSettings
from energymargin.evaluation import LabelledScores
from energymargin.store import ScoreStore, score_dataset
from energymargin.summary import summary

VOID = {"br", "img"}


class Cells(HTMLParser):
    """The texts of a table's rows; fails on tags that are not closed in order."""

    def __init__(self, html):
        super().__init__()
        self.rows, self.open, self.text = [], [], ""
        self.feed(html)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


def shown(thing):
    return Cells(thing._repr_html_())


def values(thing):
    """Of a table of names and values."""
    return dict(shown(thing).rows)


@pytest.fixture(scope="module")
def task():
    return tasks.make("push", friction=0.3)


@pytest.fixture(scope="module")
def trajectory(task):
    return task.rollout(seed=0, frames=4)


@pytest.fixture(scope="module")
def problem(task, trajectory):
    return task.problem(trajectory.states[0])


@pytest.fixture(scope="module")
def labelled():
    return LabelledScores(
        task="push",
        trajectory=np.array([0, 0, 1, 1]),
        captured=np.array([True, False, True, True]),
        success=np.array([False, False, True, True]),
        scores={"capture": np.array([0.5, 0.25, np.nan, 1.0]), "effort/est": np.full(4, np.inf)},
    )


def test_a_capture_score_shows_its_numbers_and_their_errors(problem):
    several = capture_score(problem, nodes=20, trees=3)
    table = values(several)
    assert table["capture"] == (
        f"{several.capture:.3f} ± {several.capture_stderr:.3f} (standard error)"
    )
    assert table["trees"] == "3 of 20 nodes"
    one = capture_score(problem, nodes=20)
    assert values(one)["success"] == f"{one.success:.3f}"


def test_an_effort_is_shown_in_joules_and_an_infinite_one_in_words(problem):
    found = escape_effort(problem, nodes=200)
    assert values(found)["effort"] == f"{found.effort:.4g} J"
    assert values(found)["path"] == f"{len(found.path) - 1} edges"
    assert values(escape_effort(problem, nodes=1))["effort"] == "infinite: no way out was found"


def test_a_search_that_was_stopped_says_that_it_is_not_complete(problem):
    assert (
        "Not complete"
        in shown(escape_effort(problem, nodes=10**6, timeout=0.05, search="published")).text
    )
    assert "Not complete" not in shown(escape_effort(problem, nodes=5)).text


def test_a_search_that_was_stopped_before_it_began_shows_no_number(problem):
    cancel = Cancel()
    cancel.set()
    for stopped in (
        capture_score(problem, nodes=20, trees=2, cancel=cancel),
        escape_effort(problem, nodes=20, cancel=cancel),
        escape_energy(problem, cancel=cancel),
    ):
        assert "stopped before anything was searched" in shown(stopped).text
        assert shown(stopped).rows == []


def at_the_edge_of_its_cone(contact):  # but for what could be rounding
    length = np.linalg.norm(contact.tangential_force)
    edge = (1.0 - 1e-14) * contact.friction * contact.normal_force
    stretch = edge / length if length else 1.0
    return Contact(
        body_a=contact.body_a,
        body_b=contact.body_b,
        position=contact.position,
        normal=contact.normal,
        distance=contact.distance,
        normal_force=contact.normal_force,
        tangential_force=contact.tangential_force * stretch,
        friction=contact.friction,
    )


def test_forces_that_cancel_out_are_shown_as_zero():
    task = tasks.make("push")
    rollout = task.rollout(seed=1)
    sliding = [at_the_edge_of_its_cone(contact) for contact in rollout.contacts[3]]
    score = force_score(task.problem(rollout.states[3], rollout.params, sliding))
    assert 0 < abs(score.ground.stick) < 1e-12
    table = values(score)
    assert table["all else: to the friction cones' edges"] == "0 N"
    assert table["all else: normal forces"] == f"{score.ground.engage:.4g} N"


def test_a_file_of_scores_shows_its_runs_and_a_run_its_settings_and_counts(tmp_path):
    dataset = datasets.generate("push", trajectories=1, frames=3, seed=0)
    settings = "common_random_numbers = False, least_likelihood = 0, nodes = 2, "
    settings += "nodes_per_edge = 1, objects = None, rollouts = 30, "
    settings += "seed = {}, stop_at_escape = False, strength = 1"
    now = "the state as it is"
    with ScoreStore(tmp_path / "push.db", create=True) as empty:
        assert "There are no runs." in shown(empty).text
    for seed in (0, 1):
        score_dataset(
            dataset, tmp_path / "push.db", ["capture", "force"], settings=SearchSettings(2, seed)
        )
    with ScoreStore(tmp_path / "push.db") as store:
        store.database.execute("DELETE FROM scores WHERE question = 3 AND stream = 2")
        assert shown(store).rows[1:] == [
            ["1", "push", "3 of 3", "capture, force", now, settings.format(0)],
            ["2", "push", "2 of 3", "capture, force", now, settings.format(1)],
        ]
        table = values(store.run(2))
        assert table["states scored"] == "2 of 3" and table["settings"] == settings.format(1)
        assert table["parameters"] == "friction drawn at random, effector = drive, follow = True"
    assert "cannot be shown" in store._repr_html_()


def test_one_summary_is_rendered_for_a_terminal_a_notebook_and_in_markdown(problem):
    made = summary(escape_effort(problem, nodes=200))
    console = Console(file=io.StringIO(), width=80)
    console.print(made)
    for text in (console.file.getvalue(), made.to_markdown(), Cells(made.to_html()).text):
        assert "Effort of escape" in text
        assert all(str(part) in text for row in made.rows for part in row)
    with pytest.raises(ValueError, match="result is a int, which has no summary"):
        summary(3)


def test_every_kind_of_result_is_shown_as_a_table(problem, trajectory):
    for thing, title in (
        (escape_energy(problem, samples=50), "Escape energy"),
        (force_score(problem), "Force score"),
        (capture_score(problem, nodes=5).tree, "Search tree"),
        (trajectory, "Trajectory"),
        (problem.scene, "Scene"),
        (datasets.generate("push", trajectories=2, frames=2, seed=0), "Dataset of push"),
    ):
        cells = shown(thing)
        assert cells.text.startswith(title)
        assert len(cells.rows) > 1


def test_a_table_of_scores_shows_its_first_rows_and_how_many_more_there_are(problem):
    table = score([problem] * 15, ["capture", "effort/est"], nodes=3)
    cells = shown(table)
    assert cells.rows[0] == ["problem", "capture", "effort/est [J]"]
    assert cells.rows[1][0] == "0"
    assert len(cells.rows) == 1 + 12
    console = Console(file=io.StringIO(), width=80)
    console.print(summary(table))
    for text in (cells.text, summary(table).to_markdown(), console.file.getvalue()):
        assert "and 3 more" in text
    infinite = np.isinf(table["effort/est"][:12])
    assert [row[2] == "no escape" for row in cells.rows[1:]] == infinite.tolist()


def test_labelled_scores_count_what_is_missing_and_what_is_infinite(labelled):
    cells = shown(labelled)
    assert cells.rows[1:] == [
        ["capture", "3", "1", "0", "0.25", "0.5", "1"],
        ["effort/est [J]", "4", "0", "4", "", "", ""],
    ]
    assert "Captured: 3 of 4 states; successful: 1 of 2 trajectories." in cells.text


def test_an_evaluation_shows_auc_and_ap_or_that_there_is_one_label(labelled):
    result = evaluation.evaluate(labelled, frames=[0, 1], draws=20)
    cells = shown(result)
    assert cells.rows[0] == ["score", "h = 0", "h = 1"]
    assert cells.rows[1][1].startswith(result.states["capture"][0].value())
    assert "States: captured over the next h frames;" in cells.text
    labelled_alike = LabelledScores(
        "push", labelled.trajectory, np.ones(4, bool), labelled.success, labelled.scores
    )
    assert shown(evaluation.evaluate(labelled_alike, draws=2)).rows[1][1] == "—"


def test_a_problem_shows_its_picture_beside_its_numbers(problem):
    html = problem._repr_html_()
    (image,) = re.findall(r'src="data:image/png;base64,([^"]+)"', html)
    assert base64.b64decode(image).startswith(b"\x89PNG")
    assert Cells(html).rows[1] == ["largest force", "(0.8, 0.8, 0) N"]


def test_without_matplotlib_a_problem_is_shown_as_a_table_alone():
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "import energymargin as em\n"
        "task = em.tasks.make('push', friction=0.3)\n"
        "html = task.problem(task.rollout(0, frames=2).states[0])._repr_html_()\n"
        "assert 'largest force' in html and '<img' not in html\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_importing_the_package_does_not_import_matplotlib():
    code = "import sys, energymargin; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_names_are_escaped():
    scene = Scene()
    scene.add_body("<script>", Box((1, 1, 1)), mass=1.0, role="object")
    wild = Problem(
        scene,
        scene.pack(),
        force=(1, 0, 0),
        torque=(0, 0, 0),
        duration=0.5,
        captured=regions.Ball("<script>", (0, 0, 0), 1.0),
    )
    for thing in (scene, wild):
        assert "<script>" not in thing._repr_html_()
        assert "<script>" in shown(thing).text


def test_a_set_that_fails_costs_the_picture_alone(problem):
    def broken(states):
        raise RuntimeError("no set")

    damaged = Problem(
        problem.scene,
        problem.state,
        force=(1, 0, 0),
        torque=(0, 0, 0),
        duration=0.5,
        captured=regions.Predicate(broken),
    )
    html = damaged._repr_html_()
    assert "largest force" in html
    assert "<img" not in html


def test_what_is_damaged_is_shown_as_text_and_never_raises(labelled, tmp_path):
    zeros = np.zeros(3, int)
    short = ScoreTable(
        np.arange(3), np.zeros(3), {"capture": np.zeros(1)}, zeros, zeros, zeros.astype(float)
    )
    odd = replace(labelled, scores=dict(labelled.scores))
    odd.scores["capture"] = 3  # of a dict that somebody changed
    path = tmp_path / "push.h5"
    datasets.generate("push", trajectories=1, frames=2, seed=0).save(path)
    with datasets.open(path) as closed:
        pass
    for thing in (short, odd, closed):
        html = thing._repr_html_()
        Cells(html)
        assert "cannot be shown" in html or "<table>" in html
    assert "cannot be shown" in short._repr_html_()


def test_a_probability_shows_its_interval_and_its_curve():
    found = capture_probability(resting(), rollouts=40, success=True)
    table = values(found)
    low, high = found.interval()
    assert table["captured for 0.4 s"] == (
        f"{found.captured:.3f} ({low:.3f} to {high:.3f} with 95 % confidence)"
    )
    assert table["mean time captured"] == f"{found.mean_time:.3g} s"
    assert table["undisturbed"] == "stays captured, succeeds"
    assert table["success at the end"].startswith(f"{found.success:.3f} (")
    assert table["rollouts"] == "40"
    assert '<img alt="its curve" src="data:image/png;base64,' in found._repr_html_()


def test_a_probability_of_several_objects_shows_each_of_them():
    found = capture_probability(two_balls(), rollouts=20, by_object=True)
    table = values(found)
    assert table["captured, at least one object"].startswith(f"{found.any.captured:.3f} (")
    for name, one in found.by_object.items():
        assert table[f"captured, {name}"] == f"{one.captured:.3f}"


def test_a_weighted_probability_shows_how_many_rollouts_it_is_worth():
    found = capture_probability(resting(), disturbance=disturbances.Boltzmann(20.0))
    assert found.effective < 29
    assert values(found)["rollouts"] == f"30, worth {found.effective:.3g} of equal weight"


def test_a_probability_says_when_the_object_leaves_by_itself():
    found = capture_probability(carried(), rollouts=3)
    assert values(found)["undisturbed"] == f"leaves at {found.undisturbed_time:.3g} s"


def test_a_problem_shows_its_horizon_and_its_plan(problem):
    table = values(carried(dwell=0.05))
    assert table["horizon"] == "0.6 s"
    assert table["between two looks"] == "about 1/60 s"
    assert table["an escape lasts"] == "at least 0.05 s"
    assert table["plan"] == "0.6 s"
    assert table["velocities"] == "of pusher"
    assert values(resting())["plan"] == "none: the effector coasts"
    assert "horizon" not in values(problem)


def test_a_plan_shows_what_it_does_with_each_body_and_joint():
    plan = Plan(
        1 / 240,
        wrenches={"hand": [(3.0, 4.0, 0, 0, 0, 0), (0, 0, 0, 0, 0, 2.0)]},
        velocities={"cart": [(0.1, 0, 0, 0, 0, 0)] * 2},
        targets={"still": [0.2, 0.2], "closing": [0.0, 0.5]},
    )
    assert values(plan) == {
        "duration": "0.008333 s",
        "rows": "2 of 0.00417 s",
        "wrenches": "of hand",
        "velocities": "of cart",
        "targets": "of closing, still",
    }


def test_a_probability_without_an_undisturbed_future_says_that_it_was_not_asked_for():
    found = capture_probability(carried(0.5), rollouts=3, undisturbed=False)
    assert values(found)["undisturbed"] == "was not asked for"


def test_robots_that_react_are_shown_as_the_plans_that_they_are():
    policy = reacting.policy(name="hold")
    assert ["policy hold", "every 0.05 s"] in shown(policy).rows
    assert ["feedback", "every 0.00417 s"] in shown(reacting.feedback()).rows
    assert "<b>Policy</b>" in policy._repr_html_()
