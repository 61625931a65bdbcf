"""`reproduce perturbation`: AP with errors in what the scores are computed from."""

import csv
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from command_line import invoke
from scipy.stats import t as student

import energymargin as em
from energymargin.tasks.push import PushTask
from energymargin_paper.paper import perturbation
from energymargin_paper.paper.perturbation import Perturbation, Point
from energymargin_paper.paper.perturbation_errors import KINDS, LARGEST, perturbed, typical

SMALL = perturbation.Settings(trajectories=6, nodes=5, levels=(0.0, 1.0), draws=2)
PLACES = ("position", "orientation", "velocity", "angular_velocity")


@pytest.fixture(scope="module")
def dataset():
    return em.datasets.generate("push", trajectories=6, frames=10, seed=0)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return perturbation.STUDY.reproduce(SMALL, tmp_path_factory.mktemp("perturbation"), threads=1)


def changes(dataset, other):
    """By body and place, how far it is changed in each state, (N, 3 or 4)."""
    layout = PushTask(friction=0.3).scene({"friction": 0.3})
    found = {}
    for before, after in zip(dataset.trajectories, other.trajectories, strict=True):
        for old, new in zip(before.states, after.states, strict=True):
            a, b = layout.unpack(old), layout.unpack(new)
            for body in ("object", "effector"):
                for place in PLACES:
                    found.setdefault((body, place), []).append(b[body][place] - a[body][place])
    return {key: np.array(rows) for key, rows in found.items()}


@pytest.mark.parametrize("kind", KINDS)
def test_no_error_leaves_the_scores_as_they_are_to_the_bit(dataset, kind):
    metric = "force" if kind == "force" else "capture"
    same = perturbed(dataset, kind, 0.0, seed=3)
    plain, own = (
        em.score(one.problems(), [metric], nodes=3, threads=1)[metric]
        for one in (dataset, same.dataset)
    )
    assert np.array_equal(own, plain) and same.again == 0


@pytest.mark.parametrize("kind", KINDS)
def test_the_labels_stay_those_of_the_true_states(dataset, kind):
    other = perturbed(dataset, kind, 1.0, seed=0).dataset
    assert other.labels(0, other.size) == dataset.labels(0, dataset.size)
    assert other.digest() != dataset.digest()


def test_a_friction_error_is_one_draw_a_trajectory_from_zero_up(dataset):
    errors = [
        after.params["friction"] - before.params["friction"]
        for seed in range(20)
        for before, after in zip(
            dataset.trajectories,
            perturbed(dataset, "friction", 0.5, seed).dataset.trajectories,
            strict=True,
        )
    ]
    (largest,) = LARGEST["friction"]
    assert min(errors) >= 0 and max(errors) <= 0.5 * largest.value
    assert np.mean(errors) == pytest.approx(0.25 * largest.value, rel=0.2)


def test_a_velocity_error_is_within_its_bounds_and_changes_nothing_else(dataset):
    found = changes(dataset, perturbed(dataset, "velocity", 1.0, seed=0).dataset)
    speed, turn = (largest.value for largest in LARGEST["velocity"])
    for body in ("object", "effector"):
        moved, turned = found[body, "velocity"], found[body, "angular_velocity"]
        assert 0.9 * speed < abs(moved[:, :2]).max() <= speed
        assert 0.8 * turn < abs(turned[:, 2]).max() <= turn
        assert not moved[:, 2].any() and not turned[:, :2].any()
        assert not found[body, "position"].any() and not found[body, "orientation"].any()


def test_states_with_position_errors_touch_but_do_not_overlap(dataset):
    other = perturbed(dataset, "position", 1.0, seed=0)
    world = em.World(PushTask().scene({"friction": 0.3}))
    pairs = [("object", "effector"), ("object", "wall"), ("effector", "wall")]
    gaps = np.array(
        [
            [world.distance(state, *pair) for pair in pairs]
            for trajectory in other.dataset.trajectories
            for state in trajectory.states
        ]
    )
    assert gaps.min() > -1e-3 and (abs(gaps) < 1e-3).any()
    assert other.again > 0
    found = changes(dataset, other.dataset)
    (largest,) = LARGEST["position"]
    near_the_wall = 0.1  # m; the deepest overlap that it is moved out of
    pushers = abs(found["effector", "position"])
    assert 0.5 * largest.value < pushers.max() <= largest.value + near_the_wall
    assert not found["object", "velocity"].any() and not found["object", "orientation"].any()


