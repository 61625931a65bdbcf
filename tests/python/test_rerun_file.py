"""A trajectory and its scores as a file of rerun, read by rerun's own command."""

import os
import subprocess
import sys

import pytest
from command_line import run_here

import energymargin as em
from energymargin.plots import write_rerun

pytest.importorskip("rerun", reason="rerun-sdk is of the extra [rerun], which this Python lacks")
RERUN = [sys.executable, "-m", "rerun"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rerun")
    em.datasets.generate("push", trajectories=2, frames=5, seed=0).save(folder / "push.h5")
    ahead = em.datasets.Future(2)
    for future, metrics in ((ahead, ["probability"]), (None, ["effort/est", "force"])):
        settings = {"nodes": 5, "rollouts": 2}
        em.store.score_dataset(
            folder / "push.h5", folder / "push-scores.db", metrics, future=future, **settings
        )
    return folder


def printed(path, home):
    """What rerun finds in a file, by entity; a new home has no session of it yet, in which it sends
    nothing."""
    command = [*RERUN, "rrd", "print", str(path)]
    environment = {**os.environ, "HOME": str(home)}
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    lines = [line.split(" - ") for line in done.stdout.splitlines() if line.startswith("Chunk(")]
    return {entity: f"{size} {columns}" for size, entity, columns, *_ in lines}


def test_rerun_finds_moving_bodies_and_scores_over_time(folder, tmp_path):
    done = run_here("export", "push-scores.db", "-o", "push.rrd", "--trajectory", 1, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "Wrote trajectory 1 to push.rrd. Next: rerun push.rrd" in done.stderr
    found = printed(folder / "push.rrd", tmp_path)
    assert {"/scene/object", "/scene/object/0", "/captured"} < set(found)
    for name in ("probability", "force"):
        assert "5 rows" in found[f"/scores/{name}"] and "Scalars" in found[f"/scores/{name}"]
    assert "5 rows" in found["/scene/object"] and "Transform3D" in found["/scene/object"]
    assert "Mesh3D" in found["/scene/object/0"]


def test_a_file_that_cannot_be_written_is_refused_and_the_old_one_stays(folder):
    scores, data = folder / "push-scores.db", folder / "push.h5"
    (folder / "old.rrd").write_bytes(b"old")
    with pytest.raises(ValueError, match="trajectory is 7, expected a whole number from 0 to 1"):
        write_rerun(scores, data, folder / "old.rrd", trajectory=7)
    assert (folder / "old.rrd").read_bytes() == b"old"
    done = run_here("export", "push-scores.db", "-o", "old.rrd", cwd=folder)
    assert done.returncode == 2 and "old.rrd exists" in done.stderr
