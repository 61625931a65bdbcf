"""What the parts of `make bench` share: problems, clocks, jobs in turns, and our C++ program."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import energymargin as em

__all__ = [
    "FRAMES",
    "TASKS",
    "Pairs",
    "Settings",
    "Tell",
    "in_turns",
    "problems_of",
    "rollouts",
    "seconds",
]

ROLLOUTS = Path(__file__).parents[2] / "build" / "cpp" / "bench" / "energymargin_rollouts"
TASKS = ("push", "balance", "topple", "grasp", "push-multi", "scoop", "push-real")
FRAMES = 10

Tell = Callable[[str], None]
"""Called with what is measured now."""


@dataclass(frozen=True)
class Settings:
    """How much is measured."""

    tasks: tuple[str, ...] = TASKS
    states: int = 8
    """States of each task."""
    rounds: int = 3
    """Rounds of each comparison."""
    nodes: tuple[int, int] = (100, 1000)
    growth: tuple[int, ...] = (100, 1000, 10_000, 100_000)
    weighed: int = 30_000
    """Nodes of the tree that is weighed."""
    batch: int = 60
    """States of the dataset that is scored on one thread and on two."""
    rollouts: int = 30
    """Rollouts of a probability."""
    pushes: int = 20
    """Of each state, at equal error."""
    bodies: tuple[int, ...] = (10, 100, 1000)
    steps: int = 100
    """Simulation steps of the rollout of so many bodies."""
    processes: int = 5
    """That start anew."""

    def quick(self) -> Settings:
        """Little of everything: that shows that it works, not how fast."""
        return Settings(
            self.tasks,
            min(self.states, 2),
            rounds=1,
            nodes=(10, 50),
            growth=(10, 50),
            weighed=1000,
            batch=4,
            rollouts=4,
            pushes=2,
            bodies=(10, 20),
            steps=5,
            processes=1,
        )

    @property
    def full(self) -> bool:
        """Whether the times say how fast it is."""
        return self.nodes == Settings.nodes


@dataclass(frozen=True)
class Pairs:
    """Times of one job by us and by another one, in turns [s]."""

    ours: list[float]
    """Times [s]; of the CPU unless noted otherwise."""
    others: list[float]
    steps: int = 0
    others_steps: int = 0
    moved: float = 0.0
    """How far the objects go along an edge, the median [m]."""
    apart: float = 0.0
    """How far from there the other one leaves them, the median [m]."""

    def ratio(self) -> float:
        """Our time over the other's, the median of the pairs."""
        return median(a / b for a, b in zip(self.ours, self.others, strict=True))


def problems_of(task: str, count: int) -> list[em.Problem]:
    """Problems of states at different moments of as many trajectories."""
    problems = em.datasets.generate(task, trajectories=count, frames=FRAMES, seed=0).problems()
    return [problems[i * FRAMES + i * FRAMES // count] for i in range(count)]


def rollouts(problem: em.Problem, *arguments: object) -> list[dict[str, Any]]:
    """The output of `energymargin_rollouts` for a problem, for each number of nodes."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "problem.json"
        problem.save(file)
        command = [str(ROLLOUTS), str(file), *map(str, arguments)]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode == -signal.SIGINT:
        raise KeyboardInterrupt
    if done.returncode != 0:
        raise RuntimeError(f"{ROLLOUTS.name} failed: {done.stderr.strip()}")
    runs: list[dict[str, Any]] = json.loads(done.stdout)
    return runs


def seconds(clock: Callable[[], float], job: Callable[[], object]) -> float:
    """How long a job takes, by a clock."""
    start = clock()
    job()
    return clock() - start


def digits(value: float) -> str:
    """At least three digits, however small it is."""
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def in_turns(
    jobs: Sequence[Callable[[], object]],
    rounds: int,
    clock: Callable[[], float] = time.process_time,
) -> list[list[float]]:
    """The times of each job [s], so that what else the machine does disturbs all alike."""
    times: list[list[float]] = [[] for _ in jobs]
    for _ in range(rounds):
        for job, of in zip(jobs, times, strict=True):
            of.append(seconds(clock, job))
    return times
