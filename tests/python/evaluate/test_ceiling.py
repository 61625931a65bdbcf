import numpy as np
import pytest
from stores import Stop, stop_after

from energymargin import Scene, Sphere, datasets, regions, stream, tasks
from energymargin.records.evaluation.labelled import captured_labels
from energymargin.store import ScoreStore, score_dataset
from energymargin.tasks import Drive, ScriptedTask
from energymargin_paper.evidence.ceiling import (
    CAPTURED,
    ceiling_dataset,
    evaluate_ceiling,
    state_ceiling,
)

CONTINUATIONS, SEED = 5, 3


class Coin(ScriptedTask):
    """A ball in free space is pushed to the right, or to the left, where it is lost."""

    name = "coin"
    length = 0.1
    parameters = {}  # noqa: RUF012
    problem = None

    def scene(self, params):
        made = Scene(gravity=(0, 0, 0))
        made.add_body("object", Sphere(0.1), mass=1.0)
        return made

    def draw(self, random):
        return {"wall": -0.001}

    def start(self, world, params, random):
        return self.scene(params).pack()

    def drive(self, params, random):
        wrenches = np.zeros((self.steps, 6))
        wrenches[:, 0] = 10 if heads(random) else -10
        return Drive({"object": wrenches})

    def captured(self, state, params):
        return regions.HalfSpace("object", (-1, 0, 0), -params["wall"])

    def succeeded(self, params):
        return regions.HalfSpace("object", (-1, 0, 0), 0.0)


def heads(random):
    return random.random() < 0.5


@pytest.fixture(scope="module")
def dataset():
    return datasets.generate("push", trajectories=8, frames=6, seed=0)


@pytest.fixture(scope="module")
def whole(dataset, tmp_path_factory):
    """The labels and shares of an undisturbed run."""
    path = tmp_path_factory.mktemp("ceiling") / "whole.db"
    ceiling_dataset(dataset, path, CONTINUATIONS, SEED, threads=2)
    return shares(path)


def shares(path):
    with ScoreStore(path) as store:
        return store.run().labelled_scores()


def same(labelled, other):
    return all(
        np.array_equal(values, other.scores[name], equal_nan=True)
        for name, values in labelled.scores.items()
    )


def test_an_unsure_end_has_the_share_of_the_continuations_that_end_well():
    task = Coin("coast")
    shares = state_ceiling(task, task.rollout(0, frames=5), 0, continuations=20, seed=1)
    lucky = [heads(np.random.default_rng(stream(1, number))) for number in range(20)]
    assert 0 < np.mean(lucky) < 1
    assert shares["success"] == np.mean(lucky)
    # After 25 ms the ball has gone 3 mm to its side.
    assert shares == {"success": np.mean(lucky), "captured/0": 1.0} | {
        f"captured/{h}": np.mean(lucky) for h in range(1, 6)
    }


def test_a_sure_end_has_the_share_1_and_a_state_that_is_lost_0():
    task = Coin("coast")
    trajectory = task.rollout(0, frames=5)
    trajectory.params["wall"] = -1.0
    assert {
        state_ceiling(task, trajectory, 0, continuations=5)[name] for name in CAPTURED.values()
    } == {1.0}
    trajectory.captured[0] = False
    assert {
        state_ceiling(task, trajectory, 0, continuations=5)[name] for name in CAPTURED.values()
    } == {0.0}


class TwoCoins(Coin):
    """A second ball, which nobody pushes, stays where it is."""

    def scene(self, params):
        made = super().scene(params)
        made.add_body("other", Sphere(0.1), mass=1.0, position=(0, 1, 0))
        return made

    def captured(self, state, params):
        pushed = super().captured(state, params)
        return {"object": pushed, "other": regions.HalfSpace("other", (0, 1, 0), 2.0)}

    def succeeded(self, params):
        return {
            "object": super().succeeded(params),
            "other": regions.HalfSpace("other", (0, 1, 0), 0.5),
        }


