"""Beliefs about the states of a dataset, in a store and at the terminal."""

import csv
import json
from functools import partial

import numpy as np
import pytest
from command_line import invoke
from reports import Document
from scipy.stats import norm

import energymargin as em
from energymargin import report
from energymargin.beliefs import Uncertainty
from energymargin.evaluate.belief_scoring import BeliefWork, Sharing, particle_chunk
from energymargin.evaluate.executors import choice
from energymargin.evaluate.executors.rows import Work
from energymargin.look.report.subject import read_subject
from energymargin.look.viewer.sources import stored_scores
from energymargin.look.viewer.texts import score_table
from energymargin.store import ScoreStore, score_dataset

PLACE = (0.02, 0.02, 0, 0, 0, 0)
KNOWN = Uncertainty(pose={"object": PLACE, "effector": PLACE}, friction={"table": 0.05})
ASKED = {"nodes": 90, "particles": 3, "executor": em.executors.Threads(1)}


@pytest.fixture(scope="module")
def dataset():
    return em.datasets.generate("push", trajectories=2, frames=3, seed=1)


@pytest.fixture(scope="module")
def path(dataset, tmp_path_factory):
    path = tmp_path_factory.mktemp("store") / "scores.db"
    assert score_dataset(dataset, path, ["capture"], uncertainty=KNOWN, **ASKED)
    return path


def test_scores_are_those_of_beliefs_about_the_states(dataset, path):
    sharing = Sharing(3, em.SearchSettings(nodes=90))
    known = []
    for number in range(dataset.size):
        belief = partial(dataset.belief, uncertainty=KNOWN)
        asked = Work(number, belief(number).problem, ("capture",))
        work = BeliefWork(asked, belief, sharing)
        particles = [one for piece in work.particles() for one in piece]
        known.append(work.scores(particle_chunk(sharing.settings, particles, em.Cancel())))
    with ScoreStore(path) as store:
        run = store.run()
        assert run.sampling.uncertainty == KNOWN and run.sampling.particles == 3
        assert "belief" in str(run) and "3 particles" in str(run)
        for number, row in enumerate(run.rows()):
            score = known[number]["capture"]
            assert row.scores == (score.mean,)
            assert run.particles(number, "capture").tolist() == score.values.tolist()
            assert len(set(score.values)) > 1 or score.mean in (0, 1)


def test_a_dataset_poses_the_question_about_each_particle(dataset):
    """Its capture set is that of the particle's own state."""
    belief = dataset.belief(4, Uncertainty(velocity={"effector": (0.2, 0.2, 0, 0, 0, 0)}))
    task = em.tasks.make("push", **dataset.parameters)
    params = dataset.trajectories[1].params
    for one in belief.particles(3).problems:
        own = json.loads(task.problem(np.asarray(one.state), params).to_json())
        assert json.loads(one.to_json())["captured"] == own["captured"]
    with pytest.raises(ValueError, match="number is 6"):
        dataset.belief(6, KNOWN)


def test_a_run_without_a_belief_and_one_with_another_stand_beside_it(dataset, path):
    other = Uncertainty(friction={"table": 0.1})
    score_dataset(dataset, path, ["capture"], uncertainty=other, **ASKED)
    score_dataset(dataset, path, ["capture"], nodes=90, executor=em.executors.Threads(1))
    with ScoreStore(path) as store:
        runs = store.runs()
        assert [run.sampling and run.sampling.uncertainty for run in runs] == [KNOWN, other, None]
        assert runs[2].particles(0, "capture") is None
        assert [run.counts() for run in runs] == [(6, 6)] * 3
        means = [run.labelled_scores().scores["capture"].tolist() for run in runs]
        with pytest.raises(ValueError, match="metric is 'force'"):
            runs[0].particles(0, "force")
        with pytest.raises(ValueError, match="number is 6"):
            runs[0].particles(6, "capture")
    assert means[0] != means[1] != means[2] != means[0]


