"""A recording in a scene of one's own: a problem file is the task."""

import re

import numpy as np
import pytest
from command_line import run_here
from recorded import noisy, poses_of, push, write

import energymargin as em
from energymargin.recordings import dataset, read_csv
from energymargin.tasks.from_problem import ProblemTask


def own_problem(**changes):
    """A puck on a table, and a finger that pushes it; captured in a strip along y."""
    scene = em.Scene()
    scene.add_plane("table", friction=0.4)
    scene.add_body(
        "puck",
        em.Cylinder(0.03, 0.02),
        mass=0.1,
        position=(0.1, 0, 0.01),
        friction=0.5,
        role="object",
    )
    scene.add_body(
        "finger",
        em.Cylinder(0.01, 0.04),
        mass=0.2,
        position=(0.1, -0.06, 0.025),
        role="effector",
        linear_factor=(1, 1, 0),
        angular_factor=(0, 0, 1),
    )
    strip = {
        "captured": em.regions.HalfSpace("puck", (1, 0, 0), 0.105),
        "succeeded": em.regions.HalfSpace("puck", (0, -1, 0), -0.1),
    }
    bounds = {"force": (0.5, 0.5, 0), "torque": (0, 0, 0), "duration": 0.1}
    return em.Problem(scene, scene.pack(), **strip, **bounds, **changes)


@pytest.fixture
def folder(tmp_path):
    own_problem().save(tmp_path / "P.json")
    write(tmp_path / "REC.csv", noisy(poses_of(push())))
    return tmp_path


def imported(folder, *options):
    return run_here("import", "REC.csv", "--problem", "P.json", *options, cwd=folder)


def test_the_commands_lead_from_a_recording_and_a_problem_to_a_table(folder):
    done = imported(folder)
    assert done.returncode == 0, done.stderr
    assert "1 trajectories (1 successful by their last states), 100 states" in done.stderr
    scored = run_here(
        *("score", "P-recorded.h5", "--metrics", "capture,force", "--nodes", 2), cwd=folder
    )
    assert scored.returncode == 0 and "100 states are scored" in scored.stderr, scored.stderr
    assert run_here("evaluate", "P-recorded-scores.db", cwd=folder).returncode == 0
    ahead = ("--metrics", "probability", "--rollouts", 2, "-o", "ahead.db")
    told = run_here("score", "P-recorded.h5", *ahead, cwd=folder).stderr
    assert (
        "no script says what the robot is about to do: it goes on as it moves, --plan hold" in told
    )
    recorded = em.datasets.load(folder / "P-recorded.h5")
    frames = round(0.5 / np.diff(recorded.trajectories[0].times).mean())
    assert f"horizon {frames} frames, plan hold" in told
    assert em.datasets.usual_future(recorded) == em.datasets.Future(frames, "hold")


def test_states_are_those_of_the_recording_with_the_labels_of_the_problem_s_sets(folder):
    imported(folder)
    (trajectory,) = em.datasets.load(folder / "P-recorded.h5").trajectories
    scene, recording = own_problem().scene, read_csv(folder / "REC.csv")
    place = scene.slice("puck").start
    assert np.allclose(trajectory.states[:, place], recording.object.poses[:, 0], atol=1e-2)
    assert np.array_equal(trajectory.captured, trajectory.states[:, place] <= 0.105)
    assert 0 < trajectory.captured.sum() < len(trajectory)
    assert trajectory.success


def test_a_problem_asks_its_question_at_each_state(folder):
    imported(folder)
    posed = em.datasets.load(folder / "P-recorded.h5").problems([50])[0]
    own = own_problem()
    assert np.array_equal(posed.force, own.force) and posed.duration == own.duration
    assert not np.array_equal(posed.state, own.state)


def test_the_command_says_that_velocities_know_later_frames_and_how_they_do_not(folder):
    assert "smoothed over frames before and after; with --causal" in imported(folder).stderr
    done = imported(folder, "--causal", "--overwrite")
    assert "--causal" not in done.stderr and "6 frames at its ends left out" in done.stderr
    (trajectory,) = em.datasets.load(folder / "P-recorded.h5").trajectories
    assert len(trajectory) == 94


def test_labels_of_a_file_win_over_the_success_set(folder):
    (folder / "labels.csv").write_text("recording,success\nREC.csv,0\n")
    assert "(0 successful)" in imported(folder, "--labels", "labels.csv").stderr


def test_a_problem_file_that_changed_since_is_refused(folder):
    imported(folder)
    own_problem().replace(duration=0.2).save(folder / "P.json")
    done = run_here("score", "P-recorded.h5", "--metrics", "force", cwd=folder)
    assert done.returncode == 2
    assert "P.json has changed since it was recorded with" in done.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--task", "push"), "--task and --problem are given, expected one of them"),
        (("-p", "friction=0.3"), "--problem has no parameters, expected no -p"),
    ],
)
def test_options_that_contradict_a_problem_are_refused(folder, options, words):
    done = imported(folder, *options)
    assert done.returncode == 2 and words in done.stderr


def test_problems_that_recordings_do_not_fit_are_refused(tmp_path):
    path = tmp_path / "P.json"
    own_problem(horizon=0.5).save(path)
    with pytest.raises(ValueError, match=r"P\.json has a horizon, expected none"):
        ProblemTask(str(path)).body("object")
    problem = own_problem()
    scene = problem.scene
    scene.add_body("other", em.Sphere(0.01), mass=0.1, position=(1, 1, 0.01), role="effector")
    two = em.Problem(
        scene,
        scene.pack(),
        captured=problem.captured,
        **{"force": (1, 0, 0), "torque": (0, 0, 0), "duration": 0.1},
    )
    two.save(path)
    words = re.escape(
        "'finger', 'other' with the role 'effector' that moves freely, on no joint, expected one"
    )
    with pytest.raises(ValueError, match=words):
        ProblemTask(str(path)).body("effector")
    with pytest.raises(ValueError, match=r"makes no trajectories: .* --problem P\.json"):
        ProblemTask(str(path)).rollout(0)


def test_without_labels_a_recording_succeeds_whose_last_state_lies_in_the_success_set(folder):
    task, recordings = ProblemTask(str(folder / "P.json")), [read_csv(folder / "REC.csv")]
    bodies = {"object": "puck", "effector": "finger"}
    assert dataset(task, recordings, **bodies).successes.tolist() == [True]
    early = own_problem().replace(succeeded=em.regions.HalfSpace("puck", (0, -1, 0), -9.0))
    early.save(folder / "P.json")
    task = ProblemTask(str(folder / "P.json"))
    assert dataset(task, recordings, **bodies).successes.tolist() == [False]


@pytest.mark.parametrize("own", ["native", "bullet"])
def test_an_engine_that_is_asked_for_is_that_of_the_questions(folder, own):
    own_problem().with_engine(own).save(folder / "P.json")
    task, bodies = ProblemTask(str(folder / "P.json")), {"object": "puck", "effector": "finger"}
    recorded = dataset(task, [read_csv(folder / "REC.csv")], **bodies)
    for asked in ("native", "bullet"):
        found = recorded.in_engine(asked)
        assert found.problems([0])[0].scene.engine == asked
        assert (found is recorded) == (asked == own)
