import importlib
import os
import signal
import sys
import time

import pytest
from clusters import Cluster, free_port

from energymargin.executors.dask_pool import DaskPool

PATIENCE = 120  # [s] for anything that is waited for here, on a busy machine


def double(number, stopped):
    time.sleep(0.05)
    return 2 * number, os.getpid()


def size_of(payload, stopped):
    return len(payload)


def divide(number, stopped):
    return 1 / number


def die(payload, stopped):
    os.kill(os.getpid(), signal.SIGKILL)


def wait_until_stopped(marks, stopped):
    (marks / "began").touch()
    while not stopped():
        time.sleep(0.01)
    (marks / "ended").touch()
    return "stopped"


def be_whole(marks, stopped):
    (marks / str(os.getpid())).touch()
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        if stopped():
            return "a part"
        time.sleep(0.01)
    return "whole"


@pytest.fixture(scope="module")
def cluster():
    with Cluster(workers=2) as cluster:
        yield cluster


class Taken(dict):
    """What became of the jobs of a pool, by number; each comes once."""

    def __init__(self, pool):
        self.pool = pool

    def until(self, condition):
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end
            for outcome in self.pool.take(0.05):
                assert outcome.job not in self
                self[outcome.job] = outcome
        return self


def all_of(pool, jobs):
    """What became of that many jobs."""
    taken = Taken(pool)
    return taken.until(lambda: len(taken) == jobs)


def test_jobs_run_on_separate_processes_and_their_values_and_errors_come_back(cluster):
    with DaskPool(cluster.address) as pool:
        Taken(pool).until(lambda: pool.slots == 2)
        for job in range(20):
            pool.submit(job, double, job)
        pool.submit(20, divide, 0)
        pool.submit(21, size_of, bytes(20_000_000))
        outcomes = all_of(pool, 22)
    assert [outcomes[job].value[0] for job in range(20)] == [2 * job for job in range(20)]
    processes = {outcomes[job].value[1] for job in range(20)}
    assert processes == {worker.pid for worker in cluster.workers}
    assert isinstance(outcomes[20].error, ZeroDivisionError)
    assert outcomes[21].value == 20_000_000


def test_a_client_of_the_users_gives_the_address_and_stays_open(cluster):
    import distributed

    with distributed.Client(cluster.address, set_as_default=False) as client:
        with DaskPool(client) as pool:
            pool.submit(0, double, 4)
            assert all_of(pool, 1)[0].value[0] == 8
        assert client.submit(len, "abc").result(PATIENCE) == 3


def test_stop_hands_back_what_ran_and_drops_what_waited(cluster, tmp_path):
    with DaskPool(cluster.address) as pool:
        folders = [tmp_path / str(job) for job in range(12)]
        for job, folder in enumerate(folders):
            folder.mkdir()
            pool.submit(job, wait_until_stopped, folder)
        Taken(pool).until(lambda: sum((folder / "began").exists() for folder in folders) == 2)
        outcomes = pool.stop(PATIENCE)
        assert [outcome.value for outcome in outcomes] == ["stopped"] * 2
        assert sum((folder / "began").exists() for folder in folders) == 2


def test_a_job_sees_that_its_driver_is_gone(cluster, tmp_path):
    pool = DaskPool(cluster.address)
    pool.submit(0, wait_until_stopped, tmp_path)
    Taken(pool).until((tmp_path / "began").exists)
    pool.close()
    end = time.monotonic() + PATIENCE
    while not (tmp_path / "ended").exists():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_workers_of_another_release_are_refused_with_both_versions(cluster):
    here = importlib.metadata.version("energymargin")
    with DaskPool(cluster.address, release="99.1") as pool:
        pool.submit(0, double, 1)
        with pytest.raises(RuntimeError, match=rf"tcp://127.*{here}.*99\.1"):
            all_of(pool, 1)


def test_no_scheduler_is_an_error_that_names_the_address():
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(ConnectionError, match=address):
        DaskPool(address)