def test_at_least_one_object_has_shares_of_its_own():
    task = TwoCoins("coast")
    trajectory = task.rollout(0, frames=5)
    shares = state_ceiling(task, trajectory, 0, continuations=20, seed=1)
    coin = Coin("coast")
    alone = state_ceiling(coin, coin.rollout(0, frames=5), 0, continuations=20, seed=1)
    assert {name: shares[name] for name in CAPTURED.values()} == {
        name: alone[name] for name in CAPTURED.values()
    }
    assert shares["success"] == 0.0
    assert {shares[f"captured/{h}/any"] for h in CAPTURED} == {1.0}
    assert shares["success/any"] == alone["success"]


def test_the_ceiling_of_several_objects_is_held_against_both_labels(tmp_path):
    several = datasets.generate("scoop", trajectories=4, frames=5, seed=0)
    ceiling_dataset(several, tmp_path / "c.db", continuations=2, seed=SEED)
    result = evaluate_ceiling(shares(tmp_path / "c.db"))
    for row in ("ceiling", "ceiling/any"):
        cell = result.states[row][0]
        assert cell is None or cell.auc == cell.ap == 1.0
    assert result.states["ceiling"][0] is not None
    assert result.success is not None and result.success_any is not None


def test_where_nothing_is_left_to_come_the_shares_are_the_labels(dataset, whole):
    for trajectory, states in zip(dataset.trajectories, whole.by_trajectory(), strict=True):
        assert np.array_equal(whole.scores["captured/0"][states], trajectory.captured)
        assert whole.scores["success"][states[-1]] == trajectory.success
        last = whole.scores["captured/5"][states[-1]]
        assert last == captured_labels(trajectory.captured, 5)[-1]


def test_no_ceiling_is_below_a_constant_score_and_at_horizon_0_it_is_perfect(whole):
    result = evaluate_ceiling(whole)
    cells = result.states["ceiling"]
    assert list(cells) == list(CAPTURED) and cells[0].auc == cells[0].ap == 1.0
    for cell in [*cells.values(), result.success]:
        assert cell.auc >= 0.5 and cell.ap >= cell.positives / cell.count


def test_shares_are_the_same_for_any_number_of_threads(dataset, whole, tmp_path):
    ceiling_dataset(dataset, tmp_path / "one.db", CONTINUATIONS, SEED, threads=1)
    assert same(shares(tmp_path / "one.db"), whole)


def test_a_run_that_was_stopped_goes_on_to_the_same_shares(dataset, whole, tmp_path):
    path, counts = tmp_path / "part.db", []
    with pytest.raises(Stop):
        ceiling_dataset(dataset, path, CONTINUATIONS, SEED, progress=stop_after(1))
    with ScoreStore(path) as store:
        kept, total = store.run().counts()
    assert 1 <= kept < total
    ceiling_dataset(
        dataset, path, CONTINUATIONS, SEED, progress=lambda *count: counts.append(count)
    )
    assert counts[0] == (kept, total) and counts[-1] == (total, total)
    assert same(shares(path), whole)


def test_other_settings_are_another_run_in_the_same_file(dataset, tmp_path):
    path = tmp_path / "c.db"
    with pytest.raises(ValueError, match="continuations is 0"):
        ceiling_dataset(dataset, path, 0)
    for continuations in (1, 2, 1):
        assert ceiling_dataset(dataset, path, continuations, SEED)
    with ScoreStore(path) as store:
        assert [run.settings["continuations"] for run in store.runs()] == [1, 2]
        assert all(run.counts() == (48, 48) for run in store.runs())


def test_a_task_without_a_script_is_refused(dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(tasks, "make", lambda *_args, **_kwargs: object())
    with pytest.raises(ValueError, match="'push' has no script"):
        ceiling_dataset(dataset, tmp_path / "c.db")


def test_shares_and_scores_of_a_dataset_share_a_file(dataset, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(dataset, path, ["force"])
    ceiling_dataset(dataset, path, CONTINUATIONS, SEED)
    score_dataset(dataset, path, ["capture"], nodes=1)
    with ScoreStore(path) as store:
        assert [run.counts() for run in store.runs()] == [(dataset.size, dataset.size)] * 3
