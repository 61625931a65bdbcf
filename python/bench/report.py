"""What was measured, in Markdown, and beside it what is asked of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from statistics import median
from typing import Any

from measurements import Pairs, Settings, digits
from speed_cores import FRAME_TREES, Cores, Growth
from speed_frame import SOON, Frames
from speed_tasks import HEADLINE, Cost, Tasks
from tables import machine, markdown

__all__ = ["report"]

TITLES = {
    "tasks": "Tasks, on one thread",
    "frame": "A camera's frame",
    "answer": "To an answer within 0.05",
    "error": "At equal error, beside MuJoCo",
    "cores": "Two threads",
    "growth": "Large trees",
    "bodies": "Many bodies",
    "start": "Start-up",
}

# The bars. The public Python implementation takes 2.7 s for 1,000 nodes of a push, on another
# machine of two cores.
PUSH = 0.27  # s for 1,000 nodes
PUBLIC = 2.7  # s for them
OVER_MUJOCO = {"push": 0.6, "balance": 0.6, "topple": 0.6, "push-real": 0.6}
FRAME = {"push": 0.012, "balance": 0.012, "topple": 0.012, "push-real": 0.012, "grasp": 0.030}  # s
FRAME_THREADS = {"grasp": 2}
TREES_OF_A_FRAME = 0.030  # s, of a camera at 33 Hz
THROUGHPUT = 1.9
SLOPE = 1.05
NODE = 400  # B

ENGINES: dict[str, Callable[[Cost], Pairs]] = {
    "`mj_step`": lambda cost: cost.mujoco.step,
    "`mujoco.rollout`": lambda cost: cost.mujoco.rollout,
    "PyBullet": lambda cost: cost.pybullet,
}


def report(measured: Mapping[str, Any], settings: Settings, load: float) -> str:
    """All there is, by part."""
    versions = machine("mujoco", "pybullet", "numpy")
    parts = [
        "# Speed\n",
        f"{versions}; load {load:.1f} before. Medians of {settings.states} states of a task and"
        f" {settings.rounds} rounds of each.\n",
    ]
    for part, results in measured.items():
        if table := results.tables():
            parts += [f"## {TITLES[part]}\n", table]
    if not settings.full:
        parts += ["Too few measurements to tell how fast.\n"]
    elif rows := [row for results in measured.values() for row in bars(results)]:
        parts += ["## What is asked\n", markdown(["", "asked", "measured"], rows)]
    return "\n".join(parts)


def bars(results: Any) -> Iterator[list[str]]:
    """Rows of a part: what it is, what is asked, and what there is so far."""
    if isinstance(results, Tasks):
        yield from of_tasks(results)
    elif isinstance(results, Frames):
        for task, asked in FRAME.items():
            if results.soon.get(task):
                threads = FRAME_THREADS.get(task, 1)
                what = f"{task}: {SOON:g} s ahead, threads: {threads} [ms]"
                took = 1e3 * results.wall(task, threads)
                yield [what, f"<= {1e3 * asked:.0f}", digits(took)]
    elif isinstance(results, Cores):
        yield from of_cores(results)
    elif isinstance(results, Growth) and len(results.times) > 1:
        fitted, steepest = results.slopes()
        what = f"slope of log time over log nodes, up to {max(results.times):,}"
        yield [what, f"<= {SLOPE}", f"{fitted:.3f}, at most {steepest:.3f} between neighbours"]


def of_tasks(tasks: Tasks) -> Iterator[list[str]]:
    """The bars of a step, of a push and of a node."""
    many = tasks.settings.nodes[1]
    for task, costs in tasks.costs.items():
        if not costs:
            continue
        if task == HEADLINE:
            took = tasks.of(task, lambda c: median(c.floor[many].ours))
            what = f"{task}: {many:,} nodes [s]"
            yield [what, f"<= {PUSH}", f"{digits(took)}, x {PUBLIC / took:.1f} of {PUBLIC} s"]
            for name, engine in ENGINES.items():
                took = median(median(engine(cost).others) for cost in costs)
                yield [f"the same edges by {name} [s]", "", digits(took)]
        asked = OVER_MUJOCO.get(task, 1.0)
        yield [f"{task}: ours / mj_step", f"<= {asked:g}", f"{tasks.over_mujoco(task):.3f}"]
    for task, weight in tasks.bytes.items():
        if task == HEADLINE:
            yield [f"{task}: a node [B]", f"<= {NODE}", f"{weight:.0f}"]


def of_cores(cores: Cores) -> Iterator[list[str]]:
    """The bars of two threads."""
    few = cores.settings.nodes[0]
    if frames := cores.frames:
        what = f"{FRAME_TREES} trees of {few // FRAME_TREES:,} nodes of a push, threads: 2 [ms]"
        took = 1e3 * median(frames.others)
        yield [what, f"<= {1e3 * TREES_OF_A_FRAME:.0f}", digits(took)]
    for job, pairs in list(cores.threads.items())[:1]:
        yield [f"two threads over one, {job}", f">= {THROUGHPUT}", f"x {pairs.ratio():.2f}"]
