"""What was measured, in Markdown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from statistics import median

import numpy as np

from measurements import FRAME_TREES, Cost, Results, Settings
from tables import machine, markdown

# Of the public Python implementation: 1,000 nodes of a push with PyBullet, on another machine of
# two cores.
PUBLIC_SECONDS = 2.7
PUBLIC_STEP = 24.7e-6
FRAME = 0.030  # of a camera, at 33 Hz [s]


def report(results: Results) -> str:
    """All there is."""
    settings = results.settings
    parts = [
        "# Speed\n",
        f"{machine('pybullet', 'numpy')}; load {results.load:.1f} before."
        f" Medians of {settings.states} states of a task and {settings.rounds} rounds of each.\n",
    ]
    if any(results.costs.values()):
        parts += ["## Tasks, on one thread\n", *tasks(results)]
    if results.threads:
        parts += ["## Two threads\n", "A push, by the clock on the wall.\n", threads_table(results)]
    if results.growth:
        parts += ["## Large trees\n", "A push.\n", growth_table(results)]
    if settings.nodes == Settings.nodes:
        parts += ["## What a push has to reach\n", *headlines(results)]
    else:
        parts += ["The trees are too little to say how fast.\n"]
    return "\n".join(parts)


def over_states(costs: Sequence[Cost], of: Callable[[Cost], float]) -> float:
    """The median."""
    return median(of(cost) for cost in costs)


def tasks(results: Results) -> Iterator[str]:
    """What a score costs, what a step, and whether all three made the same steps."""
    few, many = results.settings.nodes
    yield (
        f"The floor is a stock Bullet world that makes the steps of the trees of {many:,} nodes;"
        f" PyBullet makes those of {few:,} nodes, as in `python/bench/pybullet_rollouts.py`."
        " Times are of the CPU.\n"
    )
    yield markdown(
        [
            "task",
            f"{few:,} nodes [ms]",
            f"{many:,} nodes [ms]",
            "steps",
            "a step [us]",
            "floor [us]",
            "ours / floor",
            "PyBullet [us]",
            "PyBullet / ours",
            "a node [B]",
        ],
        [task_row(results, task) for task, costs in results.costs.items() if costs],
    )
    yield (
        "How far the objects go along an edge, and how far from our ends of the edges the others"
        " leave them, all medians. PyBullet controls joints its own way.\n"
    )
    yield markdown(
        ["task", "along an edge [mm]", "floor off by [mm]", "PyBullet off by [mm]"],
        [agreement_row(task, costs, many) for task, costs in results.costs.items() if costs],
    )


def task_row(results: Results, task: str) -> list[str]:
    """Of `tasks`."""
    few, many = results.settings.nodes
    costs = results.costs[task]
    weight = results.bytes.get(task)

    def of(value: Callable[[Cost], float]) -> float:
        return over_states(costs, value)

    return [
        task,
        f"{1e3 * of(lambda c: median(c.floor[few].ours)):.1f}",
        f"{1e3 * of(lambda c: median(c.floor[many].ours)):.0f}",
        f"{of(lambda c: c.floor[many].steps):.0f}",
        f"{1e6 * of(lambda c: median(c.floor[many].ours) / c.floor[many].steps):.2f}",
        f"{1e6 * of(lambda c: median(c.floor[many].others) / c.floor[many].steps):.2f}",
        f"{of(lambda c: c.floor[many].ratio()):.3f}",
        f"{1e6 * of(lambda c: median(c.pybullet.others) / c.pybullet.steps):.1f}",
        f"{of(lambda c: 1.0 / c.pybullet.ratio()):.1f}",
        "" if weight is None else f"{weight:.0f}",
    ]


def agreement_row(task: str, costs: Sequence[Cost], nodes: int) -> list[str]:
    """Of `tasks`."""
    return [
        task,
        f"{1e3 * over_states(costs, lambda c: c.floor[nodes].moved):.2f}",
        f"{1e3 * over_states(costs, lambda c: c.floor[nodes].apart):.2f}",
        f"{1e3 * over_states(costs, lambda c: c.pybullet.apart):.2f}",
    ]


def threads_table(results: Results) -> str:
    """A row a job."""
    return markdown(
        ["job", "1 thread [s]", "2 threads [s]", "throughput"],
        [
            [
                job,
                f"{median(pairs.ours):.3f}",
                f"{median(pairs.others):.3f}",
                f"x {pairs.ratio():.2f}",
            ]
            for job, pairs in results.threads.items()
        ],
    )


def slopes(growth: dict[int, list[float]]) -> tuple[float, float]:
    """Of log time over log nodes: by least squares, and the largest between neighbours."""
    nodes = np.log(list(growth))
    times = np.log([median(seconds) for seconds in growth.values()])
    between = [(t - s) / (n - m) for (m, s), (n, t) in pairwise(zip(nodes, times, strict=True))]
    return float(np.polyfit(nodes, times, 1)[0]), float(max(between))


def growth_table(results: Results) -> str:
    """A row a number of nodes."""
    return markdown(
        ["nodes", "time [s]", "a node [us]"],
        [
            [f"{nodes:,}", f"{median(seconds):.3f}", f"{1e6 * median(seconds) / nodes:.0f}"]
            for nodes, seconds in results.growth.items()
        ],
    )


def headlines(results: Results) -> Iterator[str]:
    """The bars for a push, and how far it is over them."""
    yield (
        f"{PUBLIC_SECONDS} s is what the public Python implementation takes for 1,000 nodes of a"
        f" push on a machine of two cores, at {1e6 * PUBLIC_STEP:.1f} us a step.\n"
    )
    yield markdown(["push", "bar", "measured"], list(headline_rows(results)))


def headline_rows(results: Results) -> Iterator[list[str]]:
    """Of what there is so far."""
    few, many = results.settings.nodes
    if push := results.costs.get("push"):
        took = over_states(push, lambda c: median(c.floor[many].ours))
        over = over_states(push, lambda c: c.floor[many].ratio())
        yield [f"{many:,} nodes: over the floor", "<= 1.10", f"{over:.3f}"]
        yield [
            f"{many:,} nodes: faster than {PUBLIC_SECONDS} s",
            ">= 6, goal 10",
            f"x {PUBLIC_SECONDS / took:.1f} ({took:.3f} s)",
        ]
    if frames := results.frames:
        one, two = median(frames.ours), median(frames.others)
        yield [f"a tree of {few:,} nodes on one thread [ms]", "", f"{1e3 * one:.1f}"]
        yield [
            f"{FRAME_TREES} trees of {few // FRAME_TREES:,} nodes on two threads [ms]",
            f"<= {1e3 * FRAME:.0f}",
            f"{1e3 * two:.1f}",
        ]
    for job, pairs in list(results.threads.items())[:1]:
        yield [f"two threads over one, {job}", ">= 1.9", f"x {pairs.ratio():.2f}"]
    if len(results.growth) > 1:
        fitted, steepest = slopes(results.growth)
        yield [
            f"slope of log time over log nodes, up to {max(results.growth):,}",
            "<= 1.05",
            f"{fitted:.3f}, at most {steepest:.3f} between neighbours",
        ]
    if "push" in results.bytes:
        yield ["memory of a node [B]", "<= 1000", f"{results.bytes['push']:.0f}"]
