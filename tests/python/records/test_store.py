"""A store has each score of a dataset, and computes only what is missing."""

from dataclasses import replace

import numpy as np
import pytest
from stores import NODES, SEED, SETTINGS, Counts, Stop, changed, rows, same, scores, stop_after

import energymargin as em
from energymargin import datasets
from energymargin.base.metrics import METRICS, TIMED
from energymargin.evaluate.searches import ALGORITHM, SearchSettings
from energymargin.records.store.scoring import begin_run, score_run
from energymargin.store import ScoreStore, score_dataset


def test_a_file_holds_every_score_and_label_to_the_last_bit(topple, topple_scores, tmp_path):
    assert score_dataset(topple, tmp_path / "s.db", settings=SETTINGS)
    with ScoreStore(tmp_path / "s.db") as store:
        run = store.run()
        labelled = run.labelled_scores()
        assert run.counts() == (6, 6) and run.missing() == [] and run.task == "topple"
        assert run.seconds() == pytest.approx(sum(run.times().values()) / 6) and run.seconds() > 0
    assert same(labelled.scores, topple_scores)
    assert labelled.trajectory.tolist() == [0, 0, 0, 1, 1, 1]
    assert labelled.captured.tolist() == [c for t in topple.trajectories for c in t.captured]
    assert labelled.success.tolist() == [t.success for t in topple.trajectories for _ in range(3)]


def test_a_run_that_was_stopped_goes_on_to_the_same_scores(topple, topple_scores, tmp_path):
    path, one = tmp_path / "s.db", em.executors.Threads(1)
    with pytest.raises(Stop):
        score_dataset(topple, path, settings=SETTINGS, executor=one, progress=stop_after(1))
    with ScoreStore(path) as store:
        run = store.run()
        kept, total = run.counts()
        assert 1 <= kept < total and len(run.missing()) == total - kept
        assert np.isnan(run.labelled_scores().scores["capture"]).sum() == total - kept
    counts = Counts()
    score_dataset(topple, path, settings=SETTINGS, progress=counts)
    assert counts[0] == (kept, 6) and counts[-1] == (6, 6)
    assert same(scores(path), topple_scores)


