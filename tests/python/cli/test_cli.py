"""The commands as a user runs them: as processes."""

import os
import re
import signal
import subprocess
import sys
import time
from importlib import import_module

import numpy as np
import pytest
from command_line import COMMAND, invoke, run, run_here
from stores import await_scores, score_count

import energymargin
import energymargin as em
from energymargin import datasets
from energymargin.store import ScoreStore


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a dataset."""
    folder = tmp_path_factory.mktemp("cli")
    done = run("generate", "push", "--trajectories", 4, "--frames", 6, "-o", "push.h5", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def refused(done, *words):
    """One line on stderr, exit code 2, nothing else."""
    assert done.returncode == 2
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("error: "), done.stderr
    assert all(word in lines[0] for word in words), lines[0]
    assert "Traceback" not in done.stdout


def test_generate_score_and_evaluate_lead_to_the_table(folder):
    done = run("score", "push.h5", "-o", "steps.db", "--paper", "--nodes", 10, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "24 states are scored in steps.db" in done.stderr
    done = run("evaluate", "steps.db", "-o", "t.md", "-o", "t.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "capture" in done.stdout
    assert "| effort/rrt |" in (folder / "t.md").read_text()
    header, *lines = (folder / "t.csv").read_text().splitlines()
    cells = [line.split(",") for line in lines]
    assert {len(own) for own in cells} == {header.count(",") + 1}
    assert sum(own[1] == "all" for own in cells) == 4 * 6 + 1
    assert sum(own[1] == "captured" for own in cells) == 4 * 5
    shown = run_here("evaluate", "steps.db", "--among", "captured", "--clipped", cwd=folder)
    assert shown.returncode == 0 and "captured now" in shown.stdout


def test_evaluate_takes_horizons_draws_and_files_by_their_suffix(folder):
    few = ["--draws", 9, "--among", "all"]
    scored = run("score", "push.h5", "-o", "few.db", "--paper", "--nodes", 5, cwd=folder)
    assert scored.returncode == 0
    done = run("evaluate", "few.db", *few, "--frames", 1, "--frames", 3, "-o", "h.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    lines = (folder / "h.csv").read_text().splitlines()[1:]
    assert {line.split(",")[2] for line in lines} == {"1", "3", ""}
    refused(run("evaluate", "few.db", "-o", "h.txt", cwd=folder), "h.txt", ".csv or .md")
    refused(run("evaluate", "few.db", "--draws", 0, cwd=folder), "draws is 0")
    refused(run("evaluate", "few.db", "--frames", -1, cwd=folder), "frames is -1")


@pytest.mark.parametrize("place", [0, 2])
def test_an_error_shows_its_traceback_on_request(tmp_path, place):
    words = ["score", "none.h5"]
    words.insert(place, "--traceback")
    done = run(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert "Traceback (most recent call last)" in done.stderr and "files.py" in done.stderr
    assert done.stderr.strip().splitlines()[-1].startswith("error: none.h5")


def test_the_package_is_the_command(tmp_path):
    command = [sys.executable, "-m", "energymargin", "--version"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stdout == f"energymargin {energymargin.__version__}\n"


def test_several_objects_are_scored_and_compared_all_together_and_at_least_one(folder):
    small = ["--trajectories", 6, "--frames", 4]
    done = run("generate", "scoop", *small, "--picture", "scoop.png", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "scoop.png").stat().st_size > 10_000
    done = run_here("score", "scoop.h5", "--paper", "--nodes", 5, cwd=folder)
    assert done.returncode == 0, done.stderr
    shown = run_here("evaluate", "scoop-scores.db", "-o", "s.csv", cwd=folder).stdout
    assert "All objects" in shown and "At least one object" in shown
    rows = (folder / "s.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * (4 * 6 + 1) + 2 * 4 * 5
    assert {"effort/est/any", "force/any", "success/any"} < {row.split(",")[0] for row in rows}


def test_the_parameters_of_a_task_are_set_by_name(folder):
    done = run(
        "generate",
        "push",
        "-o",
        "p.h5",
        "--trajectories",
        1,
        "-p",
        "friction=0.3",
        "-p",
        "effector=coast",
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    assert datasets.load(folder / "p.h5").parameters == {
        "friction": 0.3,
        "effector": "coast",
        "follow": True,
    }


def test_tasks_and_help_show_what_there_is(folder):
    assert "push" in run_here("tasks", cwd=folder).stdout
    commands = ("tasks", "generate", "score", "evaluate", "demo", "reproduce")
    text = run("--help", cwd=folder).stdout
    assert all(command in text for command in commands)
    for words in (*([command] for command in commands), ["reproduce", "table1"]):
        done = run_here(*words, "--help", cwd=folder)
        assert done.returncode == 0 and done.stderr == ""
        assert f"Example: energymargin {' '.join(words)}" in done.stdout.replace("`", "")


def test_wrong_input_is_one_clear_line_and_exit_code_2(folder):
    (folder / "notes.txt").write_text("nothing that we know")
    cut = folder / "cut.h5"
    cut.write_bytes((folder / "push.h5").read_bytes())
    os.truncate(cut, cut.stat().st_size // 2)
    refused(run("generate", "shove", cwd=folder), "shove", "push")
    generate = ("generate", "push", "-o")
    refused(run_here(*generate, "x.h5", "-p", "friction=nan", cwd=folder), "friction")
    refused(run_here(*generate, "push.h5", cwd=folder), "push.h5 exists")
    refused(run_here("score", "notes.txt", cwd=folder), "notes.txt is not a dataset")
    refused(run_here("score", "cut.h5", cwd=folder), "cut.h5 is damaged or cut short")
    refused(run_here("score", "none.h5", cwd=folder), "none.h5", "No such file")
    refused(run_here("score", "push.h5", "-o", "w.db", "--nodes", 0, cwd=folder), "nodes", "0")
    refused(
        run_here("score", "push.h5", "-o", "w.db", "--metrics", "beauty", cwd=folder),
        "beauty",
        "capture",
    )
    refused(run_here("evaluate", "notes.txt", cwd=folder), "notes.txt is not a file of scores")
    whose = "push.h5 is not a file of scores", "`energymargin score push.h5`"
    refused(run_here("evaluate", "push.h5", cwd=folder), *whose)
    (folder / "rec.csv").write_text("time,cup_x,cup_y\n")
    refused(run_here("score", "rec.csv", cwd=folder), "energymargin import rec.csv --problem")
    refused(run_here("settle", "arm.xacro", cwd=folder), "xacro arm.xacro > robot.urdf")
    assert not (folder / "w.db").exists() and not (folder / "x.h5").exists()


def scored(path):
    """How many states have their five scores."""
    return score_count(path) // 5


def test_a_timeout_keeps_what_is_scored_and_the_same_command_goes_on(folder):
    command = ["score", "push.h5", "-o", "timed.db", "--paper", "--nodes", 100]
    done = run(*command, "--timeout", 0.001, cwd=folder)
    assert done.returncode == 124, done.stderr
    assert "the time was over: 0 of 24 states are scored and kept in timed.db" in done.stderr
    assert run(*command, "--timeout", 600, cwd=folder).returncode == 0
    assert scored(folder / "timed.db") == 24
    refused(run(*command, "--timeout", -1, cwd=folder), "timeout is -1.0, expected")


def test_generate_writes_the_trajectories_that_are_done_in_time(folder):
    generate = ["generate", "push", "--trajectories", 10**6, "-o", "timed.h5"]
    none = run(*generate, "--timeout", 1e-6, cwd=folder)
    assert none.returncode == 124
    assert "nothing is finished: the time was over before one" in none.stderr
    assert not (folder / "timed.h5").exists()
    done = run(*generate, "--timeout", 5, cwd=folder)
    assert done.returncode == 124, done.stderr
    assert "the time was over before there were 1000000 trajectories" in done.stderr
    assert 0 < len(datasets.load(folder / "timed.h5").trajectories) < 10**6


def test_ctrl_c_keeps_what_is_scored_and_the_same_command_goes_on_to_the_same_scores(folder):
    arguments = ["score", "push.h5", "--paper", "--nodes", "100"]
    assert run(*arguments, "-o", "whole.db", cwd=folder).returncode == 0

    process = subprocess.Popen(
        [COMMAND, *arguments, "-o", "part.db"], cwd=folder, stderr=subprocess.PIPE, text=True
    )
    await_scores(process, folder / "part.db", 2 * 5)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=30)
    latency = time.monotonic() - sent
    print(f"stopped after {latency:.3f} s")
    assert latency < 2.0  # 0.2 s is what it takes; a busy machine may need longer

    assert process.returncode == 130 and "Traceback" not in stderr
    kept = int(re.search(r"(\d+) of 24 states are scored and kept in part\.db", stderr)[1])
    assert kept == scored(folder / "part.db")
    assert 2 <= kept < 24

    assert run(*arguments, "-o", "part.db", cwd=folder).returncode == 0
    with ScoreStore(folder / "part.db") as part, ScoreStore(folder / "whole.db") as whole:
        again, undisturbed = (s.run().labelled_scores().scores for s in (part, whole))
    for metric, values in undisturbed.items():
        assert np.array_equal(again[metric], values)


def test_the_demo_runs_without_what_draws(folder, monkeypatch):
    monkeypatch.setattr(import_module("energymargin.cli.demo"), "find_spec", lambda _: None)
    few = ("--trajectories", 4, "--nodes", 5, "--trials", 2)
    done = run_here("demo", "-o", "bare", *few, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "pip install 'energymargin[plots]'" in done.stderr and "Next: " in done.stderr
    names = {path.name for path in (folder / "bare").iterdir()}
    assert names == {".energymargin", "push.h5", "push-scores.db", "table.md", "table.csv"}


def test_the_demo_leaves_its_files_and_a_second_run_computes_nothing_anew(folder):
    arguments = ["demo", "-o", "out", "--trajectories", 6, "--nodes", 10, "--trials", 2]
    done = run(*arguments, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "capture" in done.stdout and "5 cm below the head" in done.stdout
    assert "some 20 s on two cores" in " ".join(done.stderr.splitlines()[:2])
    assert "Next: `energymargin grasps FILE" in done.stderr
    names = {path.name for path in (folder / "out").iterdir()}
    assert names == {
        ".energymargin",
        "push.h5",
        "push-scores.db",
        "table.md",
        "table.csv",
        "qualitative.png",
        "scores.png",
        "grip.png",
        "grips.html",
        "grips.png",
    }
    kept = {
        name: (folder / "out" / name).stat().st_mtime_ns for name in ("push.h5", "push-scores.db")
    }
    assert run(*arguments, cwd=folder).stdout == done.stdout
    assert {name: (folder / "out" / name).stat().st_mtime_ns for name in kept} == kept
    other = run(*arguments[:-3], 11, "--trials", 2, cwd=folder)
    assert other.returncode == 0
    refused(
        run_here("evaluate", "out/push-scores.db", cwd=folder),
        "has 2 runs, choose one by its number",
        "run 2: push, 60 of 60 states",
    )
    assert (
        run_here("evaluate", "out/push-scores.db", "--run", 1, cwd=folder).stdout
        == done.stdout.split("\n6 grasps")[0]
    )


def test_ctrl_c_ends_a_command_while_a_library_loads_that_swallows_it(tmp_path):
    (tmp_path / "library.py").write_text(
        "import signal, time\n"
        "try:\n    signal.raise_signal(signal.SIGINT)\n    time.sleep(5)\n"
        "except BaseException:\n    pass\n"
    )
    script = "from energymargin.cli.terminal import loading\nwith loading():\n    import library\n"
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "stopped\n")


def test_the_version_is_that_of_the_package(tmp_path):
    done = run("--version", cwd=tmp_path)
    assert done.returncode == 0 and done.stdout == f"energymargin {energymargin.__version__}\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["scor", "push.h5"], ("scor", 'Did you mean "score"?')),
        (["score", "push.h5", "--node", 3], ("--node", "Did you mean --nodes?")),
        (["score", "push.h5", "--nodes", "many"], ("--nodes", "many", "score --help")),
        (["score"], ("DATA", "`energymargin score --help`")),
        (["evaluate", "s.db", "--among", "lost"], ("--among", "lost", "all", "captured")),
        (["evaluate", "s.db", "t.db"], ("t.db", "`energymargin evaluate --help`")),
    ],
)
def test_a_wrong_word_is_named_with_a_way_out(tmp_path, words, said):
    refused(run_here(*words, cwd=tmp_path), *said)


def test_an_option_that_its_file_does_not_have_is_refused(tmp_path):
    scene = em.Scene()
    scene.add_plane("floor")
    scene.add_body("box", em.Box((0.1,) * 3), mass=1.0, position=(0, 0, 0.05), role="object")
    near = em.regions.Ball("box", (0, 0, 0.05), 0.02)
    asked = {"force": (1, 1, 0), "torque": (0, 0, 0), "duration": 0.1, "horizon": 0.5}
    file = tmp_path / "box.json"
    em.Problem(scene, scene.pack(), captured=near, **asked).save(str(file))
    for option, value in (("--base", "free"), ("--keyframe", "home"), ("--ignore", "tendon")):
        told = invoke(["settle", str(file), option, value])
        assert told.exit_code == 2 and f"{option} is {value}" in told.output
    words = ["limits", str(file), "--vary", "push=0:20"]
    for option, value in (("--protocol", "shake"), ("--mass", "7")):
        told = invoke([*words, option, value])
        assert told.exit_code == 2 and f"{option} is {value}" in told.output


def test_no_file_that_a_command_writes_is_another_of_its_files(tmp_path):
    (tmp_path / "P.json").write_text("{}")
    two = {
        "output is l.json, which is store too": "limits P.json --vary push=0:1 -o l.json --store "
        "./l.json",
        "output is P.json, which is file too": "limits P.json --vary push=0:1 -o P.json",
        "picture is g.png, which is output too": "generate push -o g.png --picture g.png",
        "engine is no parameter: expected --engine": "generate push -p engine=bullet",
    }
    for said, words in two.items():
        done = run_here(*words.split(), cwd=tmp_path)
        assert done.returncode == 2 and said in " ".join(done.stderr.split()), done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["P.json"]