@pytest.mark.parametrize("cluster", ["", 8786, None, "here", "http://127.0.0.1:8786"])
def test_what_is_no_cluster_is_refused(cluster):
    with pytest.raises(ValueError, match="expected the address of a Dask scheduler"):
        DaskPool(cluster)


def test_without_distributed_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"pip install 'energymargin\[cluster\]"):
        DaskPool("tcp://127.0.0.1:8786")


def test_a_worker_without_the_library_is_an_error_that_says_so(tmp_path):
    without = tmp_path / "without.py"
    without.write_text("import sys\nsys.modules['energymargin'] = None\n")
    with Cluster() as cluster, DaskPool(cluster.address) as pool:
        cluster.start_worker("--preload", str(without))
        pool.submit(0, double, 1)
        with pytest.raises(RuntimeError, match=r"cannot run jobs.*energymargin.*same release"):
            all_of(pool, 1)


def test_of_killed_workers_nobody_hears_but_jobs_that_kill_their_workers_are_found():
    notices = []
    settings = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    with (
        Cluster(workers=1, threads=2, **settings) as cluster,
        DaskPool(cluster.address, notice=notices.append) as pool,
    ):
        taken = Taken(pool)
        for job in range(60):
            pool.submit(job, double, job)
        taken.until(lambda: taken)
        cluster.kill_worker()
        for job in (60, 61):
            pool.submit(job, die, None)
        cluster.start_worker(nanny=True)
        cluster.start_worker(nanny=True)
        taken.until(lambda: len(taken) == 62)
    assert sorted(job for job in taken if taken[job].died) == [60, 61]
    assert [taken[job].value[0] for job in range(60)] == [2 * job for job in range(60)]
    assert any("is gone" in words for words in notices)


def test_what_a_job_leaves_undone_on_a_worker_that_closes_is_done_elsewhere(tmp_path):
    with Cluster(workers=1) as cluster, DaskPool(cluster.address) as pool:
        pool.submit(0, be_whole, tmp_path)
        taken = Taken(pool).until(lambda: list(tmp_path.iterdir()))
        cluster.workers[0].terminate()
        cluster.start_worker()
        assert taken.until(lambda: taken)[0].value == "whole"
    assert len(list(tmp_path.iterdir())) == 2


def test_jobs_survive_a_scheduler_that_is_killed_and_comes_back():
    notices = []
    with Cluster(workers=1) as cluster, DaskPool(cluster.address, notice=notices.append) as pool:
        for job in range(40):
            pool.submit(job, double, job)
        taken = Taken(pool)
        taken.until(lambda: taken)
        cluster.kill_scheduler()
        taken.until(lambda: any("is away" in words for words in notices))
        assert pool.take(0.2) == []
        cluster.start_scheduler()
        cluster.start_worker()
        taken.until(lambda: len(taken) == 40)
    assert [taken[job].value[0] for job in range(40)] == [2 * job for job in range(40)]
    assert any("is back" in words for words in notices)


def test_jobs_survive_somebody_who_restarts_the_cluster():
    import distributed

    with Cluster() as cluster, DaskPool(cluster.address) as pool:
        cluster.start_worker(nanny=True)
        for job in range(40):
            pool.submit(job, double, job)
        taken = Taken(pool)
        taken.until(lambda: taken)
        with distributed.Client(cluster.address, set_as_default=False) as client:
            client.restart(wait_for_workers=False)
        taken.until(lambda: len(taken) == 40)
    assert [taken[job].value[0] for job in range(40)] == [2 * job for job in range(40)]


def test_a_scheduler_that_stays_away_ends_the_patience():
    with Cluster() as cluster, DaskPool(cluster.address, patience=0.5) as pool:
        pool.submit(0, double, 1)
        cluster.kill_scheduler()
        with pytest.raises(ConnectionError, match=rf"{cluster.address}.*the same command goes on"):
            all_of(pool, 1)
