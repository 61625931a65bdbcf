"""Measures what scores cost: ours, the floor's and PyBullet's times in turns, threads, growth."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

import energymargin as em
from pybullet_rollouts import PyBulletScene, edges_of

ROLLOUTS = Path(__file__).parents[2] / "build" / "cpp" / "bench" / "energymargin_rollouts"
TASKS = ("push", "balance", "topple", "grasp", "push-multi", "scoop")
FRAMES = 10
FRAME_TREES = 4  # so many for two threads: one that wakes up late leaves more of them to the other
SHORT = 4  # steps of the longest edge of trees that are weighed: as much memory in less time


@dataclass(frozen=True)
class Settings:
    """How much is measured."""

    tasks: tuple[str, ...] = TASKS
    states: int = 8
    """Of each task."""
    rounds: int = 3
    """Pairs of each comparison."""
    nodes: tuple[int, int] = (100, 1000)
    growth: tuple[int, ...] = (100, 1000, 10_000, 100_000)
    weighed: int = 30_000
    """Nodes of the tree that is weighed."""
    batch: int = 60
    """States of the dataset that is scored on one thread and on two."""

    def quick(self) -> Settings:
        """Little trees: they show that it works, not how fast."""
        return Settings(self.tasks, min(self.states, 2), 1, (10, 50), (10, 50), 1000, 4)

    def pieces(self) -> int:
        """Of work, as `measure` counts them."""
        return len(self.tasks) * (self.states + 1) + 2 + len(self.growth)


@dataclass(frozen=True)
class Pairs:
    """The same rollouts, by us and by another one, in turns."""

    ours: list[float]
    """Times [s]; of the CPU, unless it says otherwise."""
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


@dataclass(frozen=True)
class Cost:
    """Of one state."""

    floor: dict[int, Pairs]
    """Against Bullet alone, by the number of nodes."""
    pybullet: Pairs
    """Against PyBullet, of the smaller tree."""


@dataclass
class Results:
    """What there is so far."""

    settings: Settings
    load: float = field(default_factory=lambda: os.getloadavg()[0])
    """How many jobs there were on the machine before this one, the mean of a minute."""
    costs: dict[str, list[Cost]] = field(default_factory=dict)
    """Of the states of each task."""
    bytes: dict[str, float] = field(default_factory=dict)
    """Of a node, by task."""
    threads: dict[str, Pairs] = field(default_factory=dict)
    """Wall time of a job on one thread (ours) and on two (the other)."""
    frames: Pairs | None = None
    """Wall time of a push: one tree on one thread; FRAME_TREES that share its nodes on two."""
    growth: dict[int, list[float]] = field(default_factory=dict)
    """Of a push, by the number of nodes [s]."""


def measure(results: Results, tell: Callable[[str], None]) -> None:
    """Fills the results piece by piece, and tells which one begins."""
    settings = results.settings
    for task in settings.tasks:
        problems = problems_of(task, settings.states)
        costs = results.costs.setdefault(task, [])
        for problem in problems:
            tell(task)
            costs.append(cost_of(problem, settings.nodes, settings.rounds))
        tell(f"{task}: memory")
        results.bytes[task] = bytes_of_node(problems[0], settings.weighed)
    pushes = problems_of("push", settings.states)
    tell("push: two threads")
    measure_threads(results, pushes)
    tell("push: a frame")
    results.frames = frames_of(pushes, settings.nodes[0], settings.rounds)
    for nodes in settings.growth:
        tell(f"push: {nodes:,} nodes")
        rounds = settings.rounds if nodes <= 1000 else 1
        (run,) = rollouts(pushes[0], "--alone", "--rounds", rounds, "--nodes", nodes)
        results.growth[nodes] = run["ours"]


def problems_of(task: str, count: int) -> list[em.Problem]:
    """Of states at different moments of as many trajectories."""
    problems = em.datasets.generate(task, trajectories=count, frames=FRAMES, seed=0).problems()
    return [problems[i * FRAMES + i * FRAMES // count] for i in range(count)]


def rollouts(problem: em.Problem, *arguments: object) -> list[dict[str, Any]]:
    """What `energymargin_rollouts` says of a problem, for each number of nodes."""
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


def seconds(clock: Callable[[], float], job: Callable[..., object], *arguments: Any) -> float:
    """How long a job takes, by a clock."""
    start = clock()
    job(*arguments)
    return clock() - start


def cost_of(problem: em.Problem, nodes: Sequence[int], rounds: int) -> Cost:
    """What one state costs."""
    runs = rollouts(problem, "--rounds", rounds, "--nodes", *nodes)
    floor = {run.pop("nodes"): Pairs(**run) for run in runs}
    return Cost(floor, against_pybullet(problem, nodes[0], rounds))


def against_pybullet(problem: em.Problem, nodes: int, rounds: int) -> Pairs:
    """Our trees, and PyBullet on their edges."""
    tree = em.capture_score(problem, nodes=nodes, warn=False).tree
    edges = edges_of(problem, tree)
    scene = PyBulletScene(problem)
    ours, others = [], []
    try:
        for _ in range(rounds):
            ours.append(seconds(time.process_time, em.capture_score, problem, nodes))
            others.append(seconds(time.process_time, scene.replay, edges))
        ends = scene.replay(edges)
    finally:
        scene.close()
    wanted = np.array([positions(problem.scene, state) for state in tree.states[1:]])
    starts = np.array([positions(problem.scene, edge.start) for edge in edges])
    steps = round(tree.durations.sum() / problem.scene.step)
    return Pairs(
        ours,
        others,
        steps,
        scene.steps // (rounds + 1),
        moved=float(np.median(np.linalg.norm(wanted - starts, axis=-1))),
        apart=float(np.median(np.linalg.norm(wanted - ends, axis=-1))),
    )


def positions(scene: em.Scene, state: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of the objects in a state [m], shape (k, 3)."""
    objects = [body.name for body in scene.bodies if body.role == "object"]
    return np.array([state[scene.slice(name)][:3] for name in objects])


