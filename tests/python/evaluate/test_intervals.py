"""What a few trees know: their interval, and the tolerance that adds trees."""

import numpy as np
import pytest

import energymargin as em
from energymargin._core import FEWEST_TREES, interval


@pytest.fixture(scope="module")
def problem():
    """A puck on ice between two rims, one of which it slides to."""
    scene = em.Scene()
    scene.add_plane("ice", friction=0.02)
    scene.add_body(
        "puck",
        em.Cylinder(0.04, 0.02),
        mass=0.2,
        position=(0, 0, 0.01),
        friction=0.5,
        role="object",
        linear_factor=(1, 1, 0),
        angular_factor=(0, 0, 1),
    )
    return em.Problem(
        scene,
        scene.pack(puck={"velocity": (0.1, 0.0, 0.0)}),
        force=(0.2, 0.2, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=em.regions.Disc("puck", center=(0, 0), radius=0.1),
        succeeded=em.regions.HalfSpace("puck", normal=(-1, 0, 0), offset=-0.06),
        rate=50.0,
    )


@pytest.fixture(scope="module")
def many(problem):
    """Scores of 200 small trees."""
    return em.capture_score(problem, nodes=30, trees=200, threads=2)


def holds(scores, resolution, truth):
    """Whether the 95 % interval of these trees does."""
    low, high = interval(scores, resolution, 0.95)
    return low - 1e-12 <= truth <= high + 1e-12


def stopped_at(scores, tolerance):
    """How many of these trees, shape (sets, trees), `capture_score` grows."""
    errors = [
        scores[:, :n].std(axis=1, ddof=1).max() / np.sqrt(n)
        for n in range(FEWEST_TREES, scores.shape[1] + 1)
    ]
    met = np.flatnonzero(np.array(errors) <= tolerance)
    return FEWEST_TREES + int(met[0]) if len(met) else scores.shape[1]


@pytest.mark.parametrize("which", ["capture", "success"])
@pytest.mark.parametrize("k", [4, 8, 20])
def test_nineteen_of_twenty_intervals_hold_the_truth(many, which, k):
    scores = getattr(many, f"{which}_by_tree")
    assert scores.std() > many.resolution  # the trees differ
    picked = scores[np.random.default_rng(0).integers(len(scores), size=(1000, k))]
    share = np.mean([holds(trees, many.resolution, scores.mean()) for trees in picked])
    assert 0.9 <= share <= 0.99


def test_trees_that_stop_at_the_tolerance_hold_it_as_often(many):
    scores = np.array([many.capture_by_tree, many.success_by_tree])
    random, held, grown = np.random.default_rng(0), np.zeros((300, 2)), np.zeros(300)
    for draw in range(300):
        picked = scores[:, random.integers(200, size=200)]
        count = stopped_at(picked, 0.02)
        grown[draw] = count
        held[draw] = [
            holds(own[:count], many.resolution, all_trees.mean())
            for own, all_trees in zip(picked, scores, strict=True)
        ]
    assert (held.mean(axis=0) >= 0.9).all() and FEWEST_TREES < grown.mean() < 200


def test_the_interval_of_a_score_is_that_of_its_trees(many):
    low, high = many.interval()
    assert (low, high) == many.interval(which="capture", confidence=0.95)
    assert low < many.capture < high
    wide = many.interval(confidence=0.999)
    assert wide[0] < low and high < wide[1]
    mean, half = many.capture, 1.972 * many.capture_stderr  # Student's t of 200 trees
    width = half**2 / (mean * (1.0 - mean))
    middle, wilson = mean + 0.5 * width, half * np.sqrt(1.0 + 0.25 * width / (mean * (1.0 - mean)))
    ends = np.array([middle - wilson, middle + wilson]) / (1.0 + width)
    assert low == pytest.approx(min(ends[0], mean - half), abs=1e-4)
    assert high == pytest.approx(max(ends[1], mean + half), abs=1e-4)


def test_a_tolerance_takes_as_many_trees_as_the_rule_says_on_any_number_of_threads(problem, many):
    scores = np.array([many.capture_by_tree, many.success_by_tree])
    expected = stopped_at(scores, 0.02)
    assert FEWEST_TREES < expected < 200
    for threads in (1, 2, 3):
        score = em.capture_score(problem, nodes=30, tolerance=0.02, threads=threads)
        assert score.complete and len(score.trees) == expected
        assert np.array_equal(score.capture_by_tree, many.capture_by_tree[:expected])
        assert max(score.capture_stderr, score.success_stderr) <= 0.02


def test_a_tolerance_that_is_not_met_is_not_complete(problem):
    score = em.capture_score(problem, nodes=10, tolerance=1e-9, trees=9)
    assert not score.complete and len(score.trees) == 9
    assert not em.capture_score(problem, nodes=10, tolerance=1e-9, timeout=0.2).complete


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"tolerance": 0}, "tolerance is 0, expected"),
        ({"tolerance": -0.1}, "tolerance is -0.1, expected"),
        ({"tolerance": "low"}, "tolerance is 'low', expected"),
        ({"tolerance": 0.1, "trees": 3}, "trees with a tolerance is 3, expected .* at least 8"),
    ],
)
def test_a_tolerance_that_cannot_be_is_refused_by_value(problem, wrong, words):
    with pytest.raises(ValueError, match=words):
        em.capture_score(problem, **wrong)


def test_one_tree_and_a_set_that_is_not_there_have_no_interval(problem):
    with pytest.raises(ValueError, match="trees is 1, expected two or more"):
        em.capture_score(problem, nodes=5).interval()
    score = em.capture_score(problem, nodes=5, trees=2)
    with pytest.raises(ValueError, match="which is 'capture_any', expected a set that"):
        score.interval(which="capture_any")
    with pytest.raises(ValueError, match="confidence is 1, expected"):
        score.interval(confidence=1)
