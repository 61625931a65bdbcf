"""Problem files: Python and the executable agree on them, to the last bit."""

import base64
import copy
import itertools
import json
import pickle
import warnings
from pathlib import Path

import numpy as np
import pytest
from problem_files import brick, full_problem, planned_problem, run

import energymargin as em


@pytest.fixture(scope="module")
def problem():
    return full_problem()


OLDER = Path(__file__).parents[2] / "older_problem_files"
SEED, SEARCH = ("--seed", 7), ("--seed", 7, "--nodes", 240)


def scored(*arguments):
    outcome = run(*arguments)
    assert outcome.returncode == 0, outcome.stderr
    return json.loads(outcome.stdout)


def fields(score, names):
    return {name: getattr(score, name) for name in names}


CAPTURE = [
    f"{name}{more}"
    for name in ("capture", "success", "capture_any", "success_any")
    for more in ("", "_stderr")
] + ["complete", "nodes", "resolution", "undisturbed_exit", "steps", "unconverged", "lost_time"]


@pytest.mark.parametrize("meshes", ["embedded", "files"])
def test_the_executable_has_pythons_numbers_of_each_metric_to_the_last_bit(
    problem, meshes, tmp_path
):
    file = tmp_path / "problem.json"
    problem.save(file, meshes=meshes)
    capture = em.capture_score(problem, nodes=240, seed=7, trees=2)
    printed = scored(file, *SEARCH, "--trees", 2)
    for name in ("capture", "success", "capture_any", "success_any"):
        interval = printed.pop(f"{name}_interval")
        if getattr(capture, name) is None:
            assert interval is None
        else:
            assert tuple(interval) == capture.interval(which=name)
    assert printed.pop("trees") == len(capture.trees)
    assert printed.pop("warnings") == list(capture.warnings)
    assert printed == fields(capture, CAPTURE)
    for planner, captured in itertools.product(("est", "rrt"), ("all", "any")):
        asked = {"planner": planner, "captured": captured, "search": "improved"}
        effort = em.escape_effort(problem, nodes=240, seed=7, **asked)
        words = [word for name, value in asked.items() for word in (f"--{name}", value)]
        printed = scored(file, *SEARCH, "--metric", "effort", *words)
        assert printed["effort"] == (effort.effort if np.isfinite(effort.effort) else None)
        assert [(at["nodes"], at["effort"]) for at in printed["history"]] == effort.history
    assert scored(file, "--metric", "force")["force"] == em.force_score(problem).force


def test_the_executable_has_pythons_escape_energy_to_the_last_bit(tmp_path):
    scene = em.Scene()
    scene.add_plane("table")
    scene.add_body(
        "cup",
        em.Compound([brick((0.06, 0.06, 0.04))]),
        mass=0.2,
        position=(0, 0, 0.021),
        role="object",
    )
    low = em.regions.HalfSpace("cup", normal=(0, 0, 1), offset=0.1)
    made = em.Problem(
        scene, scene.pack(), force=(1, 1, 1), torque=(0, 0, 0), duration=0.1, captured=low
    )
    made.save(tmp_path / "p.json", meshes="files")
    energy = em.escape_energy(made, samples=200, seed=7).energy
    assert np.isfinite(energy)
    printed = scored(tmp_path / "p.json", "--metric", "escape_energy", "--samples", 200, *SEED)
    assert printed["energy"] == energy


def test_the_effort_that_is_compared_is_one(problem):
    assert np.isfinite(
        em.escape_effort(problem, nodes=240, seed=7, captured="any", search="improved").effort
    )


def bits(rows):
    return np.asarray(rows).tobytes()


def assert_same_plan(one, two):
    assert (one.step, one.rows, one.limits) == (two.step, two.rows, two.limits)
    for part in ("wrenches", "targets", "velocities"):
        of_one, of_two = getattr(one, part), getattr(two, part)
        assert {name: bits(rows) for name, rows in of_one.items()} == {
            name: bits(rows) for name, rows in of_two.items()
        }


@pytest.mark.parametrize(
    "copied",
    [
        lambda problem: em.Problem.from_json(problem.to_json()),
        lambda problem: pickle.loads(pickle.dumps(problem)),
        copy.deepcopy,
    ],
    ids=["json", "pickle", "copy"],
)
def test_horizon_and_plan_are_kept_to_the_last_bit(copied):
    problem = planned_problem()
    read = copied(problem)
    assert read.to_json() == problem.to_json()
    assert (read.horizon, read.check, read.dwell) == (problem.horizon, problem.check, problem.dwell)
    assert_same_plan(read.plan, problem.plan)
    end, again = (
        em.World(at.scene, at.plan).rollout(at.state, np.zeros((2, 6)), at.horizon).state
        for at in (problem, read)
    )
    assert bits(end) == bits(again)


