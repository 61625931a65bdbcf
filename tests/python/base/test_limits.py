"""Timeouts and cancels: what is done counts, and what cannot be half done raises."""

import os
import signal
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest

import energymargin as em
from energymargin import store
from energymargin.evaluate import scoring
from energymargin_paper.evidence import ceiling

MANY = 10**8  # nodes: days
SLACK = 2.0  # s; 0.1 s is what it takes, a busy machine may need longer


@pytest.fixture(scope="module")
def task():
    return em.tasks.make("push", friction=0.3)


@pytest.fixture(scope="module")
def problem(task):
    return task.problem(task.rollout(1).states[1])


@pytest.fixture(scope="module")
def resting(problem):
    """Nothing leaves by itself, so a search for an escape never ends with an effort of 0."""
    still = {"velocity": (0, 0, 0), "angular_velocity": (0, 0, 0)}
    places = {name: {**body, **still} for name, body in problem.scene.unpack(problem.state).items()}
    for body in places.values():
        del body["yaw"]
    captured = em.regions.Ball("object", center=places["object"]["position"], radius=0.1)
    state = problem.scene.pack(**places)
    bounds = {"force": (3, 3, 0), "torque": (0, 0, 0.05), "duration": 0.5}
    return em.Problem(problem.scene, state, **bounds, captured=captured, succeeded=captured)


@pytest.fixture(scope="module")
def dataset(task):
    return em.datasets.generate(task, trajectories=2, frames=4, seed=1)


def cancelled(after=None):
    """A cancel that is set, or will be after some seconds."""
    cancel = em.Cancel()
    if after is None:
        cancel.set()
    else:
        threading.Timer(after, cancel.set).start()
    return cancel


@contextmanager
def ends_within(seconds):
    start = time.monotonic()
    yield
    assert time.monotonic() - start < seconds + SLACK


def test_a_cancel_is_set_once_and_for_all():
    cancel = em.Cancel()
    assert not cancel.is_set and repr(cancel) == "Cancel(is_set=False)"
    cancel.set()
    cancel.set()
    assert cancel.is_set and issubclass(em.Cancelled, RuntimeError)


ROUNDS = {"nodes_per_round": 16, "threads": 2}
LONG = {
    "capture": lambda problem, **limit: em.capture_score(problem, nodes=MANY, **limit),
    "rounds": lambda problem, **limit: em.capture_score(problem, nodes=MANY, **ROUNDS, **limit),
    "est": lambda problem, **limit: em.escape_effort(problem, planner="est", nodes=MANY, **limit),
    "rrt": lambda problem, **limit: em.escape_effort(problem, planner="rrt", nodes=MANY, **limit),
}


@pytest.mark.parametrize("search", LONG)
@pytest.mark.parametrize("how", ["timeout", "cancel"])
def test_a_search_that_is_ended_gives_the_bits_of_one_of_so_many_nodes(resting, search, how):
    found, seconds = None, 0.2
    while found is None or found.nodes == 0:
        limit = {"timeout": seconds} if how == "timeout" else {"cancel": cancelled(after=seconds)}
        with ends_within(seconds):
            found = LONG[search](resting, **limit)
        seconds *= 2
    assert not found.complete and 0 < found.nodes < MANY
    if search in ("capture", "rounds"):
        rounds = ROUNDS if search == "rounds" else {}
        whole = em.capture_score(resting, nodes=found.nodes, **rounds)
        assert (whole.capture, whole.success) == (found.capture, found.success)
    else:
        whole = em.escape_effort(resting, planner=search, nodes=found.nodes)
        assert whole.history == found.history and whole.effort == found.effort > 0
    assert whole.complete and whole.nodes == found.nodes
    for name in ("states", "costs", "parents", "controls", "durations"):
        assert np.array_equal(getattr(whole.tree, name), getattr(found.tree, name)), name


@pytest.mark.parametrize("search", LONG)
def test_a_search_that_gets_no_node_is_its_root_alone(problem, search):
    found = LONG[search](problem, cancel=cancelled())
    assert found.nodes == 0 and not found.complete
    assert np.array_equal(found.tree.states, problem.state[None])


def test_of_several_trees_those_that_are_complete_count(problem):
    found, seconds = None, 0.2
    while found is None or len(found.trees) < 3:
        found = em.capture_score(problem, nodes=30, trees=10**6, threads=2, timeout=seconds)
        seconds *= 2
    whole = em.capture_score(problem, nodes=30, trees=len(found.trees))
    assert not found.complete and whole.complete
    assert np.array_equal(found.capture_by_tree, whole.capture_by_tree)
    assert found.interval() == whole.interval() and found.capture == whole.capture


