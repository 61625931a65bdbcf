"""Parts `cores` and `growth`: what two threads gain, and how time grows with the tree; a push."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from statistics import median

import numpy as np

import energymargin as em
from measurements import Pairs, Settings, Tell, digits, in_turns, problems_of, rollouts
from tables import markdown

__all__ = ["FRAME_TREES", "Cores", "Growth", "measure_cores", "measure_growth"]

FRAME_TREES = 4  # so many for two threads: one that wakes up late leaves more of them to the other


@dataclass
class Cores:
    """What there is so far."""

    settings: Settings
    threads: dict[str, Pairs] = field(default_factory=dict)
    """Wall time of a job on one thread (ours) and on two (the other)."""
    frames: Pairs | None = None
    """Wall time: one tree on one thread; FRAME_TREES that share its nodes on two."""

    def tables(self) -> str:
        """In Markdown."""
        rows = [
            [
                job,
                digits(median(pairs.ours)),
                digits(median(pairs.others)),
                f"x {pairs.ratio():.2f}",
            ]
            for job, pairs in self.threads.items()
        ]
        table = markdown(["job", "1 thread [s]", "2 threads [s]", "throughput"], rows)
        return f"A push, by the clock on the wall.\n\n{table}" if rows else ""


@dataclass
class Growth:
    """What there is so far."""

    settings: Settings
    times: dict[int, list[float]] = field(default_factory=dict)
    """By the number of nodes [s]."""

    def slopes(self) -> tuple[float, float]:
        """Slopes of log time over log nodes: by least squares, and the largest of neighbours."""
        nodes = np.log(list(self.times))
        times = np.log([median(seconds) for seconds in self.times.values()])
        between = [(t - s) / (n - m) for (m, s), (n, t) in pairwise(zip(nodes, times, strict=True))]
        return float(np.polyfit(nodes, times, 1)[0]), float(max(between))

    def tables(self) -> str:
        """In Markdown."""
        rows = [
            [f"{nodes:,}", digits(median(seconds)), digits(1e6 * median(seconds) / nodes)]
            for nodes, seconds in self.times.items()
        ]
        table = markdown(["nodes", "time [s]", "a node [us]"], rows)
        return f"A push, CPU time.\n\n{table}" if rows else ""


def measure_cores(cores: Cores, tell: Tell) -> None:
    """Fills it job by job."""
    settings = cores.settings
    pushes = problems_of("push", settings.states)
    few, many = settings.nodes
    batch = problems_of("push", settings.batch)

    def score_batch(threads: int) -> None:
        em.score(batch, nodes=few, threads=threads)

    def score_one(threads: int) -> None:
        em.score(pushes[:1], nodes=many, threads=threads)

    def grow_trees(threads: int) -> None:
        em.capture_score(pushes[0], nodes=few, trees=8, threads=threads, warn=False)

    def search(threads: int) -> None:
        em.escape_effort(pushes[0], nodes=8 * many, searches=8, threads=threads, warn=False)

    jobs = {
        f"`em.score`: {len(batch)} states, {few:,} nodes, all metrics": score_batch,
        f"`em.score`: one state, {many:,} nodes, all metrics": score_one,
        f"`em.capture_score`: one state, 8 trees of {few:,} nodes": grow_trees,
        f"`em.escape_effort`: one state, 8 searches of {many:,} nodes": search,
    }
    for name, job in jobs.items():
        tell(f"two threads: {name}")
        turns = [partial(job, threads) for threads in (1, 2)]
        one, two = in_turns(turns, settings.rounds, time.perf_counter)
        cores.threads[name] = Pairs(one, two)
    tell("two threads: trees of a frame")
    cores.frames = trees_of_a_frame(pushes, settings)


def trees_of_a_frame(pushes: list[em.Problem], settings: Settings) -> Pairs:
    """One tree on one thread, and several on two."""
    nodes = settings.nodes[0]
    some = {"nodes": nodes // FRAME_TREES, "trees": FRAME_TREES, "threads": 2}
    one, two = [], []
    for problem in pushes:
        score = partial(em.capture_score, problem, warn=False)
        turns = [partial(score, nodes=nodes), partial(score, **some)]
        of_one, of_two = in_turns(turns, settings.rounds, time.perf_counter)
        one += of_one
        two += of_two
    return Pairs(one, two)


def measure_growth(growth: Growth, tell: Tell) -> None:
    """Fills it tree by tree."""
    settings = growth.settings
    (push,) = problems_of("push", 1)
    for nodes in settings.growth:
        tell(f"a tree of {nodes:,} nodes")
        rounds = settings.rounds if nodes <= 1000 else 1
        (run,) = rollouts(push, "--alone", "--rounds", rounds, "--nodes", nodes)
        growth.times[nodes] = run["ours"]
