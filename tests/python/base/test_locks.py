"""One writer of a file: who has it, and what becomes of it."""

import gc
import os
import subprocess
import sys

import pytest
import sliding
from full_disks import full_disk

import energymargin as em
from energymargin.base.locks import Lock

KEEPS = """
import pathlib, sys
from energymargin.base.locks import Lock
lock = Lock(pathlib.Path(sys.argv[1]), "scoring into")
print("has it", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def path(tmp_path):
    return tmp_path / "s.db"


def test_one_process_at_a_time_has_it_and_its_number_is_said(path):
    with subprocess.Popen(
        [sys.executable, "-c", KEEPS, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout.readline() == b"has it\n"
        with pytest.raises(ValueError, match=rf"process {other.pid} is writing .*s\.db: let it"):
            Lock(path, "writing")
        other.kill()
        other.wait()
        Lock(path, "writing").close()
    assert os.listdir(path.parent) == []


def test_closed_twice_it_leaves_the_lock_of_the_next_owner(path):
    first = Lock(path, "writing")
    first.close()
    with Lock(path, "writing"):
        first.close()
        with pytest.raises(ValueError, match="is writing"):
            Lock(path, "writing")


def test_a_store_that_is_closed_twice_leaves_other_files_and_stores(path):
    first = em.store.ScoreStore(path, create=True)
    first.close()
    with (path.parent / "other.txt").open("w") as other:  # has the number of the closed file
        first.close()
        other.write("x")
        other.flush()
    with em.store.ScoreStore(path, create=True):
        first.close()
        with pytest.raises(ValueError, match="is scoring into"):
            em.store.ScoreStore(path, create=True)


@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
def test_one_that_is_forgotten_is_free(path):
    lock = Lock(path, "writing")
    del lock
    gc.collect()
    Lock(path, "writing").close()


def test_a_full_disk_is_said_and_leaves_no_lock(path):
    with full_disk(), pytest.raises(OSError, match=r"s\.db"):
        Lock(path, "writing")
    Lock(path, "writing").close()
    assert os.listdir(path.parent) == []


def test_two_searches_with_one_file_are_refused_by_name(tmp_path):
    file, refused = tmp_path / "search.db", []
    asked = {"metric": "probability", "budget": 1000, "rollouts": 4, "threads": 1}

    def search(progress=None):
        ranges = {"x": (-0.9, 0.3, 0.9)}
        return em.improve(
            sliding.problem(), ranges, sliding.still, store=file, progress=progress, **asked
        )

    def second(_done, _total):
        if not refused:
            with pytest.raises(
                ValueError, match=rf"process {os.getpid()} is scoring into .*\.db: let"
            ):
                search()
            refused.append(True)

    first = search(second)
    assert refused and search().to_csv() == first.to_csv()
    assert os.listdir(tmp_path) == ["search.db"]


def kept(file):
    """How many answers a store has."""
    with em.store.AnswerFile(file) as store:
        return store.value("SELECT count(*) FROM answers")


def test_what_was_evaluated_before_a_stop_is_kept(tmp_path):
    """However many plans a worker was given at once, which is by the clock."""
    file, lines = tmp_path / "search.db", []

    class Stop(Exception):
        pass

    def stop(_done, _total):
        lines.append(kept(file))
        if lines[-1] >= 5:
            raise Stop

    asked = {"budget": 1000, "rollouts": 4, "threads": 1}
    search = sliding.problem(), {"x": (-0.9, 0.3, 0.9)}, sliding.still
    with pytest.raises(Stop):
        em.improve(*search, **asked, progress=stop, store=file)
    at_stop = kept(file)
    resumed = em.improve(*search, **asked, store=file)
    assert lines[-1] <= at_stop < kept(file)
    assert resumed.to_csv() == em.improve(*search, **asked).to_csv()