@pytest.mark.parametrize("planner", ["bit*", "rrt*"])
def test_the_escape_energy_is_the_best_so_far(planner):
    side, bottom = em.Box((0.01, 0.2, 0.06)), em.Box((0.2, 0.2, 0.01))
    pen = em.Compound([em.Part(side, (0.1, 0, 0.03)), em.Part(side, (-0.1, 0, 0.03)),
                       em.Part(bottom, (0, 0, 0.005))])  # fmt: skip
    scene = em.Scene()
    scene.add_body("pen", pen, mass=0)
    scene.add_body("ball", em.Sphere(0.02), mass=0.05, position=(0, 0, 0.03), role="object",
                   linear_factor=(1, 0, 1), angular_factor=(0, 0, 0))  # fmt: skip
    problem = em.Problem(scene, scene.pack(), force=(0.3, 0, 0.3), torque=(0, 0, 0), duration=0.2,
                         captured=em.regions.Disc("ball", center=(0, 0), radius=0.15))  # fmt: skip
    nothing = em.escape_energy(problem, planner=planner, samples=MANY, cancel=cancelled())
    assert (nothing.samples, nothing.energy, nothing.complete) == (0, np.inf, False)
    found, seconds = nothing, 0.2
    while not found.history:
        with ends_within(seconds):
            found = em.escape_energy(problem, planner=planner, samples=MANY, timeout=seconds)
        seconds *= 2
    assert found.energy == found.history[-1][1] < np.inf and len(found.path)
    assert not found.complete and 0 < found.samples < MANY


def test_a_table_has_the_rows_that_are_done_with_the_scores_of_the_whole(dataset):
    problems = dataset.problems() * 100
    table, seconds = None, 0.3
    while table is None or len(table) == 0:
        with ends_within(seconds):
            table = em.score(problems, ["capture", "effort/est"], nodes=30, timeout=seconds)
        seconds *= 2
    assert 0 < len(table) < len(problems) and not table.complete
    some = table.index[:5].tolist()
    again = em.score([problems[i] for i in some], table.scores, nodes=30, indices=some)
    assert again.complete
    for metric in table.scores:
        assert np.array_equal(again[metric], table[metric][:5])
    assert len(em.score(problems, ["capture"], nodes=30, cancel=cancelled())) == 0


def test_a_file_of_scores_goes_on_after_a_timeout(dataset, tmp_path):
    half, whole = tmp_path / "half.db", tmp_path / "whole.db"
    settings = em.SearchSettings(nodes=30)
    assert not store.score_dataset(
        dataset, half, ["capture"], settings=settings, cancel=cancelled()
    )
    assert store.score_dataset(dataset, half, ["capture"], settings=settings, timeout=600)
    assert store.score_dataset(dataset, whole, ["capture"], settings=settings)
    with store.ScoreStore(half) as a, store.ScoreStore(whole) as b:
        values = [s.run().labelled_scores().scores["capture"] for s in (a, b)]
    assert np.array_equal(*values)


def test_a_dataset_has_the_first_trajectories_those_that_are_done(task):
    short, seconds = None, 0.5
    while short is None:
        try:
            with ends_within(seconds):
                short = em.datasets.generate(task, trajectories=10**6, timeout=seconds)
        except TimeoutError:  # not even one
            seconds *= 2
    count = len(short.trajectories)
    assert short.digest() == em.datasets.generate(task, trajectories=count).digest()
    with pytest.raises(em.Cancelled, match="before one trajectory was done"):
        em.datasets.generate(task, trajectories=3, cancel=cancelled())


def test_a_timeout_of_the_tasks_own_is_not_taken_for_that_of_the_caller(task):
    class Slow:
        name = "slow"

        def rollout(self, seed, frames=10):
            raise TimeoutError("the camera does not answer")

        def problem(self, state, params=None, contacts=None):
            raise AssertionError("no problem is asked for")

    with pytest.raises(TimeoutError, match="the camera"):
        em.datasets.generate(Slow(), trajectories=2, timeout=600)


def simulations(problem):
    world, push = em.World(problem.scene), np.zeros(6)
    return [
        lambda **limit: world.rollout(problem.state, push, 4000.0, **limit),
        lambda **limit: world.simulate(problem.state, 10**6, record=[10**6], **limit),
    ]


@pytest.mark.parametrize("which", [0, 1])
def test_there_is_no_half_simulation(problem, which):
    simulate = simulations(problem)[which]
    with ends_within(0.2), pytest.raises(TimeoutError, match="the time was over"):
        simulate(timeout=0.2)
    with ends_within(0.2), pytest.raises(em.Cancelled):
        simulate(cancel=cancelled(after=0.2))


@pytest.mark.parametrize("which", [0, 1])
def test_ctrl_c_ends_a_long_simulation(problem, which):
    simulate = simulations(problem)[which]
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with ends_within(0.2), pytest.raises(KeyboardInterrupt):
        simulate()


def test_a_world_that_another_thread_uses_is_not_waited_for_beyond_the_timeout(problem):
    world, cancel = em.World(problem.scene), em.Cancel()

    def long():
        with pytest.raises(em.Cancelled):
            world.simulate(problem.state, 10**6, record=[10**6], cancel=cancel)

    other = threading.Thread(target=long)
    other.start()
    time.sleep(0.1)
    with ends_within(0.2), pytest.raises(TimeoutError):
        world.rollout(problem.state, np.zeros(6), 0.01, timeout=0.2)
    cancel.set()
    other.join()


