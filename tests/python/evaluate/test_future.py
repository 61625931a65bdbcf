"""Questions about the frames to come: how they are posed, and how a store keeps the answers."""

import csv
import re
import sqlite3
from dataclasses import replace

import numpy as np
import pytest
from command_line import invoke, run as command
from stores import rows, scores

import energymargin as em
from energymargin import datasets
from energymargin.datasets import Future
from energymargin.evaluate.searches import SearchSettings
from energymargin.records.store.scoring import begin_run
from energymargin.store import ScoreStore, score_dataset
from energymargin.tasks import make
from energymargin.tasks.base import parameters_of

SETTINGS = SearchSettings(nodes=20, seed=3, rollouts=6)
TIMED_TOPPLE = ["probability", "probability/success", "effort", "effort/est", "effort/rrt"]


@pytest.fixture(scope="module")
def dataset():
    return datasets.generate("topple", trajectories=2, frames=4, seed=0)


@pytest.fixture(scope="module")
def table(dataset):
    return em.score(dataset.problems(future=Future(1)), nodes=20, seed=3, rollouts=6)


# -- questions


def test_a_horizon_in_frames_is_that_of_the_recorded_times(dataset):
    trajectory = dataset.trajectories[0]
    for frame in (0, 1):
        posed = Future(2).problem(em.tasks.make("topple"), trajectory, frame)
        expected = trajectory.times[frame + 2] - trajectory.times[frame]
        assert posed.horizon == pytest.approx(expected)
        assert np.array_equal(posed.state, trajectory.states[frame])


def test_a_frame_behind_the_last_one_counts_the_mean_time_between_frames():
    times, task = [0.0, 0.1, 0.3], em.tasks.make("topple", friction=0.5)
    recorded = replace(task.rollout(0, frames=3), times=np.array(times))
    seconds = [Future(2, "hold").seconds(recorded, frame) for frame in range(3)]
    assert seconds == pytest.approx([0.3, 0.2 + 0.15, 0.15 + 0.15])
    problem = Future(2, "hold").problem(task, recorded, 1)
    assert problem.horizon == pytest.approx(round(0.35 * 240) / 240)


@pytest.mark.parametrize("plan", ["script", "hold", None])
def test_a_scripted_task_poses_it_as_its_future(dataset, plan):
    task, trajectory = em.tasks.make("topple"), dataset.trajectories[1]
    now, horizon = trajectory.times[1], trajectory.times[2] - trajectory.times[1]
    expected = task.future(trajectory.states[1], now, trajectory.params, horizon, plan)
    assert Future(1, plan).problem(task, trajectory, 1).to_json() == expected.to_json()
    looked = Future(1, plan, check=1 / 120, dwell=1 / 60).problem(task, trajectory, 1)
    assert (looked.check, looked.dwell) == pytest.approx((1 / 120, 1 / 60))


class Plain:
    """A task as the least that a package must bring: without a script or a plan."""

    name = "plain"

    def __init__(self):
        self._task = make("topple", friction=0.5)

    @property
    def parameters(self):
        return {}

    def rollout(self, seed, frames=10):
        return self._task.rollout(seed, frames)

    def problem(self, state, params=None, contacts=None):
        return self._task.problem(state, params, contacts)


class Planned(Plain):
    """The same, with a plan of its own."""

    def plan(self, state, time, params, horizon):
        rows = np.full((round(horizon * 240), 6), time)
        return em.Plan(1 / 240, wrenches={"fingertip": rows})


def test_a_task_without_a_plan_is_asked_with_hold_or_none_and_says_how_to_give_one(dataset):
    task, trajectory = Plain(), dataset.trajectories[0]
    asked = task.problem(trajectory.states[1], trajectory.params, trajectory.contacts[1])
    coasting = Future(1, None).problem(task, trajectory, 1)
    assert coasting.plan is None and coasting.horizon == pytest.approx(0.5)
    held = Future(1, "hold").problem(task, trajectory, 1)
    assert held.plan.rows == round(240 * held.horizon)
    assert np.array_equal(
        held.captured.contains(held.scene, trajectory.states),
        asked.captured.contains(asked.scene, trajectory.states),
    )
    words = r"give Plain a method `plan\(state, time, params, horizon\)` .*'hold' or none"
    with pytest.raises(ValueError, match=words):
        Future(1).problem(task, trajectory, 1)


