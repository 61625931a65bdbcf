"""Part `start`: what a new process waits for, from `import` to its first score."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import pybullet_data

from first_call import __file__ as FIRST_CALL
from measurements import Settings, Tell, digits, problems_of
from tables import markdown

__all__ = ["Start", "measure_start"]

IMPORT = "`import energymargin`"
MESH = "duck.obj"  # of pybullet_data
# By the name of a job of first_call.py.
JOBS = {
    "score": "`em.capture_score` of a push, 100 nodes",
    "hand": "the scene of `grasp`, its hand of 12 joints from URDF",
    "hand's world": "`em.World` of that scene",
    "mesh": f"`em.mesh` of `{MESH}` from a warm cache, and its World",
}


@dataclass
class Start:
    """What there is so far."""

    settings: Settings
    imports: list[float] = field(default_factory=list)
    """One a process [s]."""
    calls: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    """By job: the first call and the second one of each process [s]."""

    def tables(self) -> str:
        """In Markdown."""
        if not self.imports:
            return ""
        rows = [[IMPORT, digits(1e3 * median(self.imports)), ""]]
        for job, calls in self.calls.items():
            first, again = (1e3 * median(times) for times in zip(*calls, strict=True))
            rows.append([JOBS[job], digits(first), digits(again)])
        text = (
            f"Medians of {len(self.imports)} processes that find their files in memory, wall time."
            " The import is the total of `python -X importtime`, which adds a little; the other"
            " rows begin after it.\n\n"
        )
        return text + markdown(["in a new process", "first [ms]", "again [ms]"], rows)


def measure_start(start: Start, tell: Tell) -> None:
    """Fills it process by process. If times count, one more comes first: then files are in memory,
    and the mesh's parts in the cache."""
    count = start.settings.processes
    runs = range(count + start.settings.full)
    tell("import")
    start.imports += [imported() for _ in runs][-count:]
    with TemporaryDirectory() as folder:
        push = Path(folder) / "push.json"
        problems_of("push", 1)[0].save(push)
        files = {"score": str(push), "mesh": str(Path(pybullet_data.getDataPath()) / MESH)}
        for job, name in JOBS.items():
            tell(name)
            calls = [called(job, files.get(job, ""), folder) for _ in runs]
            start.calls[job] = calls[-count:]


def imported() -> float:
    """Import time of the package by -X importtime [s]."""
    done = run("-X", "importtime", "-c", "import energymargin")
    last = done.stderr.splitlines()[-1]  # import time: own | cumulative | energymargin
    return 1e-6 * float(last.split("|")[1])


def called(job: str, file: str, cache: str) -> tuple[float, float]:
    """Both calls of a job of first_call.py."""
    first, again = json.loads(run(FIRST_CALL, job, file, ENERGYMARGIN_CACHE=cache).stdout)
    return first, again


def run(*arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """A Python process."""
    return subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, **variables},
        check=True,
        capture_output=True,
        text=True,
    )
