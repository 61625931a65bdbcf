"""What comes through the Python door: errors that name the argument, and regions of one's own."""

import os
import re
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

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
        ({"mass": "1"}, "mass is '1', expected a real number"),
        ({"mass": 1, "yaw": "left"}, "yaw is 'left', expected a real number"),
        ({"mass": 1, "friction": [0.3]}, r"friction is \[0.3\], expected a real number"),
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


@pytest.mark.parametrize(
    ("joints", "bodies"),
    [(None, {"\ud800": {}}), (None, {"object": {"\ud800": 1}}), ({"\ud800": 1}, {}), ({3: 1}, {})],
)
def test_a_name_that_is_no_text_is_refused_as_what_it_is(problem, joints, bodies):
    with pytest.raises(
        ValueError, match=r"is ('\\ud800', expected a str that UTF-8|3, expected a str)"
    ):
        problem.scene.pack(joints=joints, **bodies)


def test_the_value_in_an_error_is_cut_between_two_characters():
    with pytest.raises(ValueError, match=r"^size is 'xé{55}\.\.\., expected an array"):
        em.Box("x" + "é" * 80)


def test_a_path_with_a_zero_byte_is_not_that_of_the_file_before_it(problem, tmp_path):
    problem.save(tmp_path / "problem.json")
    for call in (em.Problem.load, problem.save):
        with pytest.raises(ValueError, match="path has a zero byte"):
            call(f"{tmp_path}/problem.json\0.txt")


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


@pytest.mark.parametrize("answer", [lambda z: np.ones(len(z) + 1, dtype=bool), lambda z: z[:, 0]])
def test_a_predicate_that_does_not_answer_with_a_bool_a_state_is_refused(problem, answer):
    with pytest.raises(ValueError, match=r"not an array of bool of shape \(11,\)"):
        em.capture_score(with_captured(problem, em.regions.Predicate(answer)), nodes=10)


@pytest.mark.parametrize("wrong", [("1", "1", "1"), (1j, 1, 1), (True, True, True), "1"])
def test_what_is_no_real_number_is_not_read_as_one(wrong):
    with pytest.raises(ValueError, match=r"size is .* expected an array of real numbers"):
        em.Box(wrong)


def test_two_threads_that_share_a_world_get_the_answers_of_one(problem):
    world = em.World(problem.scene)
    wrenches = np.random.default_rng(0).uniform(-0.5, 0.5, (60, 6)) * (1, 1, 0, 0, 0, 0.1)
    alone = [world.rollout(problem.state, wrench, 0.2).state for wrench in wrenches]
    with ThreadPoolExecutor(4) as pool:
        shared = pool.map(lambda wrench: world.rollout(problem.state, wrench, 0.2).state, wrenches)
        assert all(np.array_equal(a, b) for a, b in zip(alone, shared, strict=True))


def test_what_is_done_to_the_scene_of_a_problem_does_not_reach_the_problem(problem):
    bodies = len(problem.scene.bodies)
    problem.scene.add_body("late", em.Sphere(0.1), mass=0, position=(9, 9, 9))
    assert len(problem.scene.bodies) == bodies


def test_ctrl_c_while_numbers_are_read_is_no_complaint_about_them():
    class Interrupted:
        def __array__(self, *_arguments, **_keywords):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        em.Box(Interrupted())


def test_a_run_that_is_dropped_while_a_predicate_is_asked_ends():
    script = """
import energymargin as em, energymargin._core as core, numpy as np, time
task = em.tasks.make("push", friction=0.3)
p = task.problem(task.rollout(1).states[1])
inside = em.regions.Predicate(lambda z: np.ones(len(z), dtype=bool))
q = em.Problem(p.scene, p.state, force=p.force, torque=p.torque, duration=0.5, captured=inside)
run = core.ScoreRun(["effort/est"], 200, 0, 2)
run.add([q] * 20, range(20))
time.sleep(0.2)
del run
"""
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60)


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


@pytest.mark.parametrize("score", [em.capture_score, em.escape_effort])
def test_ctrl_c_ends_a_long_search(problem, score):
    everywhere = em.regions.Ball("object", center=(0, 0, 0), radius=1e6)
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        score(with_captured(problem, everywhere), nodes=100_000)


