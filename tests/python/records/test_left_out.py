"""A recorded state that cannot be simulated is left out and counted; the others are scored."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command_line import run_here
from published_data import write_data

import energymargin as em
from energymargin.evaluation import evaluate
from energymargin.records.datasets.dataset import StateError
from energymargin.records.store.scoring import SAMPLE
from energymargin.store import ScoreStore
from energymargin_paper.paper import authors
from energymargin_paper.paper.authors.reading import matched_interval

pytest.importorskip("trimesh")
COMBINATION = "jaw-pushes-rectangle"
PUSHED = 5  # number of the state of a push that cannot be simulated


def change(path, line, **values):
    """Changes cells of one line of a table, by their columns."""
    header, *rows = (text.split(",") for text in path.read_text().splitlines())
    for name, value in values.items():
        rows[line][header.index(name)] = str(value)
    path.write_text("\n".join(",".join(row) for row in (header, *rows)))


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    return write_data(tmp_path_factory.mktemp("good"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Published data with one state in each part that cannot be simulated."""
    root = write_data(tmp_path_factory.mktemp("published"))
    simulated = root / "simulated"
    # between the pusher and the wall, which are 1.5 cm too near
    change(simulated / "push" / "viapoints.csv", PUSHED, xo=4.5, yo=8.79, yg=8.515)
    change(simulated / "topple" / "viapoints.csv", 2, yo=0.3)  # in the ground
    recording = root / "recordings" / COMBINATION / "00" / "apriltag_results.csv"
    change(recording, 8, tvec_world_tag_1_x=0.0)  # the tool in the middle of the object
    return root


def test_a_part_keeps_a_state_that_cannot_be_simulated_with_its_label(folder, good):
    dataset, other = (authors.dataset(root, "push") for root in (folder, good))
    problems, reasons = dataset.possible_problems()
    assert list(reasons) == [PUSHED] and set(problems) == set(range(8)) - {PUSHED}
    assert "trajectory 1, frame 1" in reasons[PUSHED] and "penetrate" in reasons[PUSHED]
    with pytest.raises(StateError, match="trajectory 1, frame 1"):
        dataset.problems()
    assert dataset.labels(0, 8) == other.labels(0, 8)
    recorded = dataset.trajectories[1].states[1]
    bodies = em.tasks.make("published-push").scene({}).unpack(recorded)
    assert bodies["object"]["position"] == pytest.approx([4.5, 8.79, 0.05])


def test_the_clock_of_a_topple_is_that_of_the_states_that_can_be_simulated():
    task, params = em.tasks.make("published-topple"), {"friction": 0.5}
    scene = task.scene(params)
    row = np.array([6.0, 2.0, 0.0, 0.2, 0.0, 0.0, 2.0, 3.6, 0.2, 0.2])
    start = task.state(scene, row)
    world = em.World(scene, task.plan(start, 0.0, params, 1.0))
    states = world.simulate(start, 4 * 31, record=range(0, 4 * 31 + 1, 31)).states
    row[[0, 1, 3]] = 60.0, 0.3, -100.0  # in the ground, far away and fast
    wrong = np.insert(states, [2, 5], task.state(scene, row), axis=0)
    assert matched_interval(task, params, wrong) == pytest.approx(31 / 240)


def test_an_import_of_published_data_counts_it(folder, tmp_path):
    done = run_here("import-published", folder, "-o", "out", cwd=tmp_path)
    said = " ".join(done.stderr.split())
    assert done.returncode == 0, said
    assert "push: 1 of 8 states cannot be simulated and are left out; first trajectory 1" in said
    assert "topple: 1 of 8 states" in said and f"{COMBINATION}: 1 of 24 states" in said
    assert "40 states, of which 3 cannot be simulated" in said
    with ScoreStore(tmp_path / "out" / "push-scores.db") as store:
        theirs = store.run().labelled_scores()
    assert np.isfinite(theirs.scores["capture"]).all() and len(theirs.captured) == 8


