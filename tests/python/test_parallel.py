"""The runner of chunks: what comes back when workers die, a limit is reached, or Ctrl-C comes."""

import os
import pickle
import signal
import sys
import time
from functools import partial

import pytest
from clusters import PATHS, Cluster, free_port

import energymargin as em
from energymargin.base.limits import Limit
from energymargin.evaluate import parallel
from energymargin.executors import Dask, Processes, Threads


def double(numbers, _cancel):
    return [2 * number for number in numbers]


def slow(seconds, numbers, cancel):
    found = []
    for number in numbers:
        time.sleep(seconds)
        if cancel.is_set:
            break
        found.append(2 * number)
    return found


def divide(numbers, _cancel):
    return [1 / number for number in numbers]


def die_at(deadly, numbers, _cancel):
    for number in numbers:
        if number in deadly:
            os.kill(os.getpid(), signal.SIGKILL)
    return [2 * number for number in numbers]


def run(executor, function, numbers, deliver, limit=None, **options):
    lost = lambda number, why: f"{number}: {why}"  # noqa: E731
    with executor.workers() as workers:
        return parallel.run(
            workers, function, [numbers], deliver, limit or Limit(), give_up=lost, **options
        )


@pytest.fixture(autouse=True)
def path_of_workers(monkeypatch):
    """Where they find the functions of this file."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(PATHS))


@pytest.fixture(scope="module")
def cluster():
    with Cluster(workers=2) as cluster:
        yield cluster


@pytest.mark.parametrize("kind", ["threads", "processes", "dask"])
def test_all_results_come_and_in_the_end_the_error_of_one_item(kind, cluster):
    executors = {"threads": Threads(2), "processes": Processes(2), "dask": Dask(cluster.address)}
    executor, taken = executors[kind], []
    assert run(executor, double, range(500), taken.extend)
    assert sorted(taken) == [2 * number for number in range(500)]
    taken.clear()
    with pytest.raises(ZeroDivisionError):
        run(executor, divide, range(3, -1, -1), taken.extend, most=1)
    assert len(taken) >= 2


def test_a_limit_keeps_what_is_finished():
    taken, cancel = [], em.Cancel()

    def deliver(numbers):
        taken.extend(numbers)
        if taken:
            cancel.set()

    assert not run(Threads(2), partial(slow, 0.01), range(200), deliver, Limit(None, cancel))
    assert 0 < len(taken) < 200


@pytest.mark.parametrize("executor", [Threads(2), Processes(2)])
def test_ctrl_c_is_raised_soon_once_what_is_finished_is_delivered(executor):
    taken, pressed = [], []

    def deliver(numbers):
        taken.extend(numbers)
        if taken and not pressed:
            pressed.append(time.monotonic())
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run(executor, partial(slow, 0.05), range(400), deliver)
    assert time.monotonic() - pressed[0] < 1.0  # 0.2 s on an idle machine
    assert 0 < len(taken) < 400


def test_an_error_of_who_takes_the_results_is_raised_once_what_is_finished_is_delivered():
    taken = []

    def deliver(numbers):
        taken.extend(numbers)
        if len(taken) in (1, 2):
            raise OSError("the disk is full")

    with pytest.raises(OSError, match="the disk is full"):
        run(Threads(1), partial(slow, 0.01), range(200), deliver)
    assert 0 < len(taken) < 200


def test_of_a_chunk_whose_worker_dies_the_guilty_item_alone_is_given_up():
    taken = []
    assert run(Processes(2), partial(die_at, {77}), range(200), taken.extend)
    lost = [result for result in taken if isinstance(result, str)]
    assert lost == ["77: 3 workers died over it, the last killed by SIGKILL"]
    right = sorted(result for result in taken if not isinstance(result, str))
    assert right == [2 * number for number in range(200) if number != 77]


def test_workers_that_all_die_end_the_run(monkeypatch):
    monkeypatch.setattr(parallel, "MOST_DEATHS", 3)
    with pytest.raises(RuntimeError, match="4 workers in a row have died, the last killed by SIG"):
        run(Processes(2), partial(die_at, range(200)), range(200), [].extend)


def test_a_dask_cluster_gives_up_what_kills_its_workers():
    settings = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    taken = []
    with Cluster(**settings) as cluster:
        for _ in range(2):
            cluster.start_worker(nanny=True)
        assert run(Dask(cluster.address), partial(die_at, {5}), range(40), taken.extend)
    (lost,) = [result for result in taken if isinstance(result, str)]
    assert lost.startswith("5: 3 workers died over it") and len(taken) == 40


def test_a_scheduler_that_goes_ends_the_run_with_what_to_do():
    taken = []
    with Cluster(workers=1) as cluster:

        def deliver(numbers):
            taken.extend(numbers)
            if taken:
                cluster.kill_scheduler()

        with pytest.raises(ConnectionError, match=r"is gone, or .*the same command goes on"):
            run(Dask(cluster.address), partial(slow, 0.05), range(400), deliver, most=1)
    assert 0 < len(taken) < 400


def test_a_worker_without_the_library_is_an_error_that_says_so(tmp_path):
    without = tmp_path / "without.py"
    without.write_text("import sys\nsys.modules['energymargin'] = None\n")
    with Cluster() as cluster:
        cluster.start_worker("--preload", str(without))
        with pytest.raises(RuntimeError, match=r"cannot run this energymargin.*same release"):
            run(Dask(cluster.address), double, range(3), [].extend)


def test_a_worker_of_another_release_is_refused_with_both(monkeypatch):
    monkeypatch.setattr(parallel, "algorithm", lambda: "99.1")
    call = pickle.dumps(parallel._RemoteWork(double, [1]))
    monkeypatch.undo()
    with pytest.raises(
        RuntimeError, match=rf"has release {parallel.algorithm()} .* is 99\.1; inst"
    ):
        pickle.loads(call)


def test_no_scheduler_is_an_error_that_names_the_address():
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(ConnectionError, match=address):
        Dask(address).workers()


def test_without_distributed_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"pip install 'energymargin\[cluster\]"):
        Dask("tcp://127.0.0.1:8786").workers()