def test_it_goes_on_from_a_stop_to_the_same_bits(dataset, path, tmp_path, monkeypatch):
    # Chunks of so little work that not all particles are on their way when two states are done.
    monkeypatch.setattr(choice._ThreadWorkers, "seconds", 0.0)
    cancel, other = em.Cancel(), tmp_path / "other.db"

    def stop(done, _total):
        if done >= 2:
            cancel.set()

    asked = {"metrics": ["capture"], "uncertainty": KNOWN, **ASKED}
    assert not score_dataset(dataset, other, progress=stop, cancel=cancel, **asked)
    with ScoreStore(other) as store:
        assert 2 <= store.run().counts()[0] < 6
    assert score_dataset(dataset, other, **asked)
    with ScoreStore(other) as store, ScoreStore(path) as whole:
        ours, known = store.run(), whole.run(1)
        assert [row.scores for row in ours.rows()] == [row.scores for row in known.rows()]


def test_probabilities_have_a_particle_each_rollout(dataset, tmp_path):
    path = tmp_path / "scores.db"
    future = em.datasets.Future(1, plan="hold")
    asked = {"uncertainty": KNOWN, "rollouts": 5, **ASKED}
    assert score_dataset(dataset, path, ["probability"], future=future, **asked)
    with ScoreStore(path) as store:
        run = store.run()
        values = [run.particles(number, "probability") for number in range(6)]
        assert {len(of_state) for of_state in values} == {5}
        assert [row.scores[0] for row in run.rows()] == [of_state.mean() for of_state in values]
        _, curve = run.curve(3, "probability")
        assert curve[-1] == values[3].mean()
        assert run.with_quantiles == []
        with pytest.raises(ValueError, match="'probability', whose particles have one rollout"):
            run.quantiles("probability", [0.1])


def test_a_state_whose_draws_have_no_place_is_named(dataset, tmp_path):
    far = Uncertainty(mass={"object": norm(-5.0, 0.1)})
    with pytest.raises(em.ScoreError, match="draws of the belief have no place or a friction"):
        score_dataset(dataset, tmp_path / "scores.db", ["capture"], uncertainty=far, **ASKED)


def test_quantiles_are_those_of_the_particles(dataset, path):
    with ScoreStore(path) as store:
        run = store.run(1)
        low, high = run.quantiles("capture", [0.0, 1.0]).T
        for number in range(dataset.size):
            values = run.particles(number, "capture")
            assert (low[number], high[number]) == (values.min(), values.max())
        assert run.quantiles("capture", []).shape == (dataset.size, 0)


def test_the_report_shows_how_far_the_particles_lie_apart(dataset, path, tmp_path):
    subject = read_subject(path, 1)
    assert subject.run.sampling.uncertainty == KNOWN
    page = tmp_path / "report.html"
    report.write(path, page, run=1, options=report.Options(draws=20, pictures=0))
    document = Document(page)
    assert all("capture: 0.1 to 0.9 quantile" in one.texts for one in document.pictures["along"])
    text = document.text
    assert "not known for sure" in text and "3 particles; each score is the mean" in text


def test_the_viewer_shows_a_low_quantile_beside_the_mean(dataset, path):
    stored = stored_scores(path, dataset, 1)
    (title, mean), (low_title, low) = stored.at(4)
    assert "mean of 3 particles" in title and low_title == "0.1 quantile"
    table = score_table(None, stored.at(4))
    assert f">{mean['capture']:.3f}<" in table and f">{low['capture']:.3f}<" in table