def test_the_study_of_published_data_scores_the_rest(folder, tmp_path):
    words = ["reproduce", "published", "--data", folder, "--quick", "--nodes", 3, "--every", 2]
    done = run_here(*words, "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    expected = f"left out (1 of push, 1 of topple, 1 of {COMBINATION})"
    assert f"3 states could not be scored and are {expected}" in done.stdout
    rows = [json.loads(line)[1] for line in (tmp_path / "out" / "runs.jsonl").open()]
    assert len(rows) == 2 * 8 + 12 and sum(bool(row["scores"]) for row in rows) == len(rows) - 3


@pytest.fixture(scope="module")
def scored(folder, tmp_path_factory):
    """A folder with the dataset, and what the command said when it scored it."""
    own = tmp_path_factory.mktemp("scored")
    authors.dataset(folder, "push").save(own / "push.h5")
    return own, run_here("score", "push.h5", "--paper", "--nodes", 5, cwd=own)


def test_score_counts_it_and_gives_the_others_the_same_bits(scored, good, tmp_path):
    own, done = scored
    said = " ".join(done.stderr.split())
    assert done.returncode == 0, said
    assert "1 of 8 states cannot be simulated and are left out" in said
    assert "7 states are scored" in said and "time was over" not in said
    em.store.score_dataset(authors.dataset(good, "push"), tmp_path / "s.db", nodes=5)
    with ScoreStore(own / "push-scores.db") as one, ScoreStore(tmp_path / "s.db") as other:
        found, whole = (store.run().labelled_scores().scores for store in (one, other))
    rest = np.arange(8) != PUSHED
    for metric, values in found.items():
        assert np.isnan(values[PUSHED])
        assert np.array_equal(values[rest], whole[metric][rest]), metric
    ahead = run_here("score", "push.h5", "--frames", 1, "--metrics", "probability", cwd=own)
    assert ahead.returncode == 0 and "7 states are scored" in " ".join(ahead.stderr.split())


def test_evaluate_and_report_count_it(scored):
    own, _ = scored
    shown = run_here("evaluate", "push-scores.db", "--run", 1, "--draws", 9, cwd=own)
    assert shown.returncode == 0
    assert "1 state has no score and is left out" in " ".join(shown.stdout.split())
    with ScoreStore(own / "push-scores.db") as store:
        result = evaluate(store.run(1).labelled_scores(), draws=2)
    assert result.missing == 1 and result.states["capture"][0].count == 7
    page = run_here("report", "push-scores.db", "--run", 1, "--draws", 9, cwd=own)
    assert page.returncode == 0 and "1 of 8 states" in " ".join(page.stderr.split())


def test_scores_in_python_warn_of_it_or_say_it(folder, tmp_path):
    dataset = authors.dataset(folder, "push")
    words = "1 of 8 states cannot be simulated and are left out; first trajectory 1, frame 1"
    with pytest.warns(em.PlausibilityWarning, match=words):
        assert em.store.score_dataset(dataset, tmp_path / "a.db", ["force"])
    told = []
    known = em.beliefs.Uncertainty(friction=0.05)
    assert em.store.score_dataset(
        *(dataset, tmp_path / "b.db", ["capture"]),
        uncertainty=known,
        particles=2,
        nodes=6,
        notice=told.append,
    )
    assert len(told) == 1 and told[0].startswith(words)


def test_a_dataset_is_scored_though_no_state_of_the_sample_can_be_simulated(tmp_path):
    made = em.datasets.generate("topple", trajectories=4, frames=10, seed=0)
    sample = set(np.linspace(0, made.size - 1, SAMPLE).astype(int).tolist())
    height = em.tasks.make("topple").scene(made.trajectories[0].params).slice("object").start + 2
    trajectories = []
    for t, trajectory in enumerate(made.trajectories):
        states = trajectory.states.copy()
        states[[k for k in range(10) if 10 * t + k in sample], height] = -1.0
        trajectories.append(replace(trajectory, states=states))
    told = []
    assert em.store.score_dataset(
        replace(made, trajectories=trajectories), tmp_path / "s.db", ["force"], notice=told.append
    )
    assert told[0].startswith(f"{SAMPLE} of 40 states")