def test_a_plan_alone_keeps_its_bits_and_its_order():
    scene = em.Scene()
    for x, name in enumerate(("right", "left")):
        scene.add_body(name, em.Sphere(0.1), mass=1, position=(x, 0, 0), role="effector")
    state = scene.pack(left={"velocity": (0.1, 0, 1 / 3), "angular_velocity": (0, 0.7, 0)})
    plan = em.Plan.hold(scene, state, 0.1)
    for read in (em.Plan.from_json(plan.to_json()), pickle.loads(pickle.dumps(plan))):
        assert_same_plan(read, plan)
        assert list(read.velocities) == ["right", "left"]
    with pytest.raises(ValueError, match="it is empty, expected the JSON of a plan"):
        em.Plan.from_json("")
    with pytest.raises(ValueError, match=r"plan is empty, expected at least one row"):
        em.Plan.from_json('{"step": 1}')
    with pytest.raises(ValueError, match=r"plan\.velocities\[0\] has no \"rows\", expected one"):
        em.Plan.from_json('{"step": 1, "velocities": [{"body": "left"}]}')


def test_rows_of_a_plan_are_base64_that_any_program_can_read():
    problem = planned_problem()
    motor = json.loads(problem.to_json())["plan"]["velocities"][0]
    read = np.frombuffer(base64.b64decode(motor["rows"], validate=True), "<f8").reshape(-1, 6)
    assert bits(read) == bits(problem.plan.velocities[motor["body"]])


def test_rows_of_a_plan_may_be_written_as_lists():
    problem = planned_problem()
    text = json.loads(problem.to_json())
    for part in ("wrenches", "targets", "velocities"):
        for entry in text["plan"][part]:
            rows = getattr(problem.plan, part)[entry.get("body") or entry["joint"]]
            entry["rows"] = rows.tolist()
    assert em.Problem.from_json(json.dumps(text)).to_json() == problem.to_json()


def version(problem):
    return json.loads(problem.to_json())["version"]


def older_file(version):
    """A file that version 0.13 wrote."""
    return OLDER / f"version-{version}.json"


def test_every_problem_is_written_as_version_6(problem):
    trajectory = em.tasks.make("push").rollout(0)
    pushed = em.tasks.make("push").problem(trajectory.states[0], trajectory.params)
    assert version(pushed) == version(problem) == version(planned_problem()) == 6


@pytest.mark.parametrize("older", [3, 4])
def test_an_older_file_with_one_friction_direction_warns_that_scores_may_differ(older, tmp_path):
    # A scene warns once, so each has a name of its own.
    text = older_file(older).read_text().replace('"table"', f'"table {older}"')
    file = tmp_path / "older.json"
    file.write_text(text)
    with pytest.warns(em.PlausibilityWarning, match="every direction of the .* scores may differ"):
        read = em.Problem.load(file)
    assert version(read) == 6
    assert "friction_directions" not in json.loads(read.to_json())["scene"]


def test_an_older_file_with_two_friction_directions_is_read_without_a_word():
    assert json.loads(older_file(5).read_text())["scene"]["friction_directions"] == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read = em.Problem.load(older_file(5))
    usual = em.Scene()
    assert read.scene.solver_iterations == usual.solver_iterations
    assert read.scene.solver_tolerance == usual.solver_tolerance


def test_the_executable_warns_in_one_line_of_an_older_file_with_one_friction_direction():
    outcome = run(older_file(3), "--metric", "force")
    assert outcome.returncode == 0
    (line,) = outcome.stderr.splitlines()
    assert line.startswith('warning: the file has "friction_directions": 1')
    assert run(older_file(5), "--metric", "force").stderr == ""


def test_a_file_of_version_6_with_friction_directions_is_refused(problem):
    fields = json.loads(problem.to_json())
    fields["scene"]["friction_directions"] = 2
    with pytest.raises(ValueError, match='scene has an unknown "friction_directions"'):
        em.Problem.from_json(json.dumps(fields))


def test_files_and_pickles_keep_the_friction_rule_and_the_friction_of_pairs(problem, tmp_path):
    problem.save(tmp_path / "p.json")
    copies = (
        em.Problem.load(tmp_path / "p.json"),
        pickle.loads(pickle.dumps(problem)),
        problem.replace(rate=2.0),
    )
    for scene in (kept.scene for kept in copies):
        assert scene.friction_rule == "max"
        assert scene.pair_frictions == {("table", "weight"): 1 / 3, ("cup", "dice"): 0.0}
        assert scene.contact_friction("weight", "table") == 1 / 3
        assert scene.contact_friction("cup", "table") == 0.6


