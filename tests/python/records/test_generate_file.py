"""Datasets straight into their file: the same bytes, whoever made which part and when."""

import os
import re
import signal
import sqlite3
import subprocess
import sys
import time
import tracemalloc
from contextlib import closing
from pathlib import Path

import pytest

import energymargin as em
from energymargin import datasets, tasks
from energymargin.executors import Processes, Threads
from energymargin.records.datasets.generation import Parts, Request, parts_of, trajectories_kept

COMMAND = str(Path(sys.executable).with_name("energymargin"))
COUNT = 430  # of 10 frames: 9 shards, and two blocks of a file


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The bytes of the file, as they are made in memory."""
    path = tmp_path_factory.mktemp("whole") / "topple.h5"
    datasets.generate("topple", trajectories=COUNT, seed=4).save(path)
    return path.read_bytes()


def generate(path, trajectories=COUNT, *, task="topple", seed=4, **options):
    """How many trajectories the file has that is made."""
    options = {"trajectories": trajectories, "seed": seed, **options}
    with datasets.generate(task, path=path, **options) as dataset:
        return len(dataset.trajectories)


def command(path, count=COUNT, *options):
    numbers = ["--trajectories", count, "--seed", 4, "-o", path.name, *options]
    return subprocess.Popen(
        [COMMAND, "generate", "topple", *map(str, numbers)],
        cwd=path.parent,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for(condition, process):
    deadline = time.monotonic() + 60
    while not condition():
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.002)


@pytest.mark.parametrize("processes", [1, 2, None])
def test_any_number_of_processes_makes_the_same_bytes(whole, tmp_path, processes):
    seen = []
    path = tmp_path / "topple.h5"
    progress = lambda done, total: seen.append((done, total))  # noqa: E731
    assert generate(path, processes=processes, progress=progress) == COUNT
    assert path.read_bytes() == whole
    assert seen == sorted(seen) and seen[-1] == (COUNT, COUNT)
    assert os.listdir(tmp_path) == ["topple.h5"]


def test_processes_make_the_same_dataset_in_memory(whole, tmp_path):
    dataset = datasets.generate("topple", trajectories=COUNT, seed=4, processes=2)
    dataset.save(tmp_path / "topple.h5")
    assert (tmp_path / "topple.h5").read_bytes() == whole


@pytest.mark.parametrize("processes", [1, 2])
def test_after_a_kill_the_same_command_goes_on_to_the_same_bytes(whole, tmp_path, processes):
    path = tmp_path / "topple.h5"
    process = command(path, COUNT, "--processes", processes)
    wait_for(lambda: trajectories_kept(path) >= 50, process)
    process.kill()
    process.communicate(timeout=30)
    kept = trajectories_kept(path)
    assert 0 < kept < COUNT and not path.exists()
    seen = []
    assert generate(path, processes=2, progress=lambda done, _: seen.append(done)) == COUNT
    assert seen[0] == kept  # that many were not made again
    assert path.read_bytes() == whole
    assert os.listdir(tmp_path) == ["topple.h5"]


def test_ctrl_c_says_what_is_kept_and_the_same_command_goes_on(whole, tmp_path):
    path = tmp_path / "topple.h5"
    process = command(path, COUNT, "--processes", 2)
    wait_for(lambda: trajectories_kept(path) >= 50, process)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=30)
    assert process.returncode == 130 and "Traceback" not in stderr
    said = re.search(rf"(\d+) of {COUNT} trajectories are kept beside topple\.h5", stderr)
    assert COUNT > int(said[1]) == trajectories_kept(path) >= 50
    again = command(path, COUNT, "--processes", 1)
    _, stderr = again.communicate(timeout=60)
    assert again.returncode == 0 and f"Wrote {COUNT} trajectories" in stderr, stderr
    assert path.read_bytes() == whole


def test_after_a_timeout_the_file_has_the_first_and_the_same_call_goes_on(whole, tmp_path):
    path, cancel = tmp_path / "topple.h5", em.Cancel()

    def after_three(done, total):
        if done >= 3:
            cancel.set()

    count = generate(path, progress=after_three, cancel=cancel)
    assert 3 <= count < COUNT
    first = datasets.load(path)
    assert first.digest() == datasets.generate("topple", trajectories=count, seed=4).digest()
    seen = []
    assert generate(path, progress=lambda done, total: seen.append(done)) == COUNT
    assert seen[0] == count and seen == sorted(set(seen))
    assert path.read_bytes() == whole


def test_more_trajectories_go_on_from_the_parts_of_fewer(whole, tmp_path):
    path, cancel = tmp_path / "topple.h5", em.Cancel()
    stop = lambda done, total: done >= 120 and cancel.set()  # noqa: E731
    generate(path, progress=stop, cancel=cancel)
    assert 120 <= trajectories_kept(path) < COUNT
    assert generate(path, trajectories=110) == 110  # fewer than there are
    assert (
        datasets.load(path).digest()
        == datasets.generate("topple", trajectories=110, seed=4).digest()
    )


def test_a_run_that_got_no_trajectory_leaves_nothing(tmp_path):
    cancel = em.Cancel()
    cancel.set()
    for processes in (1, 2):
        with pytest.raises(em.Cancelled, match="before one trajectory was done"):
            generate(tmp_path / "topple.h5", processes=processes, cancel=cancel)
    assert os.listdir(tmp_path) == []


def test_parts_of_another_dataset_are_not_mixed_in_but_kept(tmp_path):
    path = tmp_path / "topple.h5"
    dataset = datasets.generate("topple", trajectories=3, seed=4)
    with Parts(path, Request.of(tasks.make("topple"), 10, seed=4)) as parts:
        parts.add(0, next(dataset._blocks()))
    with pytest.raises(ValueError, match=r"\.topple\.h5\.parts holds .* seed: 4 there, 5 now"):
        generate(path, trajectories=6, seed=5)
    assert trajectories_kept(path) == 3
    assert generate(path, trajectories=6) == 6


def test_of_two_runs_at_once_the_second_is_refused(tmp_path):
    with (
        Parts(tmp_path / "topple.h5", Request.of(tasks.make("topple"), 10, seed=4)),
        pytest.raises(ValueError, match=rf"process {os.getpid()} is generating .*let it finish"),
    ):
        generate(tmp_path / "topple.h5")


def test_a_damaged_part_is_named_and_made_again(whole, tmp_path):
    path, cancel = tmp_path / "topple.h5", em.Cancel()
    stop = lambda done, total: done >= 120 and cancel.set()  # noqa: E731
    generate(path, progress=stop, cancel=cancel)
    with closing(sqlite3.connect(parts_of(path))) as parts, parts:
        last = "(SELECT max(first) FROM answers)"
        parts.execute(f"UPDATE answers SET content = substr(content, 1, 900) WHERE first = {last}")
    with pytest.raises(ValueError, match=r"begins with trajectory \d+ was damaged.*makes it again"):
        generate(path)
    assert generate(path) == COUNT and path.read_bytes() == whole


class Here:
    """A task that no package registers."""

    name = "topple"

    def rollout(self, seed, frames=10):
        return tasks.make("topple").rollout(seed, frames)

    def problem(self, state, params=None, contacts=None):
        return tasks.make("topple").problem(state, params, contacts)


def test_a_task_that_is_not_registered_is_made_in_this_process_alone(tmp_path):
    path = tmp_path / "here.h5"
    assert generate(path, trajectories=60, task=Here(), seed=0, frames=2, processes=None) == 60
    here = datasets.generate(Here(), trajectories=60, frames=2)
    assert datasets.load(path).digest() == here.digest()
    with pytest.raises(ValueError, match=r"processes is 2, .*'topple'.* or use processes=1"):
        generate(path, trajectories=60, task=Here(), frames=2, processes=2)
    with pytest.raises(ValueError, match="processes is 0"):
        generate(path, trajectories=60, task=Here(), frames=2, processes=0)


MORTAL = '''
import os
import signal
from pathlib import Path

from energymargin import tasks


class Mortal:
    """Takes its process with it, once for each file in a folder."""

    name = "mortal"

    def __init__(self, lives="lives"):
        self.lives = lives

    def rollout(self, seed, frames=10):
        for life in Path(self.lives).iterdir() if seed % 20 == 0 else []:
            life.unlink(missing_ok=True)  # another worker may have been quicker
            os.kill(os.getpid(), signal.SIGKILL)
        return tasks.make("topple").rollout(seed, frames)

    def problem(self, state, params=None, contacts=None):
        return tasks.make("topple").problem(state, params, contacts)
'''


@pytest.fixture
def mortal(tmp_path, monkeypatch):
    """An installed task, and how to say how many processes it takes with it."""
    installed = tmp_path / "mortal-1.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: mortal\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text("[energymargin.tasks]\nmortal = mortal:Mortal\n")
    (tmp_path / "mortal.py").write_text(MORTAL)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    lives = tmp_path / "lives"
    lives.mkdir()

    def give(count):
        for number in range(count):
            (lives / str(number)).touch()

    return tasks.make("mortal", lives=str(lives)), give, lives


def test_a_worker_that_dies_ends_the_call_and_the_same_call_goes_on(mortal, tmp_path):
    task, give, lives = mortal
    asked = {"trajectories": 120, "task": task, "frames": 2, "processes": 2}
    generate(tmp_path / "calm.h5", **asked)
    give(1)
    with pytest.raises(em.ExecutorError, match=r"SIGKILL.* is kept: the same call goes on"):
        generate(tmp_path / "died.h5", **asked)
    assert not list(lives.iterdir())
    generate(tmp_path / "died.h5", **asked)
    assert (tmp_path / "died.h5").read_bytes() == (tmp_path / "calm.h5").read_bytes()


def test_an_executor_makes_the_same_bytes(whole, tmp_path):
    assert generate(tmp_path / "there.h5", executor=em.executors.Processes(2)) == COUNT
    assert (tmp_path / "there.h5").read_bytes() == whole


@pytest.mark.parametrize("executor", [Threads(1), Processes(1)])
def test_processes_beside_an_executor_are_refused(executor):
    with pytest.raises(ValueError, match="processes is 4, expected 1 or None with an executor"):
        datasets.generate("topple", trajectories=1, frames=2, processes=4, executor=executor)


def test_a_billion_trajectories_is_not_listed_before_the_first():
    cancel = em.Cancel()
    tracemalloc.start()
    try:
        dataset = datasets.generate(
            "topple",
            **{"trajectories": 10**9, "frames": 2, "cancel": cancel},
            progress=lambda _done, _total: cancel.set(),
        )
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert 1 <= len(dataset.trajectories) < 10**5
    assert peak < 2**26
