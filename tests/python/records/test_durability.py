"""Nothing that was computed is lost or computed twice: drivers and workers are killed."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from clusters import Cluster, workers_of
from stores import await_scores, score_count

import energymargin as em
from energymargin.store import ScoreStore

COMMAND = str(Path(sys.executable).with_name("energymargin"))
KILLS = 20
NODES = 300
STATES, METRICS = 300, 5


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("durability")
    em.datasets.generate("topple", trajectories=30, frames=10, seed=2).save(folder / "topple.h5")
    return folder


@pytest.fixture(scope="module")
def undisturbed(folder):
    with em.datasets.open(folder / "topple.h5") as dataset:
        return em.score(dataset.problems(), nodes=NODES)


def start(folder, store, *options):
    return subprocess.Popen(
        [
            *(COMMAND, "score", "topple.h5", "-o", store, "--paper", "--nodes", str(NODES)),
            *map(str, options),
        ],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(process):
    _, stderr = process.communicate(timeout=120)
    assert process.returncode == 0, stderr
    return stderr


def require_complete(path, undisturbed):
    """Every score is there once, with the bits of an undisturbed run."""
    with ScoreStore(path) as store:
        run = store.run()
        assert run.counts() == (STATES, STATES)
        found = run.labelled_scores().scores
    assert score_count(path) == STATES * METRICS
    assert len(found) == METRICS
    for metric, scores in found.items():
        assert np.array_equal(scores, undisturbed[metric])
    with sqlite3.connect(path) as file:
        assert file.execute("PRAGMA integrity_check").fetchone() == ("ok",)


def time_to_first_score(folder):
    """How long a driver takes to begin, on this machine as it is now [s]."""
    begun = time.monotonic()
    process = start(folder, "first.db", "--threads", 1)
    await_scores(process, folder / "first.db", 1)
    process.kill()
    process.communicate()
    return time.monotonic() - begun


def outlives(process, seconds):
    """Whether a process still runs after so long; one that ended did so well."""
    try:
        _, stderr = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        return True
    assert process.returncode == 0, stderr
    return False


def test_a_driver_killed_20_times_leaves_every_score_once_with_the_same_bits(folder, undisturbed):
    """At random moments, within a span that follows how fast the machine is meanwhile."""
    draws, paths, left, gains = random.Random(7), [folder / "killed0.db"], 0, []
    span = 2.0 * time_to_first_score(folder)
    while len(gains) < KILLS:
        process = start(folder, paths[-1].name, "--threads", 1)
        if not outlives(process, draws.uniform(0.1, 1.0) * span):
            paths.append(folder / f"killed{len(paths)}.db")
            left, span = 0, 0.8 * span
            continue
        process.kill()
        process.communicate()
        gains.append(score_count(paths[-1]) - left)
        left += gains[-1]
        if not gains[-1]:
            span *= 1.1
    print("scores that each driver left when it was killed:", gains)
    assert min(gains) >= 0 and sum(gain > 0 for gain in gains) > 2
    finish(start(folder, paths[-1].name))
    for path in paths:
        require_complete(path, undisturbed)


def test_a_second_scorer_is_refused_with_the_process_of_the_first(folder, undisturbed):
    first = start(folder, "two.db", "--threads", 1)
    await_scores(first, folder / "two.db", 1)
    second = start(folder, "two.db", "--threads", 1)
    _, stderr = second.communicate(timeout=60)
    assert second.returncode == 2 and f"process {first.pid} is scoring into" in stderr
    finish(first)
    require_complete(folder / "two.db", undisturbed)


def test_a_store_that_is_renamed_is_an_error_of_the_command_and_loses_nothing(folder):
    path, new = folder / "old.db", folder / "renamed.db"
    process = start(folder, path.name, "--threads", 1)
    await_scores(process, path, 10)
    there = score_count(path)
    path.rename(new)
    _, stderr = process.communicate(timeout=120)
    assert process.returncode == 2, stderr
    assert "old.db: was renamed or removed while it was written" in " ".join(stderr.split())
    assert "states are scored in" not in stderr
    assert score_count(new) >= there and not path.exists()


def test_ctrl_c_ends_a_driver_that_waits_for_a_first_worker(folder):
    with Cluster() as cluster:
        process = start(folder, "waiting.db", "--scheduler", cluster.address)
        said = ""
        while "no workers at" not in said:
            said = process.stderr.readline()
            assert said, "it ended"
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        assert process.returncode == 130


def test_a_cluster_that_loses_a_worker_gives_the_same_bits(folder, undisturbed):
    with Cluster(workers=2) as cluster:
        process = start(folder, "cluster.db", "--scheduler", cluster.address)
        await_scores(process, folder / "cluster.db", 50)
        cluster.kill_worker()
        stderr = finish(process)
    assert "300 states are scored" in stderr and "Traceback" not in stderr
    require_complete(folder / "cluster.db", undisturbed)


def test_a_process_that_is_killed_ends_the_command_and_the_same_one_goes_on(folder, undisturbed):
    process = start(folder, "processes.db", "--processes", 2)
    await_scores(process, folder / "processes.db", 50)
    os.kill(workers_of(process.pid)[0], signal.SIGKILL)
    _, stderr = process.communicate(timeout=120)
    assert process.returncode == 2 and "Traceback" not in stderr
    said = " ".join(stderr.split())
    assert "SIGKILL" in said and "is kept: the same call goes on from there" in said
    assert 50 <= score_count(folder / "processes.db") < STATES * METRICS
    finish(start(folder, "processes.db", "--processes", 2))
    require_complete(folder / "processes.db", undisturbed)


def test_a_cluster_makes_the_same_dataset_to_the_byte(folder):
    with Cluster(workers=2) as cluster:
        made = ["generate", "topple", "--trajectories", "30", "--seed", "2", "-o", "again.h5"]
        done = subprocess.run(
            [COMMAND, *made, "--scheduler", cluster.address],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
    assert done.returncode == 0 and "300 states" in done.stderr, done.stderr
    assert (folder / "again.h5").read_bytes() == (folder / "topple.h5").read_bytes()


def test_ctrl_c_stops_processes_and_keeps_what_is_done(folder, undisturbed):
    process = start(folder, "stopped.db", "--processes", 2)
    await_scores(process, folder / "stopped.db", 50)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=30)
    assert process.returncode == 130 and "Traceback" not in stderr
    assert "of 300 states are scored and kept in stopped.db" in stderr
    finish(start(folder, "stopped.db"))
    require_complete(folder / "stopped.db", undisturbed)
