"""A disk that is full: what was there stays whole, what is new is whole or gone, and it is said.

A limit of the size of files is met in the middle of a write, as the end of a disk is.
"""

import resource
import signal
from contextlib import contextmanager

import numpy as np
import pytest

import energymargin as em
from energymargin.grasps import GraspObject, GraspSet, Motion, ParallelGripper, Protocol, score
from energymargin.records.datasets.files import Sink

OLD = b"what was there"
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
GRASPS = GraspSet(np.array([DOWN] * 200))


@contextmanager
def files_of_at_most(size):
    """Files end after so many bytes."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # as Python does, whatever a library did since
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture(scope="module")
def dataset():
    return em.datasets.generate("push", trajectories=3, frames=100)


@pytest.mark.parametrize("size", [0, 40, 700, 3000, 20_000, 100_000])
def test_a_dataset_that_does_not_fit_leaves_the_old_file(dataset, tmp_path, size):
    path, whole = tmp_path / "push.h5", tmp_path / "whole.h5"
    dataset.save(whole)
    path.write_bytes(OLD)
    with pytest.raises(OSError, match=r"File too large: '.*push.h5'"), files_of_at_most(size):
        dataset.save(path)
    assert path.read_bytes() == OLD
    assert {file.name for file in tmp_path.iterdir()} == {"push.h5", "whole.h5"}
    dataset.save(path)
    assert path.read_bytes() == whole.read_bytes()


def test_what_a_full_disk_dropped_is_read_as_zeros(tmp_path):
    """HDF5 reads back what it has written, and takes what its buffer holds for it."""
    buffer = bytearray(b"garbage")
    with Sink(tmp_path / "file") as sink:
        with files_of_at_most(0):
            sink.write(b"written")
        sink.seek(0)
        assert sink.readinto(buffer) == 7 and buffer == bytes(7)
        with pytest.raises(OSError, match="File too large"):
            sink.require_written()
        sink._error = None


@pytest.mark.parametrize("name", ["g.h5", "g.csv", "g.json", "g.yaml"])
def test_grasps_that_do_not_fit_leave_the_old_file(tmp_path, name):
    path = tmp_path / name
    for size in (0, 700, 3000):
        path.write_bytes(OLD)
        with pytest.raises(OSError, match=f"File too large: '.*{name}'"), files_of_at_most(size):
            em.grasps.write(path, GRASPS, np.ones(200), frame="grasp", overwrite=True)
        assert path.read_bytes() == OLD and [*tmp_path.iterdir()] == [path]


def test_scores_of_grasps_that_do_not_fit_leave_those_that_did(tmp_path):
    path, ten = tmp_path / "scores.db", GRASPS[:10]
    hand, cube = ParallelGripper(opening=0.08, force=10.0), GraspObject(em.Box((0.04,) * 3), 0.2)
    asked = {"protocol": Protocol([Motion("hold", 0.02)]), "rollouts": 1, "step": 1 / 240}
    stop = em.Cancel()
    score(ten, hand, cube, **asked, store=path, progress=lambda *_: stop.set(), cancel=stop)
    with pytest.raises(OSError, match=r"scores\.db"), files_of_at_most(3000):
        score(ten, hand, cube, **asked, store=path)
    seen = []
    again = score(ten, hand, cube, **asked, store=path, progress=lambda *n: seen.append(n))
    assert seen[0][0] >= 1 and again.complete and [*tmp_path.iterdir()] == [path]


def test_shards_that_do_not_fit_are_made_again(tmp_path):
    path = tmp_path / "push.h5"
    asked = {"trajectories": 3, "frames": 100, "path": path}
    with pytest.raises(OSError, match=r"push\.h5"), files_of_at_most(20_000):
        em.datasets.generate("push", **asked)
    assert not path.exists()
    with em.datasets.generate("push", **asked) as made:
        assert len(made.trajectories) == 3


def test_a_page_and_a_picture_that_do_not_fit_leave_the_old_ones(tmp_path):
    from energymargin.base.replacing import replace_figure
    from energymargin.plots import plot_grasps

    hand, cube = ParallelGripper(opening=0.08, force=10.0), GraspObject(em.Box((0.04,) * 3), 0.2)
    protocol = Protocol([Motion("hold", 0.02)])
    scores = score(GRASPS[:1], hand, cube, protocol, rollouts=1, step=1 / 240)
    page, picture = tmp_path / "page.html", tmp_path / "picture.png"
    for path in (page, picture):
        path.write_bytes(OLD)
    with files_of_at_most(5000):
        with pytest.raises(OSError, match=r"File too large: '.*page.html'"):
            em.report.write_grasps(scores, page)
        with pytest.raises(OSError, match=r"File too large: '.*picture.png'"):
            replace_figure(picture, plot_grasps(scores).get_figure(root=True))
    assert {page.read_bytes(), picture.read_bytes()} == {OLD}
    assert {*tmp_path.iterdir()} == {page, picture}