def test_without_its_clock_a_problem_is_the_file_that_it_was(problem):
    assert planned_problem().replace(horizon=None, plan=None, check=None, dwell=0).to_json() == (
        problem.to_json()
    )


def test_the_executable_has_pythons_effort_of_a_horizon_and_a_plan_to_the_last_bit(tmp_path):
    problem = planned_problem()
    problem.save(tmp_path / "p.json")
    for planner, captured in itertools.product(("est", "rrt"), ("all", "any")):
        effort = em.escape_effort(problem, planner=planner, nodes=240, seed=7, captured=captured)
        printed = scored(
            *(tmp_path / "p.json", "--metric", "effort"),
            *("--planner", planner, "--captured", captured, *SEARCH),
        )
        assert printed["effort"] == (effort.effort if np.isfinite(effort.effort) else None)
        assert [(at["nodes"], at["effort"]) for at in printed["history"]] == effort.history
        assert (printed["nodes"], printed["discarded"]) == (effort.nodes, effort.discarded)
        for name in ("steps", "unconverged", "lost_time"):
            assert printed[name] == getattr(effort, name)
        assert printed["warnings"] == list(effort.warnings)
    assert (printed["horizon"], printed["dwell"]) == (problem.horizon, problem.dwell)
    assert printed["check"] == problem.check
    assert printed["plan"] == {
        "step": problem.plan.step,
        "rows": problem.plan.rows,
        "wrenches": list(problem.plan.wrenches),
        "targets": list(problem.plan.targets),
        "velocities": list(problem.plan.velocities),
    }


def test_the_executable_has_pythons_probability_to_the_last_bit(tmp_path):
    problem = planned_problem()
    problem.save(tmp_path / "p.json")
    p = em.capture_probability(problem, rollouts=12, seed=7, success=True)
    outcome = run(tmp_path / "p.json", "--metric", "probability", "--rollouts", 12, "--seed", 7)
    printed = json.loads(outcome.stdout)
    for name in ("captured", "success", "mean_time", "undisturbed", "undisturbed_time"):
        assert printed[name] == getattr(p, name)
    assert tuple(printed["interval"]) == p.interval()
    assert printed["times"] == p.times.tolist()
    assert printed["curve"] == p.curve.tolist()
    assert (printed["rollouts"], printed["steps"], printed["diverged"], printed["complete"]) == (
        p.rollouts,
        p.steps,
        p.diverged,
        p.complete,
    )
    assert (printed["unconverged"], printed["lost_time"]) == (p.unconverged, p.lost_time)
    assert printed["warnings"] == list(p.warnings)


@pytest.mark.parametrize("clock", [False, True], ids=["", "clock"])
@pytest.mark.parametrize("meshes", ["embedded", "files"])
def test_the_executable_writes_the_same_bytes_as_python(problem, meshes, clock, tmp_path):
    for folder in ("python", "executable"):
        (tmp_path / folder).mkdir()
    problem = planned_problem() if clock else problem
    problem.save(tmp_path / "python" / "p.json", meshes=meshes)
    other = "files" if meshes == "embedded" else "embedded"
    problem.save(tmp_path / "from.json", meshes=other)
    assert (
        run(
            tmp_path / "from.json", "--save", tmp_path / "executable" / "p.json", "--meshes", meshes
        ).returncode
        == 0
    )
    written = sorted(path.name for path in (tmp_path / "python").iterdir())
    assert written == (["p.json"] if meshes == "embedded" else ["p-cup.obj", "p.json"])
    assert written == sorted(path.name for path in (tmp_path / "executable").iterdir())
    for name in written:
        own = (tmp_path / "python" / name).read_bytes()
        assert own == (tmp_path / "executable" / name).read_bytes()


def test_a_problem_is_the_same_after_a_file_with_or_without_meshes(problem, tmp_path):
    for meshes in ("embedded", "files"):
        problem.save(tmp_path / f"{meshes}.json", meshes=meshes)
        assert em.Problem.load(tmp_path / f"{meshes}.json").to_json() == problem.to_json()
    assert '"type": "mesh"' in (tmp_path / "files.json").read_text()
    text = (tmp_path / "files.json").read_text()
    assert em.Problem.from_json(text, folder=tmp_path).to_json() == problem.to_json()
    with pytest.raises(ValueError, match="an absolute path, or the folder that it is relative to"):
        em.Problem.from_json(text)
    with pytest.raises(ValueError, match="meshes is 'apart', expected 'embedded' or 'files'"):
        problem.save(tmp_path / "p.json", meshes="apart")