class Moving(Plain):
    """The same, with the capture set of every instant."""

    def captured_throughout(self, params):
        return em.regions.HalfSpace("object", (0, 0, 1), 50.0)


def test_a_capture_set_of_every_instant_is_asked_where_a_task_gives_one(dataset):
    trajectory = dataset.trajectories[0]
    posed = Future(1, "hold").problem(Moving(), trajectory, 1)
    assert posed.captured.contains(posed.scene, trajectory.states).all()
    assert (
        not Moving()
        .problem(trajectory.states[1])
        .captured.contains(posed.scene, trajectory.states)
        .all()
    )


def test_a_plan_of_a_third_party_is_followed(dataset):
    trajectory = dataset.trajectories[0]
    followed = Future(1).problem(Planned(), trajectory, 2).plan
    assert np.all(followed.wrenches["fingertip"] == trajectory.times[2])


def test_a_recording_follows_no_script(dataset):
    trajectory = dataset.trajectories[0]
    shaken = replace(trajectory, times=trajectory.times + np.array([0, 0.001, 0.002, 0.0]))
    task = em.tasks.make("topple")
    with pytest.raises(ValueError, match=r"not at whole steps .* expected 'hold' or None"):
        Future(1).problem(task, shaken, 0)
    assert Future(1, "hold").problem(task, shaken, 0).horizon > 0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Future(0), "frames is 0, expected a whole number of at least 1"),
        (lambda: Future(1.5), "frames is 1.5, expected a whole number"),
        (lambda: Future(1, "dance"), "plan is 'dance', expected 'script', 'hold' or None"),
        (lambda: Future(1, check=0), "check is 0, expected a positive number"),
        (lambda: Future(1, dwell=-1), "dwell is -1, expected a finite number of at least 0"),
    ],
)
def test_futures_that_cannot_be_are_refused_by_name(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_trajectory_of_one_frame_has_no_horizon_in_frames(dataset):
    first = dataset.trajectories[0]
    one = replace(
        *(first,),
        times=first.times[:1],
        states=first.states[:1],
        contacts=first.contacts[:1],
        captured=first.captured[:1],
    )
    alone = replace(dataset, trajectories=[one])
    with pytest.raises(
        ValueError, match=r"trajectory 0, frame 0: the horizon is 2 frames, .* one frame"
    ):
        alone.problems(future=Future(2))


# -- stores


def test_a_run_holds_what_em_score_says_of_the_same_problems(dataset, table, tmp_path):
    path = tmp_path / "s.db"
    assert score_dataset(dataset, path, settings=SETTINGS, future=Future(1))
    found = scores(path)
    assert list(found) == list(table.scores) and set(found) == set(TIMED_TOPPLE)
    for metric, values in found.items():
        assert np.array_equal(values, table[metric])
    with ScoreStore(path) as store:
        assert "(horizon 1 frame, plan script; " in str(store.run())
        assert store.run().future == Future(1)


def test_a_file_keeps_several_questions_of_a_state_apart(dataset, tmp_path):
    """The effort has the same settings with all horizons: one question, of other problems."""
    path, asked = (
        tmp_path / "s.db",
        [None, Future(1), Future(2), Future(1, "hold"), Future(1, None)],
    )
    for future in [*asked, *asked]:
        score_dataset(dataset, path, ["effort/est"], settings=SETTINGS, future=future)
    assert rows(path, "runs") == 5 and rows(path, "posed") == 5 * 8 and rows(path, "questions") == 1
    for number, future in enumerate(asked, start=1):
        direct = em.score(dataset.problems(future=future), ["effort/est"], nodes=20, seed=3)
        assert np.array_equal(scores(path, number)["effort/est"], direct["effort/est"])
    with ScoreStore(path) as store:
        assert [run.future for run in store.runs()] == asked


def test_a_longer_dataset_computes_what_it_has_more(dataset, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(dataset, path, ["probability"], settings=SETTINGS, future=Future(1))
    longer = datasets.generate("topple", trajectories=3, frames=4, seed=0)
    counts = []
    score_dataset(
        *(longer, path, ["probability"]),
        settings=SETTINGS,
        future=Future(1),
        progress=lambda *count: counts.append(count),
    )
    assert rows(path, "scores") == rows(path, "curves") == 12 and counts[-1] == (12, 12)


def test_each_setting_of_a_disturbance_is_another_question(dataset, tmp_path):
    path = tmp_path / "s.db"
    changes = [{}, {"strength": 0.2}, {"rollouts": 7}, {"common_random_numbers": True}]
    changes += [{"objects": 1}]
    for change in changes:
        for metrics in (["probability"], ["effort/est"]):
            score_dataset(
                dataset, path, metrics, settings=replace(SETTINGS, **change), future=Future(1)
            )
    assert rows(path, "scores") == (len(changes) + 1) * 8  # an effort knows no disturbance
    assert rows(path, "runs") == len(changes) + 1


def test_a_strength_and_common_random_numbers_are_those_of_capture_probability(dataset):
    problems = dataset.problems(future=Future(1))
    options = {"seed": 5, "rollouts": 8}
    weak = em.score(problems, ["probability"], strength=0.3, objects=1, **options)["probability"]
    common = em.score(problems, ["probability"], common_random_numbers=True, **options)
    for i, problem in enumerate(problems):
        model = em.disturbances.Uniform(strength=0.3, objects=1)
        own = em.capture_probability(problem, disturbance=model, rollouts=8, seed=em.stream(5, i))
        shared = em.capture_probability(problem, **options)
        assert weak[i] == own.captured and common["probability"][i] == shared.captured


def test_more_objects_than_there_are_is_said_before_anything_is_computed(dataset, tmp_path):
    words = "objects is 2, expected from 1 to the scene's 1"
    with pytest.raises(ValueError, match=words):
        em.score(dataset.problems(future=Future(1)), ["probability"], objects=2)
    two = replace(SETTINGS, objects=2)
    with pytest.raises(ValueError, match=words):
        score_dataset(dataset, tmp_path / "s.db", ["probability"], settings=two, future=Future(1))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("metric", "future", "words"),
    [
        ("probability", None, "asks about a while: .*--frames N.*Future"),
        ("capture", Future(1), "asks about states as they are: score it without a horizon"),
    ],
)
def test_metrics_of_another_kind_of_question_are_refused(dataset, tmp_path, metric, future, words):
    with pytest.raises(ValueError, match=words):
        score_dataset(dataset, tmp_path / "s.db", [metric], settings=SETTINGS, future=future)
    assert not list(tmp_path.iterdir())


def test_problems_that_cannot_be_written_down_are_known_by_their_place_and_question(
    dataset, tmp_path, monkeypatch
):
    """An effort with the same settings is not taken for that of another future."""
    monkeypatch.setattr(em.tasks, "make", lambda *_, **__: Unwritten())
    path, plain = tmp_path / "s.db", replace(dataset, parameters=parameters_of(Unwritten()))
    for future in (None, Future(1, None), Future(2, None)):
        score_dataset(plain, path, ["effort/est"], settings=SearchSettings(nodes=5), future=future)
    assert rows(path, "scores") == 3 * 8


class Unwritten(Plain):
    """The same, with a capture set that has no file format."""

    def problem(self, state, params=None, contacts=None):
        inside = em.regions.Predicate(lambda states: np.ones(len(states), dtype=bool))
        return super().problem(state, params, contacts).replace(captured=inside)


def test_a_change_of_the_task_is_noticed_by_the_run_of_each_future(dataset, tmp_path, monkeypatch):
    path = tmp_path / "s.db"
    for future in (None, Future(1)):
        score_dataset(dataset, path, ["effort/est"], settings=SETTINGS, future=future)
    task = type(make("topple"))
    script = task.script

    def weaker(self, params):
        wrenches = script(self, params).wrenches
        return em.tasks.Drive({body: 0.5 * rows for body, rows in wrenches.items()})

    monkeypatch.setattr(task, "script", weaker)
    with ScoreStore(path) as store:
        assert begin_run(store, dataset, ["effort/est"], SETTINGS).counts() == (8, 8)
        changed = begin_run(store, dataset, ["effort/est"], SETTINGS, Future(1))
        assert changed.counts() == (0, 8)


# -- curves


def test_a_curve_is_kept_to_the_last_bit(dataset, tmp_path):
    path, future = tmp_path / "s.db", Future(1)
    score_dataset(dataset, path, settings=SETTINGS, future=future)
    problems = dataset.problems(future=future)
    with ScoreStore(path) as store:
        run = store.run()
        for number, problem in enumerate(problems):
            own = em.capture_probability(problem, rollouts=6, seed=em.stream(3, number))
            times, curve = run.curve(number)
            assert np.array_equal(times, own.times) and np.array_equal(curve, own.curve)
        assert run.curve(0, "effort/est") is None
        with pytest.raises(ValueError, match=r"metric is 'capture', expected one of .*probability"):
            run.curve(0, "capture")
        with pytest.raises(ValueError, match="number is 8, expected a whole number from 0 to 7"):
            run.curve(8)
    with sqlite3.connect(path) as file:
        times, curve = file.execute("SELECT times, curve FROM curves").fetchone()
    assert len(times) == len(curve) == 8 * len(np.frombuffer(times, "<f8"))
    assert np.frombuffer(times, "<f8")[0] == 0.0 and np.frombuffer(curve, "<f8")[0] in (0.0, 1.0)


def test_a_curve_of_at_least_one_object_is_another_one(tmp_path):
    several = datasets.generate("scoop", trajectories=1, frames=3, seed=0)
    path, settings = tmp_path / "s.db", SearchSettings(rollouts=4, strength=3.0, objects=1)
    score_dataset(
        several, path, ["probability", "probability/any"], settings=settings, future=Future(1)
    )
    with ScoreStore(path) as store:
        run = store.run()
        for number in range(3):
            (times, all_of), (same_times, some) = (
                run.curve(number, metric) for metric in ("probability", "probability/any")
            )
            assert np.array_equal(times, same_times) and np.all(some >= all_of)


@pytest.mark.parametrize("executor", [em.executors.Threads(2), em.executors.Processes(1)])
def test_rows_carry_their_curves_on_any_executor(dataset, executor):
    problems, found = dataset.problems(future=Future(1)), {}
    for number, on in enumerate((em.executors.Threads(1), executor)):
        kept = []
        em.score(
            *(problems, ["probability", "effort/est"]),
            nodes=20,
            seed=3,
            executor=on,
            rollouts=5,
            strength=0.7,
            common_random_numbers=True,
            on_rows=kept.extend,
        )
        found[number] = {
            row.index: [(m, t.tobytes(), c.tobytes()) for m, (t, c) in row.curves.items()]
            for row in kept
        }
    assert found[0] == found[1] and len(found[0]) == 8
    assert all([metric for metric, _, _ in own] == ["probability"] for own in found[0].values())


def test_an_export_has_the_curves_in_a_file_beside_it(dataset, tmp_path):
    path = tmp_path / "s.db"
    for future in (None, Future(1, None)):
        metrics = ["effort/est"] if future is None else ["probability"]
        score_dataset(dataset, path, metrics, settings=SETTINGS, future=future)
    frame = em.store.load(path)
    assert frame["horizon"].isna().tolist() == [True] * 8 + [False] * 8
    assert frame["plan"].tolist()[8:] == ["none"] * 8
    done = invoke(["export", str(path), "-o", str(tmp_path / "out.csv")])
    assert done.exit_code == 0 and "out-curves.csv" in done.output.replace("\n", "")
    with (tmp_path / "out-curves.csv").open() as file:
        lines = list(csv.DictReader(file))
    with ScoreStore(path) as store:
        times, curve = store.run(2).curve(5)
    fifth = [line for line in lines if (line["trajectory"], line["frame"]) == ("1", "1")]
    assert [float(line["time"]) for line in fifth] == times.tolist()
    assert [float(line["probability"]) for line in fifth] == curve.tolist()
    assert {(line["run"], line["metric"]) for line in lines} == {("2", "probability")}
    em.store.export(path, tmp_path / "out.parquet")
    import pandas as pd

    assert len(pd.read_parquet(tmp_path / "out-curves.parquet")) == len(lines)
    em.store.export(path, tmp_path / "one.csv", run=1)
    assert not (tmp_path / "one-curves.csv").exists()


# -- the command


@pytest.fixture(scope="module")
def folder(tmp_path_factory, dataset):
    folder = tmp_path_factory.mktemp("future")
    dataset.save(folder / "topple.h5")
    return folder


def test_the_command_scores_the_future_and_what_has_no_clock_in_two_runs(folder, dataset):
    asked = ["--metrics", "probability,capture,effort/est,force", "--frames", 1]
    options = ["--nodes", 20, "--seed", 3, "--rollouts", 6, "--strength", 0.5, "--common"]
    for _ in range(2):
        done = command("score", "topple.h5", "-o", "two.db", *asked, *options, cwd=folder)
        assert done.returncode == 0, done.stderr
        first, second = [line for line in done.stderr.splitlines() if "are scored" in line]
        assert "8 states are scored in two.db (horizon 1 frame, plan script)" in first
        assert "(without the horizon: capture, force)" in second
        assert done.stderr.endswith("Next: energymargin evaluate two.db\n")
    settings = {"nodes": 20, "seed": 3}
    ahead = em.score(
        *(dataset.problems(future=Future(1)), ["probability", "effort/est"]),
        **settings,
        rollouts=6,
        strength=0.5,
        common_random_numbers=True,
    )
    now = em.score(dataset.problems(), ["capture", "force"], **settings)
    for run, table in ((1, ahead), (2, now)):
        found = scores(folder / "two.db", run)
        assert found.keys() == table.scores.keys()
        assert all(np.array_equal(found[metric], table[metric]) for metric in found)
    lines = evaluated(folder, "two.db")
    ahead = ["probability", "effort/est", "capture", "force"]
    assert [line["score"] for line in lines if line["among"] == "captured"] == ahead
    assert {line["horizon"] for line in lines if line["among"] == "captured"} == {"1"}
    whole = [line for line in lines if line["among"] == "all" and line["score"] == "capture"]
    assert [line["horizon"] for line in whole] == list("012345")
    # of two trajectories the last frame has none before it; further on there is one label alone
    assert [line["count"] for line in whole[:2]] == ["8", "6"]
    of_all = evaluated(folder, "two.db", "--among", "all", "--frames", 0)
    assert [line["score"] for line in of_all[:4]] == ahead


def evaluated(folder, scores, *options):
    done = command("evaluate", scores, "-o", "t.csv", "--overwrite", *options, cwd=folder)
    assert done.returncode == 0, done.stderr
    with (folder / "t.csv").open() as file:
        return list(csv.DictReader(file))


PAPER = {"capture", "success", "effort/est", "effort/rrt", "force"}


def test_by_default_it_asks_ahead_beside_the_paper_s_scores_and_says_which_states_count(folder):
    options = ["--plan", "hold", "--check", 0.05, "--dwell", 0.1, "--nodes", 5, "--rollouts", 2]
    done = command("score", "topple.h5", "-o", "all.db", *options, cwd=folder)
    asked = "(horizon 3 frames, plan hold, check 0.05 s, dwell 0.1 s)"  # of four that there are
    assert done.returncode == 0 and asked in done.stderr, done.stderr
    assert em.datasets.usual_future(datasets.load(folder / "topple.h5")) == Future(3, "script")
    assert set(scores(folder / "all.db", 1)) == {"probability", "effort"}
    assert set(scores(folder / "all.db", 2)) == PAPER
    table = " ".join(done.stdout.split())
    assert "of 8 states count" in table and "with fewer than 3 frames left" in table
    for words in ("probability", "capture", "effort", "effort/est", "force"):
        assert words in table


def test_the_paper_s_scores_alone_go_on_and_those_ahead_come_beside_them(folder):
    asked = ["score", "topple.h5", "-o", "older.db", "--nodes", 5]
    done = command(*asked, "--paper", cwd=folder)
    assert done.returncode == 0 and done.stdout == "", done.stderr
    kept = scores(folder / "older.db")
    assert set(kept) == PAPER
    told = command(*asked, "--rollouts", 2, cwd=folder).stderr
    assert "older.db has scores of the states as they are. They stay" in told
    assert set(scores(folder / "older.db", 2)) == {"probability", "effort"}
    assert all(np.array_equal(scores(folder / "older.db", 1)[m], kept[m]) for m in kept)
    assert "They stay" not in command(*asked, "--rollouts", 2, cwd=folder).stderr


def test_data_that_have_no_next_frame_get_the_paper_s_scores_alone_and_it_says_so(folder, dataset):
    columns = ("times", "states", "captured", "contacts")
    first = [
        replace(one, **{name: getattr(one, name)[:1] for name in columns})
        for one in dataset.trajectories
    ]
    replace(dataset, trajectories=first).save(folder / "single.h5")
    done = command("score", "single.h5", "--nodes", 2, cwd=folder)
    words = "nothing is asked about the next frames, only the paper's scores: each trajectory has"
    assert done.returncode == 0 and words in " ".join(done.stderr.split())
    assert set(scores(folder / "single-scores.db")) == PAPER
    done = command("score", "single.h5", "--plan", "hold", cwd=folder)
    assert done.returncode == 2 and "each trajectory has one frame alone" in done.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--paper", "--plan", "hold"], "--paper and --plan are given, expected one of them"),
        (["--paper", "--metrics", "force"], "--paper and --metrics are given, expected one"),
        (["--metrics", "force", "--plan", "hold"], "--plan is hold, expected --frames beside it"),
        (["--frames", 0], "frames is 0, expected a whole number of at least 1"),
        (
            ["--frames", 1, "--plan", "fly"],
            'Invalid value "fly" for --plan. Choose from: "script", "hold", "none"',
        ),
        (["--paper", "--common"], "--paper and --common are given, expected one of them"),
        (["--metrics", "force", "--dwell", 0.1], "--dwell is 0.1, expected --frames beside it"),
        (["--frames", 1, "--check", 0], "check is 0.0, expected a positive number"),
        (["--frames", 1, "--dwell", -1], "dwell is -1.0, expected a finite number"),
        (["--frames", 1, "--strength", -1], "strength is -1.0, expected a finite number"),
        (["--frames", 1, "--objects", 0], "objects is 0, expected a whole number from 1"),
        (["--frames", 1, "--objects", 3], "objects is 3, expected from 1 to the scene's 1"),
        (["--frames", 1, "--rollouts", 0], "rollouts is 0, expected a whole number"),
        (["--frames", 1, "--metrics", "capture,beauty"], "metrics is 'beauty'"),
    ],
)
def test_what_the_command_cannot_ask_is_one_line_and_leaves_no_file(folder, options, words):
    arguments = ["score", str(folder / "topple.h5"), "-o", str(folder / "none.db")]
    done = invoke([*arguments, *map(str, options)])
    assert done.exit_code == 2 and re.search(words, " ".join(done.output.split())), done.output
    assert not (folder / "none.db").exists()