def test_a_limit_that_is_not_reached_changes_no_bit(problem):
    far = {"timeout": 600, "cancel": em.Cancel()}
    for whole, limited in [
        (em.escape_effort(problem, nodes=50), em.escape_effort(problem, nodes=50, **far)),
        (em.capture_score(problem, nodes=50), em.capture_score(problem, nodes=50, **far)),
    ]:
        assert limited.complete
        assert np.array_equal(whole.tree.states, limited.tree.states)


def test_shares_of_the_ceiling_that_are_done_are_kept(dataset, tmp_path):
    path = tmp_path / "ceiling.db"
    assert not ceiling.ceiling_dataset(dataset, path, 3, cancel=cancelled())
    assert ceiling.ceiling_dataset(dataset, path, 3, timeout=600)
    with pytest.raises(em.Cancelled):
        ceiling.state_ceiling(em.tasks.make("push"), dataset.trajectories[0], 0, cancel=cancelled())


@pytest.mark.parametrize("timeout", [0, -1, float("nan"), float("inf"), "soon"])
def test_a_timeout_that_cannot_be_is_refused_by_value(task, problem, timeout, tmp_path):
    world = em.World(problem.scene)
    for call in (
        lambda: em.capture_score(problem, timeout=timeout),
        lambda: em.escape_effort(problem, timeout=timeout),
        lambda: em.escape_energy(problem, timeout=timeout),
        lambda: scoring.score([problem], timeout=timeout),
        lambda: em.datasets.generate(task, timeout=timeout),
        lambda: world.rollout(problem.state, np.zeros(6), 0.1, timeout=timeout),
        lambda: world.simulate(problem.state, 1, timeout=timeout),
        lambda: em.mesh(tmp_path / "no.stl", timeout=timeout),
    ):
        with pytest.raises(ValueError, match=r"timeout is .*, expected a"):
            call()


@pytest.mark.parametrize("search", [em.capture_score, em.escape_effort])
def test_progress_tells_how_many_nodes_there_are_and_changes_no_bit(resting, search):
    told = []
    followed = search(resting, nodes=300, seed=2, progress=lambda *count: told.append(count))
    assert told == sorted(set(told))
    assert told[-1] == (followed.nodes, 300)
    alone = search(resting, nodes=300, seed=2)
    assert np.array_equal(followed.tree.states, alone.tree.states)


def test_progress_counts_the_nodes_of_all_trees(problem):
    told = []
    em.capture_score(
        problem, nodes=50, trees=4, threads=2, progress=lambda *count: told.append(count)
    )
    assert told[-1] == (200, 200)


@pytest.mark.parametrize("search", [em.capture_score, em.escape_effort])
def test_what_progress_raises_ends_the_search(resting, search):
    def refuse(nodes, total):
        raise LookupError(f"{nodes} nodes")

    with ends_within(SLACK), pytest.raises(LookupError, match="nodes"):
        search(resting, nodes=MANY, progress=refuse)


HUGE = 2**31 - 1  # rollouts, trees or searches: no memory holds them


def zero(random, times):
    return np.zeros((len(times), 6))


COUNTED = {
    "trees": lambda p, **limit: em.capture_score(p, nodes=2, trees=HUGE, **limit),
    "searches": lambda p, **limit: em.escape_effort(p, nodes=HUGE, searches=HUGE, **limit),
    "rollouts": lambda p, **limit: em.capture_probability(future(p), rollouts=HUGE, **limit),
    "a tolerance": lambda p, **limit: em.capture_probability(
        future(p), rollouts=HUGE, tolerance=1e-12, **limit
    ),
    "draws of a function": lambda p, **limit: em.capture_probability(
        future(p), rollouts=HUGE, disturbance=zero, **limit
    ),
}


def future(problem):
    return problem.replace(horizon=0.1)


@pytest.mark.parametrize("what", COUNTED)
@pytest.mark.parametrize("threads", [1, 3])
def test_a_huge_count_ends_in_time_with_what_is_done(resting, what, threads):
    with ends_within(0.5):
        found = COUNTED[what](resting, timeout=0.5, threads=threads)
    assert not found.complete


def test_rollouts_of_a_policy_end_in_time_with_whole_blocks(resting):
    scene = resting.scene
    policy = em.Policy(lambda seen, memory, time: np.zeros((len(seen), 1)), period=0.05,
                       observe=["object.x"], command=["effector.fx"])  # fmt: skip
    problem = em.Problem(scene, resting.state, captured=resting.captured, force=(3, 3, 0),
                         torque=(0, 0, 0.05), duration=0.5, horizon=0.1, plan=policy)  # fmt: skip
    found, seconds = None, 0.5
    while found is None:
        try:
            found = em.capture_probability(problem, rollouts=HUGE, timeout=seconds)
        except TimeoutError:
            seconds *= 2
    whole = em.capture_probability(problem, rollouts=found.rollouts)
    assert not found.complete and np.array_equal(found.exit_times, whole.exit_times)
