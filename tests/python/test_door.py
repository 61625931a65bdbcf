"""What comes through the Python door: errors that name the argument, and regions of one's own."""

import numpy as np
import pytest

import energymargin as em


@pytest.fixture(scope="module")
def problem():
    task = em.tasks.make("push", friction=0.3)
    return task.problem(task.rollout(1).states[1])


@pytest.mark.parametrize("score", [em.capture_score, em.escape_effort])
@pytest.mark.parametrize(
    ("argument", "value"), [("nodes", 0), ("nodes", "many"), ("nodes", 2.5), ("seed", -1)]
)
def test_a_number_that_cannot_be_is_refused_by_name_and_value(problem, score, argument, value):
    with pytest.raises(ValueError, match=f"{argument} is {value!r}, expected a whole number"):
        score(problem, **{argument: value})


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"mass": -1}, "mass is -1, expected"),
        ({"mass": float("nan")}, "mass is nan, expected"),
        ({"mass": 1, "position": (0, 0)}, r"position is an array of shape \(2,\), expected"),
        ({"mass": 1, "orientation": (0, 0, 0, 2)}, r"orientation is \(0, 0, 0, 2\), expected"),
        ({"mass": 1, "friction": -0.1}, "friction is -0.1, expected"),
        ({"mass": 1, "role": "hand"}, "role is 'hand', expected"),
        ({"mass": 1, "yaw": 0.1, "orientation": (0, 0, 0, 1)}, "given together with yaw"),
    ],
)
def test_a_body_that_cannot_be_is_refused_with_what_is_wrong(wrong, words):
    with pytest.raises(ValueError, match=words):
        em.Scene().add_body("body", em.Box((1, 1, 1)), **wrong)


def test_a_state_with_a_nan_is_refused_by_the_body_that_has_it(problem):
    state = problem.state.copy()
    state[problem.scene.slice("effector")][1] = np.nan
    with pytest.raises(ValueError, match=r"body 'effector': position is .*nan"):
        em.World(problem.scene).rollout(state, np.zeros(6), 0.1)


def test_pack_and_unpack_are_each_others_inverse(problem):
    scene = problem.scene
    bodies = scene.unpack(problem.state)
    for body in bodies.values():
        del body["yaw"]
    assert np.array_equal(scene.pack(**bodies), problem.state)
    assert scene.unpack(scene.pack(object={"yaw": 0.3}))["object"]["yaw"] == pytest.approx(0.3)
    with pytest.raises(ValueError, match=r"body is 'cup', expected one of 'table', 'wall'"):
        scene.pack(cup={"yaw": 0.3})


def with_captured(problem, captured):
    return em.Problem(
        problem.scene,
        problem.state,
        force=problem.force,
        torque=problem.torque,
        duration=problem.duration,
        captured=captured,
        effector=problem.effector,
    )


def test_a_predicate_gives_the_scores_of_the_region_that_it_computes(problem):
    centre, radius = problem.state[:3].copy(), 0.1
    ball = with_captured(problem, em.regions.Ball("object", centre, radius))
    own = with_captured(
        problem,
        em.regions.Predicate(
            lambda states: np.linalg.norm(states[:, :3] - centre, axis=1) <= radius
        ),
    )
    assert em.capture_score(ball, nodes=40).capture == em.capture_score(own, nodes=40).capture
    assert em.escape_effort(ball, nodes=40).effort == em.escape_effort(own, nodes=40).effort
    table = em.score([own, own], metrics=["capture"], nodes=40, threads=2)
    assert len(table) == 2


def test_a_predicate_that_fails_ends_the_search_with_its_own_words(problem):
    def fails(_states):
        raise RuntimeError("no such thing")

    with pytest.raises(RuntimeError, match="no such thing"):
        em.capture_score(with_captured(problem, em.regions.Predicate(fails)), nodes=10)


def test_a_predicate_of_another_shape_is_refused(problem):
    region = em.regions.Predicate(lambda states: np.ones(len(states) + 1, dtype=bool))
    with pytest.raises(ValueError, match=r"another shape than \(11,\)"):
        em.capture_score(with_captured(problem, region), nodes=10)


def test_a_saved_problem_has_the_same_scores_and_a_predicate_cannot_be_saved(problem, tmp_path):
    problem.save(tmp_path / "problem.json")
    again = em.Problem.load(tmp_path / "problem.json")
    assert em.capture_score(again, nodes=40).capture == em.capture_score(problem, nodes=40).capture
    with pytest.raises(ValueError, match="Predicate has no file format"):
        with_captured(problem, em.regions.Predicate(lambda z: z[:, 0] > 0)).save(tmp_path / "no")
    with pytest.raises(OSError, match="cannot write"):
        problem.save(tmp_path / "no folder" / "problem.json")


def test_several_trees_have_a_standard_error_and_one_has_none(problem):
    one, four = (em.capture_score(problem, nodes=40, trees=trees) for trees in (1, 4))
    assert one.capture_stderr is None and four.capture_stderr > 0
    assert len(four.trees) == 4
    assert four.likelihoods.sum() == pytest.approx(1, abs=1e-12)