def bytes_of_node(problem: em.Problem, nodes: int) -> float:
    """Peak memory over the nodes."""
    short = SHORT * problem.scene.step
    (run,) = rollouts(problem, "--alone", "--rounds", 1, "--duration", short, "--nodes", nodes)
    return float(run["bytes"]) / nodes


def measure_threads(results: Results, pushes: Sequence[em.Problem]) -> None:
    """How much sooner two threads are there than one."""
    few, many = results.settings.nodes
    batch = problems_of("push", results.settings.batch)

    def score_batch(threads: int) -> None:
        em.score(batch, nodes=few, threads=threads)

    def score_one(threads: int) -> None:
        em.score(pushes[:1], nodes=many, threads=threads)

    def grow_trees(threads: int) -> None:
        em.capture_score(pushes[0], few, trees=8, threads=threads, warn=False)

    jobs = {
        f"`em.score`: {len(batch)} states, {few:,} nodes, all metrics": score_batch,
        f"`em.score`: one state, {many:,} nodes, all metrics": score_one,
        f"`em.capture_score`: one state, 8 trees of {few:,} nodes": grow_trees,
    }
    for name, job in jobs.items():
        pairs = Pairs([], [])
        for _ in range(results.settings.rounds):
            pairs.ours.append(seconds(time.perf_counter, job, 1))
            pairs.others.append(seconds(time.perf_counter, job, 2))
        results.threads[name] = pairs


def frames_of(pushes: Sequence[em.Problem], nodes: int, rounds: int) -> Pairs:
    """What a frame of a camera has to wait for."""

    def some_trees(problem: em.Problem) -> None:
        em.capture_score(problem, nodes // FRAME_TREES, trees=FRAME_TREES, threads=2, warn=False)

    one, two = [], []
    for problem in pushes:
        for _ in range(rounds):
            one.append(seconds(time.perf_counter, em.capture_score, problem, nodes))
            two.append(seconds(time.perf_counter, some_trees, problem))
    return Pairs(one, two)
