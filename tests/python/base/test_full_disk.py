"""Outputs on a full disk: the old file whole, the new one whole or gone, an error in words."""

import os

import numpy as np
import pytest
from full_disks import full_disk
from matplotlib.figure import Figure

import energymargin as em
from energymargin import report
from energymargin.base.replacing import replace_figure, replace_text


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A dataset and its scores."""
    folder = tmp_path_factory.mktemp("full")
    em.datasets.generate("push", trajectories=3, frames=4, seed=0).save(folder / "push.h5")
    em.store.score_dataset(folder / "push.h5", folder / "push-scores.db", ["force"])
    with em.store.ScoreStore(folder / "push-scores.db") as store:  # what SQLite needs is there
        assert store.run().counts() == (12, 12)
        yield folder


def figure():
    made = Figure()
    made.subplots().plot(np.random.default_rng(0).random(3000))
    return made


def report_of(folder, path):
    options = report.Options(draws=5, pictures=0)
    report.write(folder / "push-scores.db", path, options=options)


OUTPUTS = {
    "table.csv": lambda folder, path: em.store.export(folder / "push-scores.db", path),
    "table.parquet": lambda folder, path: em.store.export(folder / "push-scores.db", path),
    "report.html": report_of,
    "scores.md": lambda _folder, path: replace_text(path, "x" * 50_000),
    "plot.png": lambda _folder, path: replace_figure(path, figure()),
    "plot.pdf": lambda _folder, path: replace_figure(path, figure()),
    "plot.svg": lambda _folder, path: replace_figure(path, figure()),
}


@pytest.mark.parametrize("left", [0, 300])
@pytest.mark.parametrize("name", OUTPUTS)
def test_the_old_file_stays_and_the_error_names_it(folder, tmp_path, name, left):
    path = tmp_path / name
    path.write_bytes(b"old")
    with full_disk(left), pytest.raises(OSError, match=rf"\[Errno .*{name}"):
        OUTPUTS[name](folder, path)
    assert path.read_bytes() == b"old" and os.listdir(tmp_path) == [name]
    OUTPUTS[name](folder, path)
    assert path.stat().st_size > 300


def test_a_new_store_is_gone_and_the_same_call_goes_on(folder, tmp_path):
    path = tmp_path / "s.db"
    with full_disk(), pytest.raises(OSError, match=r"s\.db"):
        em.store.score_dataset(folder / "push.h5", path, ["force"])
    assert os.listdir(tmp_path) == []
    assert em.store.score_dataset(folder / "push.h5", path, ["force"])


def test_shards_that_find_no_room_are_said_and_the_same_call_goes_on(tmp_path):
    path, asked = tmp_path / "push.h5", {"trajectories": 60, "frames": 4}
    with full_disk(), pytest.raises(OSError, match=r"push\.h5"):
        em.datasets.generate("push", path=path, **asked)
    with em.datasets.generate("push", path=path, **asked) as dataset:
        assert len(dataset.trajectories) == 60
    assert os.listdir(tmp_path) == ["push.h5"]