def test_results_and_what_they_are_of_show_themselves_at_the_prompt():
    task = em.tasks.make("push")
    trajectory = task.rollout(1)
    problem = task.problem(trajectory.states[2], trajectory.params, trajectory.contacts[2])
    scene = "Scene(bodies=['table', 'wall', 'object', 'effector'], joints=0, dimension=26)"
    assert repr(problem.scene) == scene
    assert repr(problem) == f"Problem(scene={scene}, effector='drive', rate=5.0)"
    cancel = em.Cancel()
    cancel.set()
    score = em.capture_score(problem, nodes=10, cancel=cancel)
    assert repr(score) == (
        f"CaptureScore(capture={score.capture!r}, success={score.success!r}, "
        f"resolution={score.resolution!r}, undisturbed_exit={score.undisturbed_exit!r}, nodes=0, "
        "steps=0, unconverged=0, lost_time=0.0, complete=False)"
    )
    assert repr(score.tree) == "Tree(nodes=0, dimension=26)"


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ({"drives": {"effector": np.zeros((3, 6))}}, "drives['effector'] is 3 rows, expected 5"),
        ({"drives": {"table": np.zeros((5, 6))}}, "drives['table'] is on a fixed body"),
        ({"drives": {"effector": np.full((5, 6), np.nan)}}, "drives['effector'] is not finite"),
    ],
)
def test_a_script_that_cannot_be_is_refused_by_the_name_it_came_by(problem, script, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        em.World(problem.scene).simulate(problem.state, 5, **script)


def grip(**keywords):
    """A block on a table between a hand and a wall, whose coefficients are 0.5, 0.4, 0.8 and 1."""
    scene = em.Scene(**keywords)
    scene.add_plane("table", friction=0.5)
    scene.add_body(
        "block", em.Box((0.1, 0.1, 0.1)), mass=1, position=(0, 0, 0.05), friction=0.4, role="object"
    )
    scene.add_body(
        "hand",
        em.Box((0.1, 0.1, 0.1)),
        mass=1,
        position=(0, -0.1, 0.05),
        friction=0.8,
        role="effector",
    )
    scene.add_body("wall", em.Box((0.1, 0.1, 0.1)), mass=0, position=(0, 0.1, 0.05), friction=1)
    return scene


@pytest.mark.parametrize(("rule", "ground"), [("product", 0.2), ("max", 0.5)])
def test_the_force_score_reads_the_friction_of_the_rule_or_of_the_pair(rule, ground):
    scene = grip(friction_rule=rule)
    assert (
        scene.contact_friction("block", "table")
        == scene.contact_friction("table", "block")
        == ground
    )

    def ground_stick(scene):
        problem = em.Problem(
            scene,
            scene.pack(),
            force=(1, 1, 0),
            torque=(0, 0, 0),
            duration=0.1,
            captured=em.regions.Ball("block", center=(0, 0, 0.05), radius=1),
        )
        return em.force_score(problem).ground.stick

    weight = 9.81
    assert ground_stick(scene) == pytest.approx(weight * ground / np.hypot(1, ground), rel=1e-2)
    scene.set_friction("table", "block", 0.1)
    assert ground_stick(scene) == pytest.approx(weight * 0.1 / np.hypot(1, 0.1), rel=1e-2)


def test_the_friction_of_a_pair_is_set_listed_and_kept_beside_the_friction_of_its_bodies():
    scene = grip(friction_rule="max")
    assert scene.friction_rule == "max"
    assert scene.pair_frictions == {}
    scene.set_friction("hand", "block", 0.3)
    scene.set_friction("block", "hand", 0.7)
    assert scene.pair_frictions == {("block", "hand"): 0.7}
    other = scene.with_body("hand", friction=0.9)
    assert (other.friction_rule, other.pair_frictions) == ("max", {("block", "hand"): 0.7})
    assert other.contact_friction("hand", "block") == 0.7
    assert other.contact_friction("hand", "table") == 0.9
    assert "friction_rule='max'" in repr(scene)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: em.Scene(friction_rule="min"),
            "friction_rule is 'min', expected 'product' or 'max'",
        ),
        (lambda: grip().set_friction("hand", "cup", 0.1), "body is 'cup', expected one of 'table'"),
        (
            lambda: grip().set_friction("hand", "hand", 0.1),
            "body_b is 'hand', expected another body",
        ),
        (lambda: grip().set_friction("hand", "block", -1), "friction is -1, expected"),
        (lambda: grip().set_friction("hand", "block", float("nan")), "friction is nan, expected"),
        (lambda: grip().set_friction("hand", "block", "rough"), "friction is 'rough', expected"),
        (lambda: grip().contact_friction("hand", "cup"), "body is 'cup', expected one of 'table'"),
    ],
)
def test_friction_that_cannot_be_is_refused_by_name_and_value(make, words):
    with pytest.raises((ValueError, TypeError), match=re.escape(words)):
        make()
