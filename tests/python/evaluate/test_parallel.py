"""The runner of chunks: what comes back when workers die, a limit is reached, or Ctrl-C comes."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Future
from functools import partial
from pathlib import Path

import pytest
from clusters import Cluster, free_port, workers_of

import energymargin as em
from energymargin.evaluate import parallel
from energymargin.executors import Dask, Processes, Threads, ask


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


def run(executor, function, numbers, deliver, **options):
    values = lambda answers: deliver([answer for _, answer in answers])  # noqa: E731
    return ask([numbers], function, values, executor=executor, **options)


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

    assert not run(Threads(2), partial(slow, 0.01), range(200), deliver, cancel=cancel)
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


def test_a_process_that_dies_ends_the_run_with_what_is_done():
    taken = []
    with pytest.raises(em.ExecutorError, match=r"SIGKILL.*was done before is kept: the same call"):
        run(Processes(2), partial(die_at, {150}), range(200), taken.extend)
    assert 0 < len(taken) < 200 and not workers_of(os.getpid())
    rest = sorted({*range(200)} - {number // 2 for number in taken})
    assert run(Processes(2), double, rest, taken.extend)
    assert sorted(taken) == [2 * number for number in range(200)]


def test_a_dask_cluster_says_what_kills_its_workers():
    settings = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    taken = []
    with Cluster(**settings) as cluster:
        cluster.start_worker(nanny=True)
        with pytest.raises(em.ExecutorError, match=r"is broken.* died.* is kept"):
            run(Dask(cluster.address), partial(die_at, {39}), range(40), taken.extend, most=1)
    assert 0 < len(taken) < 40


def test_there_are_as_many_processes_as_there_is_work_for():
    counts = []
    count = lambda _: counts.append(len(workers_of(os.getpid())))  # noqa: E731
    with Processes(3).workers() as workers:
        for items, processes in ((1, 1), (2, 2), (1, 2)):
            assert run(workers, partial(slow, 0.1), range(items), count)
            assert {*counts} == {processes}
            counts.clear()
    assert not workers_of(os.getpid())


class Awkward(Exception):
    """What cannot be made again from its text."""

    def __init__(self, what, why):
        super().__init__(f"{what} {why}")


def fail(_numbers, _cancel):
    raise Awkward("it is", "full")


def test_an_error_that_cannot_be_sent_back_comes_in_words():
    with pytest.raises(RuntimeError, match=r"^Awkward: it is full$"):
        run(Processes(1), fail, range(3), [].extend)


PROGRAM = """
import sys, time
import energymargin as em
from test_parallel import double, run, slow
from functools import partial

print("begins", flush=True)
show = lambda results: [print(one, flush=True) for one in results]
run(em.executors.Processes(1), {function}, range(3), show, most=1)
print("ends")
"""


def program(tmp_path, function):
    """One that works in processes, at its top level."""
    path = tmp_path / "program.py"
    path.write_text(PROGRAM.format(function=function))
    here = Path(__file__).parent
    paths = [str(here), str(here.parent), os.environ.get("PYTHONPATH", "")]
    return subprocess.Popen(
        [sys.executable, str(path)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def test_a_program_without_a_main_guard_runs_once(tmp_path):
    process = program(tmp_path, "double")
    assert process.communicate(timeout=60) == ("begins\n0\n2\n4\nends\n", "")


def test_processes_end_with_a_parent_that_is_killed(tmp_path):
    process = program(tmp_path, "partial(slow, 1000)")
    assert process.stdout.readline() == "begins\n"
    deadline = time.monotonic() + 60
    while not (started := workers_of(process.pid)):
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.01)
    time.sleep(1.0)  # it is at work
    process.kill()
    process.communicate(timeout=60)  # until nobody has its streams
    while any(Path(f"/proc/{number}").exists() for number in started):
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize("wait", [0.0, 0.2, 2.0])
def test_ctrl_c_at_a_terminal_is_for_the_program_alone(tmp_path, wait):
    """All processes get it, whatever they are about."""
    process = program(tmp_path, "partial(slow, 1000)")
    assert process.stdout.readline() == "begins\n"
    time.sleep(wait)
    os.killpg(process.pid, signal.SIGINT)
    _, stderr = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT
    assert stderr.count("Traceback") == 1 and "resource_tracker" not in stderr


class Gone:
    """A future of Dask's whose worker went after its results were fetched."""

    status = "lost"

    async def _result(self, raiseit):
        return [2], 0.1, False


def test_results_that_go_with_their_worker_are_made_again(cluster, monkeypatch):
    from distributed import cfexecutor

    submit, lost, taken = cfexecutor.ClientExecutor.submit, [], []

    def loses_one(self, *call, **options):
        if lost:
            return submit(self, *call, **options)
        lost.append(Future())
        self._client.loop.add_callback(cfexecutor._cascade_future, Gone(), lost[0])
        return lost[0]

    monkeypatch.setattr(cfexecutor.ClientExecutor, "submit", loses_one)
    assert run(Dask(cluster.address), double, range(3), taken.extend)
    assert lost and sorted(taken) == [0, 2, 4]


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
    release = parallel.algorithm()
    monkeypatch.setattr(parallel, "algorithm", lambda: "99.1")
    with pytest.raises(RuntimeError, match=rf"has release {release} .* is 99\.1; inst"):
        run(Processes(1), double, [1], [].extend)


def test_no_scheduler_is_an_error_that_names_the_address():
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(ConnectionError, match=address):
        Dask(address).workers()


def test_without_distributed_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"pip install 'energymargin\[cluster\]"):
        Dask("tcp://127.0.0.1:8786").workers()
