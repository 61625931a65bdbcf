"""Scores that are learned from a store: what they say, what they refuse, what they keep."""

import json

import numpy as np
import pytest
from command_line import run_here

import energymargin as em
from energymargin.act.surrogates.model import Model, conformal
from energymargin.monitor import Alarm, Conditions
from energymargin.store import ScoreStore


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A dataset of balance and its probabilities."""
    place = tmp_path_factory.mktemp("surrogate")
    dataset = em.datasets.generate("balance", trajectories=80, seed=1)
    dataset.save(place / "balance.h5")
    path, ahead = place / "balance-scores.db", em.datasets.Future(2)
    em.store.score_dataset(dataset, path, ["probability"], future=ahead, rollouts=10)
    return place


@pytest.fixture(scope="module")
def dataset(folder):
    return em.datasets.load(folder / "balance.h5")


@pytest.fixture(scope="module")
def surrogate(folder, dataset):
    with ScoreStore(folder / "balance-scores.db") as store:
        return em.Surrogate.learn(store.run(), dataset)


def estimates(surrogate, trajectory):
    return surrogate(trajectory.states, params=trajectory.params, time=trajectory.times)


def model_of(features, scores, trajectories, *, limits=(0, 1), monotone=(0, 0), coverage=0.9):
    """A model of states of so many trajectories, of which none has a label."""
    numbers = np.repeat(np.arange(trajectories), len(scores) // trajectories)
    labels = np.full(len(scores), np.nan)
    return Model(features, scores, numbers, labels, np.array(limits), monotone, coverage, seed=0)


def made(states=2000, trajectories=100, **options):
    """A model of features x and y whose score is the logistic of 3 x, and y is noise."""
    random = np.random.default_rng(0)
    features = random.normal(size=(states, 2))
    scores = random.binomial(30, 1 / (1 + np.exp(-3 * features[:, 0]))) / 30
    return model_of(features, scores, trajectories, **options), features, scores


def test_it_predicts_and_is_calibrated_on_trajectories_it_did_not_learn_from(surrogate):
    good = surrogate.quality
    assert good.trajectories == 16
    assert good.auc > good.auc_of_scores - 0.03
    assert good.calibration_error < 0.08
    assert good.coverage > 0.75
    assert good.refused < 0.25


def test_no_trajectory_is_in_the_test_and_elsewhere():
    model, *_ = made(states=350, trajectories=50)
    numbers = np.repeat(np.arange(50), 7)
    tested, others = (set(numbers[part].tolist()) for part in (model.test, ~model.test))
    assert len(tested) == 10 and not tested & others


def test_intervals_hold_in_new_trajectories_whose_errors_are_alike():
    """The mean over 200 calibrations of 40 trajectories, within three standard errors."""
    random = np.random.default_rng(0)
    held = []
    for _ in range(200):
        errors = np.abs(random.normal(size=40))[:, None] * random.uniform(0.5, 1.5, size=(40, 8))
        width = conformal(errors.ravel(), np.repeat(np.arange(40), 8), 0.9)
        new = np.abs(random.normal(size=400)) * random.uniform(0.5, 1.5, size=400)
        held.append(np.mean(new <= width))
    error = np.std(held) / np.sqrt(len(held))
    assert 0.9 - 3 * error < np.mean(held) < 0.95


def test_too_few_trajectories_say_nothing():
    assert conformal(np.arange(10.0), np.arange(10), 0.9) == 9.0
    assert conformal(np.arange(10.0), np.arange(10), 0.95) == np.inf
    model, features, _ = made(trajectories=50, coverage=0.99)
    found = model(features[:20])
    assert (found.low[~found.refused] == 0).all() and (found.high[~found.refused] == 1).all()


def test_scores_that_are_no_probabilities_are_learned_as_they_are():
    random = np.random.default_rng(0)
    features = random.normal(size=(3000, 2))
    joules = 5 + 2 * features[:, 0] + random.normal(size=3000) * 0.1
    model = model_of(features, joules, 100, limits=(-np.inf, np.inf))
    test = model.test
    found = model(features[test])
    held = (found.low <= joules[test]) & (joules[test] <= found.high)
    assert 0.85 < held[~found.refused].mean() < 0.97
    assert np.nanmean(np.abs(found.value - joules[test])) < 0.3


def test_states_unlike_the_training_are_refused(surrogate, dataset):
    trajectory = dataset.trajectories[0]
    moved = trajectory.states.copy()
    moved[:, 0] += 20.0  # m, of the object
    found = surrogate(moved, params=trajectory.params, time=trajectory.times)
    assert found.refused.all()
    assert np.isnan([found.value, found.low, found.high]).all()
    assert not estimates(surrogate, trajectory).refused.all()


def test_one_state_has_the_numbers_that_it_has_among_others(surrogate, dataset):
    trajectory = dataset.trajectories[1]
    several = estimates(surrogate, trajectory)
    one = surrogate(trajectory.states[2], params=trajectory.params, time=trajectory.times[2])
    assert one.value == pytest.approx(several.value[2], abs=1e-12)
    assert one.low <= one.value <= one.high


def test_what_others_are_seen_as_does_not_change_with_the_frame():
    task = em.tasks.make("push", friction=0.3)
    trajectory = task.rollout(0)
    layout = em.surrogates.Layout.of(task.layout)
    bodies = [task.layout.unpack(state) for state in trajectory.states]
    turned = []
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    for state in bodies:
        placed = {
            name: {
                "position": turn @ body["position"] + (3, -1, 0),
                "yaw": body["yaw"] + 0.7,
                "velocity": turn @ body["velocity"],
                "angular_velocity": body["angular_velocity"],
            }
            for name, body in state.items()
        }
        turned.append(task.layout.pack(**placed))
    seen = [name.startswith("effector_in_object") for name in layout.names]
    before = layout.features(trajectory.states)[:, seen]
    after = layout.features(np.array(turned))[:, seen]
    assert before.shape[1] == 7
    assert np.allclose(before, after, atol=1e-3)  # bodies tilt a little, a yaw does not


def test_a_monotone_score_never_falls():
    model, *_ = made(monotone=[1, 0])
    line = np.column_stack([np.linspace(-2, 2, 200), np.zeros(200)])
    assert (np.diff(model.value(line)) >= 0).all()
    free, *_ = made()
    assert (np.diff(free.value(line)) < 0).any()


def test_a_file_keeps_every_bit(surrogate, dataset, tmp_path):
    surrogate.save(tmp_path / "one.npz")
    again = em.Surrogate.load(tmp_path / "one.npz")
    for name in ("value", "low", "high", "refused"):
        found = [getattr(estimates(s, dataset.trajectories[2]), name) for s in (surrogate, again)]
        assert np.array_equal(*found, equal_nan=True)
    assert again.quality == surrogate.quality
    assert again.facts == surrogate.facts


def test_features_of_ones_own_are_asked_for_when_a_file_is_read(folder, dataset, tmp_path):
    def gap(states):
        return states[:, :3] - states[:, 13:16]

    with ScoreStore(folder / "balance-scores.db") as store:
        surrogate = em.Surrogate.learn(store.run(), dataset, features=(gap, ("x", "y", "z")))
    assert surrogate.names == ("x", "y", "z", "time")
    surrogate.save(tmp_path / "own.npz")
    with pytest.raises(ValueError, match="features of its own: give load"):
        em.Surrogate.load(tmp_path / "own.npz")
    again = em.Surrogate.load(tmp_path / "own.npz", features=gap)
    trajectory = dataset.trajectories[0]
    found = [estimates(s, trajectory).value for s in (surrogate, again)]
    assert np.array_equal(*found, equal_nan=True)


def test_another_scene_is_refused_and_a_state_of_its_own_is_not(surrogate, dataset):
    problem = dataset.problems([3], future=em.datasets.Future(2))[0]
    surrogate.require(problem)
    heavier = problem.replace(scene=problem.scene.with_body("object", mass=1.5))
    with pytest.raises(ValueError, match=r"scene.bodies.object.mass = 1.5, but .* with 1.0"):
        surrogate.require(heavier)
    with pytest.raises(ValueError, match="horizon"):
        surrogate.require(problem.replace(horizon=0.1, plan=None))


def test_the_problems_that_it_learned_from_are_its_own_in_any_state(surrogate, dataset):
    """Also where they touch other things: contacts are of a state."""
    ahead = em.datasets.Future(2)
    states = dataset.trajectories[5].states
    for problem in dataset.problems(range(0, 400, 7), future=ahead):
        surrogate.require(problem)
        surrogate.require(problem.with_state(problem.state))
        surrogate.require(problem.with_state(states[3]))


def test_a_damaged_file_says_so_or_says_nothing(surrogate, dataset, tmp_path):
    """Bits that have changed, a part of it, and a part that is not there."""
    path, random = tmp_path / "balance.npz", np.random.default_rng(0)
    surrogate.save(path)
    whole, known = path.read_bytes(), estimates(surrogate, dataset.trajectories[70])
    refused = 0
    for case in range(120):
        content = bytearray(whole)
        if case % 3 == 0:
            content[random.integers(len(whole))] ^= 1 << int(random.integers(8))
        elif case % 3 == 1:
            del content[random.integers(len(whole)) :]
        else:  # near the end, where the archive has its table
            content[-random.integers(1, 1500)] = random.integers(256)
        path.write_bytes(content)
        try:
            loaded = em.Surrogate.load(path)
        except ValueError as error:
            refused += 1
            assert str(error).startswith(f"{path} is no surrogate that can be used: ")
        else:
            found = estimates(loaded, dataset.trajectories[70])
            assert np.array_equal(found.value, known.value, equal_nan=True)
    assert refused > 40


def without(about, name):
    return {key: value for key, value in about.items() if key != name}


CHANGES = {
    "no facts": lambda arrays, about: (arrays, without(about, "facts")),
    "no source": lambda arrays, about: (arrays, without(about, "source")),
    "a list": lambda arrays, about: (arrays, [about]),
    "names that are none": lambda arrays, about: (arrays, about | {"names": 3}),
    "fewer names": lambda arrays, about: (
        arrays,
        about | {"given": [], "names": about["names"][:9]},
    ),
    "another layout": lambda arrays, about: (arrays, about | {"layout": {"bodies": 1}}),
    "no scores": lambda arrays, about: (without(arrays, "scores"), about),
    "more": lambda arrays, about: (arrays | {"more": np.zeros(3)}, about),
    "features of text": lambda arrays, about: (arrays | {"features": np.array("a")}, about),
    "states of no trajectory": lambda arrays, about: (
        arrays | {"trajectory": arrays["trajectory"][:-1]},
        about,
    ),
    "scores of others": lambda arrays, about: (arrays | {"scores": arrays["scores"][:-2]}, about),
    "labels of others": lambda arrays, about: (arrays | {"labels": arrays["labels"][:-2]}, about),
    "no limits": lambda arrays, about: (arrays | {"limits": np.zeros(0)}, about),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_a_file_that_lacks_what_belongs_together_says_so(surrogate, tmp_path, change):
    path = tmp_path / "balance.npz"
    surrogate.save(path)
    with np.load(path) as file:
        arrays = dict(file)
    arrays, about = change(without(arrays, "text"), json.loads(str(arrays["text"])))
    np.savez(path, **arrays | {"text": np.array(json.dumps(about))})
    with pytest.raises(ValueError, match=r"balance\.npz is no surrogate that can be used: "):
        em.Surrogate.load(path)


def test_bad_input_is_named(surrogate, dataset, folder, tmp_path):
    states = dataset.trajectories[0].states
    with pytest.raises(ValueError, match="time is missing"):
        surrogate(states)
    with pytest.raises(ValueError, match=r"states is .*, expected finite .*shape \(N, 26\)"):
        surrogate(states[:, 1:], time=0.0)
    with pytest.raises(ValueError, match=r"states is .*nan.*, expected finite"):
        surrogate(states * np.nan, time=0.0)
    with pytest.raises(ValueError, match=r"time is \[0.0, 1.0, 2.0\], expected one number, or 10"):
        surrogate(states, time=[0.0, 1.0, 2.0])
    with ScoreStore(folder / "balance-scores.db") as store:
        run = store.run()
        with pytest.raises(ValueError, match="'nothing' is no feature"):
            em.Surrogate.learn(run, dataset, monotone={"nothing": 1})
        with pytest.raises(
            ValueError, match="metric is 'capture', expected one that has scores: probability"
        ):
            em.Surrogate.learn(run, dataset, "capture")
        other = em.datasets.generate("balance", trajectories=2, seed=5)
        with pytest.raises(ValueError, match="is not the dataset that run 1"):
            em.Surrogate.learn(run, other)
    np.savez(tmp_path / "other.npz", states=states)
    for other in (folder / "balance.h5", tmp_path / "other.npz"):
        with pytest.raises(ValueError, match="is no surrogate that can be used"):
            em.Surrogate.load(other)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 1}, r"it has version 1, expected 2: learn it again"),
        ({"source": {"algorithm": "0.13.0"}}, r"algorithm 0.13.0, expected .*: score the dataset"),
    ],
)
def test_a_file_of_another_version_or_of_other_scores_is_refused(
    surrogate, tmp_path, change, words
):
    surrogate.save(tmp_path / "old.npz")
    with np.load(tmp_path / "old.npz") as file:
        arrays = dict(file)
    about = json.loads(str(arrays["text"])) | change
    np.savez(tmp_path / "old.npz", **arrays | {"text": np.array(json.dumps(about))})
    with pytest.raises(ValueError, match=rf"old\.npz is no surrogate .*{words}"):
        em.Surrogate.load(tmp_path / "old.npz")


def test_scores_of_elsewhere_are_learned(dataset, tmp_path):
    """In joules, and infinite where there is no way out."""
    gaps = np.concatenate([states[:, 0] - states[:, 13] for states in all_states(dataset)])
    joules = np.where(gaps > 0.3, np.inf, np.minimum(5 * np.abs(gaps), 2))
    told = {"source": "here"}
    number = em.store.add_scores(tmp_path / "e.db", dataset, {"escape": joules}, settings=told)
    with ScoreStore(tmp_path / "e.db") as store:
        surrogate = em.Surrogate.learn(store.run(number), dataset, "escape")
    found = surrogate(np.concatenate(all_states(dataset)))
    known = np.isfinite(joules) & ~found.refused
    assert 0 < np.isinf(joules).sum() < len(joules)
    assert np.corrcoef(found.value[known], joules[known])[0, 1] > 0.8


def all_states(dataset):
    return [trajectory.states for trajectory in dataset.trajectories]


def test_few_trajectories_are_refused():
    with pytest.raises(ValueError, match="scores of 10 trajectories, expected at least 50"):
        made(trajectories=10)


def test_the_command_learns_shows_how_good_it_is_and_writes_the_same(folder, surrogate, dataset):
    done = run_here("learn", "balance-scores.db", "-o", "b.npz", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "calibration error" in done.stdout
    again = em.Surrogate.load(folder / "b.npz")
    found = [estimates(s, dataset.trajectories[4]).value for s in (surrogate, again)]
    assert np.array_equal(*found, equal_nan=True)
    assert run_here("learn", "balance-scores.db", "-o", "b.npz", cwd=folder).returncode == 2


def readings(task, trajectory, first_look=None, **options):
    """Of a monitor that waits for each state."""

    def question(state, time):
        return task.future(state, time, trajectory.params, 0.55)

    options = {"alarm": Alarm(0.3, 0.7), "rollouts": 10, "period": 10.0} | options
    with em.Monitor(question, first_look=first_look, **options) as monitor:
        for time, state in zip(trajectory.times, trajectory.states, strict=True):
            monitor.push(time, state)
            monitor.wait()
        return monitor.history, monitor.counters


def test_a_monitor_takes_rollouts_only_where_the_first_look_is_unsure(surrogate):
    task = em.tasks.make("balance")
    trajectory = task.rollout(1001, frames=30)

    def look(state, time):
        return surrogate(state, params=trajectory.params, time=time)

    history, counters = readings(task, trajectory, look)
    plain, _ = readings(task, trajectory)
    assert (len(history), counters.scored, counters.failed) == (30, 30, 0)
    for reading, rolled in zip(history, plain, strict=True):
        if reading.rollouts:
            assert reading.value == rolled.value
        else:
            assert reading.interval[1] < 0.3 or reading.interval[0] >= 0.7
            assert reading.probability is None
    without = sum(reading.rollouts == 0 for reading in history)
    assert 0 < without == counters.foreseen
    assert sum(a.alarm != b.alarm for a, b in zip(history, plain, strict=True)) <= 3


def test_a_monitor_leaves_states_that_the_first_look_refuses_to_rollouts(surrogate):
    task = em.tasks.make("balance")
    trajectory = task.rollout(1001, frames=5)

    def far(state, time):
        return surrogate(state + 50.0 * (np.arange(26) == 0), time=time)

    history, counters = readings(task, trajectory, far)
    assert (counters.foreseen, counters.refused) == (0, 5)
    assert all(reading.rollouts == 10 for reading in history)


def test_a_first_look_needs_an_alarm_and_no_threshold_of_rollouts(surrogate):
    for alarm in (None, Alarm(0.5, from_data=True, conditions=Conditions(10, 0.55, 10.0))):
        with pytest.raises(ValueError, match="but a first look needs an alarm of a number"):
            em.Monitor(
                lambda s, t: None,
                alarm=alarm,
                rollouts=10,
                period=10.0,
                first_look=lambda s, t: surrogate(s, time=t),
            )
