"""The same scores on threads, in processes and on a cluster, also when workers die."""

import gc
import multiprocessing
import os
import signal
import threading
import time
from concurrent.futures import (
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from pathlib import Path

import numpy as np
import pytest
import sliding
from clusters import Cluster, workers_of

import energymargin as em
from energymargin.evaluate import parallel
from energymargin.executors import Dask, Processes, Threads

NODES, SEED = 60, 5


@pytest.fixture(scope="module")
def problems():
    """Of three tasks: with and without joints, one object and several."""
    made = [
        em.datasets.generate(task, trajectories=2, frames=4, seed=1).problems()
        for task in ("topple", "balance", "scoop")
    ]
    return [problem for of_task in made for problem in of_task]


@pytest.fixture(scope="module")
def table(problems):
    return em.score(problems, nodes=NODES, seed=SEED, executor=Threads(1))


@pytest.fixture(scope="module")
def cluster():
    with Cluster(workers=2) as cluster:
        yield cluster


def same(table, other):
    return all(np.array_equal(table[metric], other[metric]) for metric in table.scores)


@pytest.mark.parametrize("count", [1, 2])
def test_processes_give_the_same_bits_as_threads(problems, table, count):
    assert same(table, em.score(problems, nodes=NODES, seed=SEED, executor=Processes(count)))
    assert not workers_of(os.getpid())


def test_a_cluster_gives_the_same_bits_as_threads(problems, table, cluster):
    from distributed import Client

    executor = Dask(cluster.address)
    assert same(table, em.score(problems, nodes=NODES, seed=SEED, executor=executor))
    with Client(cluster.address) as client:
        executor = Dask(client)
        assert same(table, em.score(problems, nodes=NODES, seed=SEED, executor=executor))
        assert client.status == "running"


@pytest.mark.skipif(not Path("/proc/net/if_inet6").exists(), reason="no IPv6 on this machine")
def test_a_cluster_may_have_an_address_of_ipv6(problems, table):
    with Cluster(workers=1, host="[::1]") as cluster:
        some = em.score(problems[:2], nodes=NODES, seed=SEED, executor=Dask(cluster.address))
    assert np.array_equal(some["force"], table["force"][:2])


def test_a_cluster_knows_the_disturbance_and_gives_curves_back(cluster):
    dataset = em.datasets.generate("topple", trajectories=1, frames=4, seed=1)
    problems = dataset.problems(future=em.datasets.Future(1))
    options = {"rollouts": 4, "strength": 0.5, "objects": 1, "common_random_numbers": True}
    curves = []
    for executor in (Threads(1), Dask(cluster.address)):
        rows = []
        em.score(problems, ["probability"], executor=executor, on_rows=rows.extend, **options)
        rows.sort(key=lambda row: row.index)
        curves.append([[c.tobytes() for c in row.curves["probability"]] for row in rows])
    assert curves[0] == curves[1] and len(curves[0]) == 4


def test_without_workers_a_driver_waits_and_goes_on_once_there_is_one(problems):
    with Cluster() as cluster:
        notices, cancel, scored = [], em.Cancel(), []
        executor = Dask(cluster.address, notice=notices.append)

        def begin():
            some = problems[:2]
            scored.append(em.score(some, ["force"], executor=executor, cancel=cancel))

        driver = threading.Thread(target=begin)
        driver.start()
        try:
            deadline = time.monotonic() + 60
            while not notices:
                assert driver.is_alive() and time.monotonic() < deadline
                time.sleep(0.01)
            cluster.start_worker()
            driver.join(60)
            assert not driver.is_alive() and "no workers at" in notices[0]
        finally:
            cancel.set()
            driver.join()
    (table,) = scored
    assert np.array_equal(table["force"], em.score(problems[:2], ["force"])["force"])


def test_an_executor_of_the_standard_library_gives_the_same_bits(problems, table):
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as executor:
        assert same(table, em.score(problems, nodes=NODES, seed=SEED, executor=executor))
        assert executor.submit(len, "abc").result() == 3  # it stays open


class Watched(Executor):
    """An executor of a user on one thread, which breaks after some calls."""

    def __init__(self, calls):
        self.calls, self.futures = calls, []

    def submit(self, function, *arguments):
        self.futures.append(Future())
        if len(self.futures) > self.calls:
            self.futures[-1].set_exception(BrokenExecutor("a process was killed"))
        else:
            self.futures[-1].set_result(function(*arguments))
        return self.futures[-1]


def test_a_users_executor_that_breaks_ends_the_call_with_what_is_done(problems):
    asked, kept = {"nodes": 20, "seed": SEED}, []
    with pytest.raises(em.ScoreError, match=r"the executor is broken.*killed") as why:
        em.score(problems, ["capture"], executor=Watched(3), on_rows=kept.extend, **asked)
    table = why.value.table
    assert not table.complete and 3 <= len(table) < len(problems)
    assert sorted(row.index for row in kept) == table.index.tolist()
    assert sorted([*why.value.errors, *table.index.tolist()]) == list(range(len(problems)))
    known = em.score(problems, ["capture"], threads=1, **asked)["capture"]
    assert np.array_equal(table["capture"], known[table.index])


def test_a_process_of_a_users_executor_that_dies_is_said_in_words(problems):
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as executor:
        executor.submit(os._exit, 3)
        for _ in range(2):  # while it breaks, and once it is broken
            with pytest.raises(em.ScoreError, match="the executor is broken"):
                em.score(problems, ["capture"], nodes=20, executor=executor)
        with pytest.raises(em.ExecutorError, match="what was done before is kept"):
            em.rank({"a": timed(), "b": timed()}, rollouts=16, executor=executor)
    with pytest.raises(em.ScoreError, match="was shut down"):
        em.score(problems, ["capture"], nodes=20, executor=executor)


def timed(horizon=1.0):
    return sliding.problem(horizon=horizon)


def test_after_a_timeout_a_users_executor_is_free():
    """What waits is cancelled, and what runs is stopped, which would take minutes."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as executor:
        executor.submit(len, "abc").result()
        many = [timed(100.0)] * 20
        table = em.score(many, ["probability"], rollouts=10**6, executor=executor, timeout=0.5)
        assert not table.complete and len(table) == 0
        assert executor.submit(len, "abc").result(timeout=30) == 3


def test_what_a_limit_cut_is_not_taken_for_complete(monkeypatch):
    """Also where a worker elsewhere sees the limit first."""
    monkeypatch.setattr(parallel, "GRACE", -60.0)
    executor = ThreadPoolExecutor(1)
    many = [timed(100.0)] * 3
    with executor:
        table = em.score(many, ["probability"], rollouts=10**5, executor=executor, timeout=2.0)
    assert not table.complete and len(table) < 3


def test_there_are_no_more_processes_than_problems(problems):
    seen = []
    count = lambda _: seen.append(len(workers_of(os.getpid())))  # noqa: E731
    em.score(problems[:1], ["force"], executor=Processes(60), on_rows=count)
    assert seen == [1]
    em.score(problems[:3], ["force"], executor=Processes(60), on_rows=count)
    assert {*seen[1:]} == {3}


def test_a_part_of_the_metrics_and_other_indices_are_handed_on(problems, table):
    some = [problems[i] for i in (3, 11)]
    part = em.score(
        some, ["effort/rrt"], nodes=NODES, seed=SEED, indices=[3, 11], executor=Processes(2)
    )
    assert list(part.scores) == ["effort/rrt"]
    assert np.array_equal(part["effort/rrt"], table["effort/rrt"][[3, 11]])


def test_a_process_that_is_killed_ends_the_call_in_words_with_what_is_done(problems):
    asked, killed = {"nodes": 30, "seed": SEED}, []

    def kill_one(_done, _total):
        if not killed:
            killed.append(workers_of(os.getpid())[0])
            os.kill(killed[0], signal.SIGKILL)

    with pytest.raises(em.ScoreError, match=r"the executor is broken.*SIGKILL") as caught:
        em.score(problems * 500, ["capture"], executor=Processes(2), progress=kill_one, **asked)
    table = caught.value.table
    assert 0 < len(table) < 500 * len(problems) and not workers_of(os.getpid())
    some = table.index[:5].tolist()
    again = em.score(
        [problems[i % len(problems)] for i in some], ["capture"], indices=some, **asked
    )
    assert table["capture"][:5].tolist() == again["capture"].tolist()


def test_a_problem_that_fails_in_a_process_leaves_the_others_their_scores(problems, table):
    scene = em.Scene()
    scene.add_body("object", em.Box((0.1, 0.1, 0.1)), mass=1, role="object")
    bad = em.Problem(
        scene,
        scene.pack(),
        force=(1, 0, 0),
        torque=(0, 0, 0),
        duration=0.1,
        captured=em.regions.Disc("object", center=(0, 0), radius=1),
    )
    with pytest.raises(em.ScoreError, match=r"1 of 3 problems .*problem 1: .*effector") as caught:
        em.score([problems[0], bad, problems[2]], ["force"], executor=Processes(2))
    assert caught.value.table["force"].tolist() == table["force"][[0, 2]].tolist()


def test_an_interrupt_hands_over_what_is_finished_in_processes(problems):
    many, rows = problems[:8] * 500, []

    def interrupt_at_first(found):
        if not rows:
            signal.raise_signal(signal.SIGINT)
        rows.extend(found)

    options = {"nodes": 30, "seed": SEED, "executor": Processes(2)}
    with pytest.raises(KeyboardInterrupt):
        em.score(many, ["capture"], on_rows=interrupt_at_first, **options)
    assert 0 < len(rows) < len(many) and not workers_of(os.getpid())
    kept = sorted(rows, key=lambda row: row.index)[:5]
    indices = [row.index for row in kept]
    again = em.score([many[i] for i in indices], ["capture"], nodes=30, seed=SEED, indices=indices)
    assert [row.scores["capture"] for row in kept] == again["capture"].tolist()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"executor": Threads(1), "threads": 2}, "threads is 2, expected None with an executor"),
        ({"indices": [1]}, "indices has 1 numbers"),
        ({"indices": [*range(23), -1]}, "indices is -1, expected a whole number from 0"),
        ({"indices": [*range(23), 2**63]}, "indices is 9223372036854775808, expected"),
        ({"executor": 0}, "executor is 0, expected Threads"),
        ({"executor": Processes}, "executor is .*Processes.*, expected Threads"),
    ],
)
def test_arguments_that_contradict_are_refused(problems, wrong, words):
    with pytest.raises(ValueError, match=words):
        em.score(problems, **wrong)


def test_ctrl_c_does_not_wait_for_a_scheduler_that_is_not_there(problems):
    """It leaves no client, whose end would wait for the next one that is just being made."""
    from distributed import Client

    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        em.score(problems, executor=Dask("tcp://127.0.0.1:9"))
    left = [one for one in gc.get_objects() if type(one) is Client and one.status != "closed"]
    assert left == []


def test_executors_without_workers_are_refused():
    with pytest.raises(ValueError, match="threads is 0"):
        Threads(0)
    with pytest.raises(ValueError, match="processes is 0"):
        Processes(0)
    with pytest.raises(ValueError, match="scheduler is 'nonsense', expected an address such as"):
        Dask("nonsense")
    with pytest.raises(ConnectionError, match=r"tcp://127\.0\.0\.1:9"):
        Dask("tcp://127.0.0.1:9").workers()
