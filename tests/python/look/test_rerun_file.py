"""The recipe of the guide for a file of rerun, read by rerun's own command."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import energymargin as em

pytest.importorskip("rerun", reason="rerun-sdk is of the extra [dev], which this Python lacks")
GUIDE = Path(__file__).parents[3] / "docs" / "guides" / "recordings.md"


def test_rerun_finds_moving_bodies_and_scores_over_time(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))  # no session of rerun yet, in which it sends nothing
    recipe = re.search(r"## In rerun.*?```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)[1]
    assert recipe.count("\n") <= 20
    exec(compile(recipe, GUIDE.name, "exec"), {"em": em})
    command = [sys.executable, "-m", "rerun", "rrd", "print", "push.rrd"]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ)
    lines = [line.split(" - ") for line in done.stdout.splitlines() if line.startswith("Chunk(")]
    found = {entity: f"{size} {columns}" for size, entity, columns, *_ in lines}
    for name in ("capture", "force"):
        assert "20 rows" in found[f"/scores/{name}"] and "Scalars" in found[f"/scores/{name}"]
    assert "20 rows" in found["/scene/object"] and "Transform3D" in found["/scene/object"]
    assert "Mesh3D" in found["/scene/object/0"]