def test_only_what_is_missing_is_computed(topple, topple_scores, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(topple, path, ["capture", "force"], settings=SETTINGS)
    changed(path, "UPDATE scores SET value = value + 2, seconds = 0")
    score_dataset(topple, path, None, settings=SETTINGS)
    found = scores(path, 2)
    for metric in ("capture", "force"):
        assert np.array_equal(found[metric], topple_scores[metric] + 2)
    for metric in ("success", "effort/est", "effort/rrt"):
        assert np.array_equal(found[metric], topple_scores[metric])


def test_other_settings_are_another_run_and_share_what_they_have_in_common(topple, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(topple, path, ["effort/rrt", "force"], settings=SETTINGS)
    for other in (replace(SETTINGS, nodes=200), replace(SETTINGS, seed=4)):
        score_dataset(topple, path, ["effort/rrt", "force"], settings=other)
    with ScoreStore(path) as store:
        settings = [(run.settings["nodes"], run.settings["seed"]) for run in store.runs()]
        assert settings == [(20, 3), (200, 3), (20, 4)]
        with pytest.raises(ValueError, match=r"has 3 runs, choose one .*run 2: topple, 6 of 6"):
            store.run()
        with pytest.raises(ValueError, match=r"run is 4, and .* has run 1: topple"):
            store.run(4)
    assert rows(path, "scores") == 3 * 6 + 6  # the force score has no settings
    efforts = [scores(path, run)["effort/rrt"] for run in (1, 2, 3)]
    assert not np.array_equal(efforts[0], efforts[1])
    assert not np.array_equal(efforts[0], efforts[2])


def test_a_longer_dataset_computes_what_it_has_more(topple, topple_scores, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(topple, path, settings=SETTINGS)
    longer = datasets.generate("topple", trajectories=3, frames=3, seed=0)
    with pytest.raises(Stop):
        score_dataset(longer, path, settings=SETTINGS, progress=stop_after(6))
    assert rows(path, "scores") == 6 * 6
    score_dataset(longer, path, settings=SETTINGS)
    assert rows(path, "scores") == 9 * 6
    found = scores(path, 2)
    assert all(np.array_equal(found[metric][:6], topple_scores[metric]) for metric in found)


def test_a_task_whose_code_was_changed_is_scored_anew(topple, topple_scores, tmp_path, monkeypatch):
    path = tmp_path / "s.db"
    score_dataset(topple, path, ["effort/rrt"], settings=SETTINGS)
    made = em.tasks.make("topple")
    original = type(made).problem

    def problem(self, *arguments):
        asked = original(self, *arguments)
        return asked.replace(duration=0.9 * asked.duration)

    monkeypatch.setattr(type(made), "problem", problem)
    score_dataset(topple, path, ["effort/rrt"], settings=SETTINGS)
    changed = em.score(topple.problems(), ["effort/rrt"], nodes=NODES, seed=SEED)
    assert np.array_equal(scores(path)["effort/rrt"], changed["effort/rrt"])
    assert not np.array_equal(changed["effort/rrt"], topple_scores["effort/rrt"])
    monkeypatch.undo()
    score_dataset(topple, path, ["effort/rrt"], settings=SETTINGS)
    assert np.array_equal(scores(path)["effort/rrt"], topple_scores["effort/rrt"])
    assert rows(path, "scores") == 12  # nothing was computed a third time


def test_the_labels_of_at_least_one_object_are_kept(tmp_path):
    several = datasets.generate("scoop", trajectories=2, frames=3, seed=0)
    score_dataset(several, tmp_path / "s.db", settings=SearchSettings(nodes=5))
    with ScoreStore(tmp_path / "s.db") as store:
        labelled = store.run().labelled_scores()
    assert set(labelled.scores) == set(METRICS) - set(TIMED)
    some = [label for t in several.trajectories for label in t.captured_any]
    assert labelled.captured_any.tolist() == some
    ends = [t.success_any for t in several.trajectories for _ in range(3)]
    assert labelled.success_any.tolist() == ends


def test_the_algorithm_of_a_run_is_the_newest_and_not_the_last_of_the_alphabet(topple, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(topple, path, ["capture", "force"], settings=SearchSettings(nodes=1))
    changed(path, "UPDATE questions SET algorithm = '0.9.0' WHERE metric = 'force'")
    with ScoreStore(path) as store:
        assert store.run().algorithm == ALGORITHM


def test_an_infinite_effort_survives_the_file(topple, tmp_path):
    expected = em.score(topple.problems(), ["effort/est"], nodes=1)["effort/est"]
    assert np.isinf(expected).any()
    score_dataset(topple, tmp_path / "s.db", ["effort/est"], settings=SearchSettings(nodes=1))
    assert scores(tmp_path / "s.db")["effort/est"].tolist() == expected.tolist()


def test_a_problem_that_cannot_be_written_down_is_known_by_where_it_stands(
    topple, tmp_path, monkeypatch
):
    task = type(em.tasks.make("topple"))
    original = task.problem

    def problem(self, *arguments):
        asked = original(self, *arguments)
        inside = em.regions.Predicate(lambda z: np.ones(len(z), dtype=bool))
        return asked.replace(captured=inside)

    monkeypatch.setattr(task, "problem", problem)
    assert score_dataset(topple, tmp_path / "s.db", ["capture"], settings=SearchSettings(nodes=5))
    assert scores(tmp_path / "s.db")["capture"].tolist() == [1.0] * 6
    with pytest.raises(ValueError, match=r"cannot be sent .*problem 0: .*: use threads"):
        score_dataset(
            topple,
            tmp_path / "p.db",
            ["capture"],
            settings=SearchSettings(nodes=5),
            executor=em.executors.Processes(1),
        )


def test_the_same_settings_in_other_types_are_the_same_run(topple, tmp_path):
    for nodes, least_likelihood in ((1, 0.0), (np.int64(1), 0), (1, np.float32(-0.0))):
        settings = SearchSettings(nodes, least_likelihood=least_likelihood)
        score_dataset(topple, tmp_path / "s.db", ["capture"], settings=settings)
    assert rows(tmp_path / "s.db", "runs") == rows(tmp_path / "s.db", "questions") == 1


@pytest.mark.parametrize(
    "wrong",
    [
        {"least_likelihood": "much"},
        {"least_likelihood": None},
        {"least_likelihood": float("nan")},
        {"stop_at_escape": "yes"},
        {"strength": -0.1},
        {"strength": float("inf")},
        {"strength": True},
        {"objects": 0},
        {"objects": 1.5},
        {"common_random_numbers": 1},
    ],
)
def test_settings_of_another_kind_are_refused_by_name(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        SearchSettings(**wrong)


def test_a_state_that_makes_no_problem_leaves_the_others_their_scores(
    topple, topple_scores, tmp_path, monkeypatch
):
    task, bad = type(em.tasks.make("topple")), topple.trajectories[0].states[2]
    original = task.problem

    def problem(self, state, *arguments):
        if np.array_equal(state, bad):
            raise ValueError("state is no good")
        return original(self, state, *arguments)

    monkeypatch.setattr(task, "problem", problem)
    told = []
    for _ in range(2):
        assert score_dataset(topple, tmp_path / "s.db", settings=SETTINGS, notice=told.append)
    words = "1 of 6 states cannot be simulated and are left out; first trajectory 0, frame 2: state"
    assert len(told) == 2 and all(text == f"{words} is no good" for text in told)
    for metric, found in scores(tmp_path / "s.db").items():
        assert np.array_equal(np.delete(found, 2), np.delete(topple_scores[metric], 2))
    one = em.datasets.Dataset("topple", topple.parameters, 0, [topple.trajectories[0]])
    monkeypatch.setattr(task, "problem", lambda self, *arguments: problem(self, bad))
    with pytest.raises(ValueError, match="trajectory 0, frame 0: state is no good"):
        score_dataset(one, tmp_path / "n.db", settings=SETTINGS)
    assert not (tmp_path / "n.db").exists()


def test_bad_settings_leave_no_file(topple, tmp_path):
    with pytest.raises(ValueError, match="nodes"):
        score_dataset(topple, tmp_path / "s.db", settings=SearchSettings(nodes=0))
    with pytest.raises(ValueError, match=r"settings is \{\}, expected SearchSettings"):
        score_dataset(topple, tmp_path / "s.db", settings={})
    with pytest.raises(ValueError, match="executor is 0, expected Threads"):
        score_dataset(topple, tmp_path / "s.db", executor=0)
    with pytest.raises(ValueError, match="capture/any"):
        score_dataset(topple, tmp_path / "s.db", ["capture/any"])
    with pytest.raises(ValueError, match="beauty"):
        score_dataset(topple, tmp_path / "s.db", ["beauty"])
    assert list(tmp_path.iterdir()) == []


def test_a_state_that_lacks_a_success_set_is_an_error_and_keeps_its_other_scores(
    topple, topple_scores, tmp_path, monkeypatch
):
    task = type(em.tasks.make("topple"))
    monkeypatch.setattr(task, "succeeded", lambda *_: None)
    with ScoreStore(tmp_path / "s.db", create=True) as store:
        run = begin_run(store, topple, ["capture", "success"], SETTINGS)
        with pytest.raises(em.ScoreError, match=r"6 of 6 .*no score of success: it lacks the set"):
            score_run(topple, run)
    assert scores(tmp_path / "s.db")["capture"].tolist() == topple_scores["capture"].tolist()


def test_a_score_that_is_no_number_is_an_error_of_its_state(topple, tmp_path):
    first = topple.trajectories[0]
    one = next(contact for frame in first.contacts for contact in frame)
    names = ("body_a", "body_b", "position", "normal", "distance", "tangential_force")
    of_one = {name: getattr(one, name) for name in names}
    huge = em.Contact(**of_one, normal_force=1e308, friction=1e308)
    broken = replace(first, contacts=[[huge] * 3, *first.contacts[1:]])
    with pytest.raises(em.ScoreError, match=r"1 of 3 .*problem 0: no score of force"):
        score_dataset(replace(topple, trajectories=[broken]), tmp_path / "s.db", ["force"])
    assert np.isnan(scores(tmp_path / "s.db")["force"]).tolist() == [True, False, False]


def test_a_run_with_a_horizon_has_beside_it_the_one_of_the_states_as_they_are(topple, tmp_path):
    path, ahead = tmp_path / "s.db", datasets.Future(1)
    settings = SearchSettings(nodes=2, rollouts=2)
    score_dataset(topple, path, ["effort/est"], settings=settings, future=ahead)
    with ScoreStore(path) as store:
        assert store.beside(store.run()) is None
    score_dataset(topple, path, ["effort/est"], settings=settings)
    with ScoreStore(path) as store:
        assert store.run().number == 1 and store.beside(store.run()).number == 2
        assert store.beside(store.run(2)) is None
        assert set(store.scores(store.run())) == {"effort/est", "now/effort/est"}
    for metrics, nodes in ((["force", "effort/est"], 2), (["force"], 2), (None, 3)):
        score_dataset(topple, path, metrics, settings=replace(settings, nodes=nodes))
    with ScoreStore(path) as store:
        assert store.beside(store.run(1)).metrics == ("effort/est", "force")
        with pytest.raises(ValueError, match="has 5 runs, choose one by its number"):
            store.run()


def test_scores_from_elsewhere_that_cannot_be_are_refused_before_they_are_kept(topple, tmp_path):
    wrong = [0.5] * (topple.size - 1) + [np.inf]
    with pytest.raises(ValueError, match="capture has inf, expected 0 to 1"):
        em.store.add_scores(tmp_path / "s.db", topple, {"capture": wrong}, settings={"source": "x"})
    assert not (tmp_path / "s.db").exists()