def test_a_force_error_is_within_its_bounds_and_no_contact_pulls(dataset):
    other = perturbed(dataset, "force", 1.0, seed=0).dataset
    (largest,) = LARGEST["force"]
    normal, tangential = [], []
    for before, after in zip(dataset.trajectories, other.trajectories, strict=True):
        for old, new in zip(chain(*before.contacts), chain(*after.contacts), strict=True):
            normal.append(new.normal_force - old.normal_force)
            tangential.append(np.asarray(new.tangential_force) - old.tangential_force)
            assert new.normal_force >= 0 and tangential[-1] @ new.normal == pytest.approx(0)
    assert 0.9 * largest.value < max(map(abs, normal)) <= largest.value
    lengths = np.linalg.norm(tangential, axis=1)
    assert largest.value < lengths.max() <= np.sqrt(2) * largest.value


def test_a_draw_has_the_same_directions_at_every_level(dataset):
    half, whole = (
        changes(dataset, perturbed(dataset, "velocity", level, seed=1).dataset)
        for level in (0.5, 1.0)
    )
    for key, values in whole.items():
        assert np.allclose(values, 2 * half[key])


def test_each_largest_error_is_about_the_whole_of_what_it_is_an_error_of():
    found = typical(em.datasets.generate("push", trajectories=50, frames=10, seed=0))
    for kind in KINDS:
        for largest, usual in zip(LARGEST[kind], found[kind], strict=True):
            assert largest.value == pytest.approx(usual, rel=0.06), largest.quantity


def test_it_goes_on_from_an_interruption_to_the_same_numbers(result, tmp_path):
    def stop_half_way(done, total):
        if done >= total / 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        perturbation.STUDY.reproduce(SMALL, tmp_path, threads=1, progress=stop_half_way)
    again = perturbation.STUDY.reproduce(SMALL, tmp_path, threads=1)
    assert again.to_csv() == result.to_csv() == (tmp_path / "perturbation.csv").read_text()
    assert again.to_markdown() == result.to_markdown()


def test_all_curves_of_the_capture_score_start_at_one_point(result):
    starts = {kind: result.curve(kind)[0] for kind in KINDS}
    assert {tuple(starts[kind].ap) for kind in KINDS[:3]} == {tuple(starts["friction"].ap)}
    for point in starts.values():
        assert np.ptp(point.ap) == 0 and point.interval == (point.mean, point.mean)


def made(**aps):
    points = [
        Point(kind, level, np.array(draws), 0)
        for kind, levels in aps.items()
        for level, draws in zip((0.0, 1.0), levels, strict=True)
    ]
    whole = {kind: tuple(largest.value for largest in LARGEST[kind]) for kind in KINDS}
    return Perturbation(replace(SMALL, draws=2), whole, 50, points)


def test_the_interval_is_students():
    draws = np.array([0.80, 0.84, 0.85])
    low, high = Point("friction", 1.0, draws, 0).interval
    half = student.ppf(0.975, 2) * draws.std(ddof=1) / np.sqrt(3)
    assert (low, high) == pytest.approx((draws.mean() - half, draws.mean() + half))


def test_it_says_where_the_capture_score_is_not_above_the_force_score():
    start, good, bad = [0.9, 0.9], [0.8, 0.84], [0.5, 0.52]
    force = [[0.7, 0.7], [0.6, 0.6]]
    fine = made(friction=[start, good], velocity=[start, good], position=[start, good], force=force)
    assert "above the force score with each error at every level" in fine.to_markdown()
    worse = made(friction=[start, good], velocity=[start, bad], position=[start, good], force=force)
    text = worse.to_markdown()
    assert "The capture score is not above the force score with velocity at 1." in text
    assert "0.510 (velocity at 1), is not above the force score's at 0, 0.700" in text


def test_the_command_writes_table_numbers_and_picture(tmp_path):
    command = ["reproduce", "perturbation", "--quick", "--trajectories", "6", "--nodes", "4"]
    done = invoke([*command, "--threads", "1", "-o", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "perturbation.png").stat().st_size > 10_000
    assert (tmp_path / "perturbation.md").read_text().strip() in done.output
    rows = list(csv.DictReader((tmp_path / "perturbation.csv").read_text().splitlines()))
    assert sum(row["source"] == "ours" for row in rows) == len(KINDS) * 3
    assert sum(row["source"] == "paper" for row in rows) == 18