def test_a_run_with_a_horizon_stands_beside_one_of_its_own_belief_alone(dataset, tmp_path):
    """Whatever was scored before, and however many metrics the others have."""
    path, ahead = tmp_path / "scores.db", em.datasets.Future(1, plan="hold")
    other = Uncertainty(friction={"table": 0.1})
    beliefs = [None, KNOWN, other]

    def score(metrics, belief, particles=3, **asked):
        model = {} if belief is None else {"uncertainty": belief, "particles": particles}
        keywords = {"nodes": 90, "rollouts": 5, "executor": em.executors.Threads(1)}
        score_dataset(dataset, path, metrics, **keywords, **model, **asked)

    for belief in beliefs:
        score(["probability"], belief, future=ahead)
    with ScoreStore(path) as store:
        assert [store.beside(run) for run in store.runs()] == [None] * 3
    score(["force", "capture"], other)
    score(["capture"], None)
    score(["force", "capture"], KNOWN, particles=4)
    with ScoreStore(path) as store:
        beside = [store.beside(run) for run in store.runs()[:3]]
        assert [run and run.number for run in beside] == [5, None, 4]
        assert set(store.scores(store.run(2))) == {"probability"}
    score(["capture"], KNOWN)
    with ScoreStore(path) as store:
        beside = [store.beside(run) for run in store.runs()[:3]]
        assert [run and run.number for run in beside] == [5, 7, 4]
        known = store.run(7).labelled_scores().scores["capture"]
        assert store.scores(store.run(2))["capture"].tolist() == known.tolist()
        assert [store.beside(run) for run in store.runs()[3:]] == [None] * 4


def test_a_picture_of_a_belief_shows_the_model_without_its_errors_and_says_so(tmp_path):
    data, scores, page = (tmp_path / name for name in ("p.h5", "p-scores.db", "p.html"))
    dataset = em.datasets.generate("push", trajectories=12, frames=6, seed=1)
    dataset.save(data)
    score_dataset(dataset, scores, ["capture"], uncertainty=KNOWN, **ASKED)
    report.write(scores, page, options=report.Options(draws=20, pictures=1))
    text = Document(page).text
    assert "changed since" not in text
    assert "The picture shows the model without its errors, whose score is" in text


def run_command(*words):
    return invoke([*map(str, words)])


def test_the_command_scores_beliefs_and_export_tells_them(dataset, path, tmp_path):
    data, scores = tmp_path / "push.h5", tmp_path / "push-scores.db"
    dataset.save(data)
    (tmp_path / "known.json").write_text(KNOWN.to_json())
    command = ["score", data, "--metrics", "capture", "--nodes", 90, "--particles", 3]
    done = run_command(*command, "--belief", tmp_path / "known.json", "--threads", 1)
    assert done.exit_code == 0, done.output
    with ScoreStore(scores) as store, ScoreStore(path) as whole:
        ours, known = store.run(), whole.run(1)
        assert [row.scores for row in ours.rows()] == [row.scores for row in known.rows()]
    again = run_command(*command, "--belief", KNOWN.to_json(), "--threads", 1)
    assert again.exit_code == 0, again.output
    table = tmp_path / "scores.csv"
    assert run_command("export", scores, "-o", table).exit_code == 0
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert len(rows) == 6
    assert {(row["uncertainty"], row["particles"]) for row in rows} == {(KNOWN.to_json(), "3")}
    for name in ("capture_q10", "capture_q50", "capture_q90"):
        assert all(0 <= float(row[name]) <= 1 for row in rows)
    for row in rows:
        assert float(row["capture_q10"]) <= float(row["capture_q50"]) <= float(row["capture_q90"])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--particles", "3"], "--particles is 3, expected --belief beside it"),
        (["--belief", "{"], "uncertainty is '{', expected JSON"),
        (["--belief", '{"pose": 3}'], "pose is 3, expected six standard deviations"),
        (["--belief", '{"mass": {"cup": 1}}'], "mass names the body 'cup'"),
        (["--belief", '{"mass": 1}', "--nodes", "3"], "nodes is 3, expected one at least for each"),
    ],
)
def test_beliefs_that_cannot_be_are_refused_at_the_terminal(dataset, tmp_path, options, words):
    data = tmp_path / "push.h5"
    dataset.save(data)
    done = run_command("score", data, "--metrics", "capture", *options)
    assert done.exit_code == 2 and words in " ".join(done.output.split()), done.output
    assert not (tmp_path / "push-scores.db").exists()
