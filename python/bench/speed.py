"""What scores cost: our time against the floor, which is Bullet alone, and against PyBullet.

`make bench` runs this. Each task is asked at some states of recorded trajectories, since the cost
depends on the state. What is compared takes turns, in one process, and what is shown are medians of
the ratios of pairs: so another job on the machine disturbs both. Times on one thread are of the CPU.
"""

from __future__ import annotations

import json
import platform
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import numpy as np
import pybullet_rollouts
import typer
from rich.console import Console

import energymargin as em
from energymargin.progress import share_bar

ROLLOUTS = Path(__file__).parents[2] / "build" / "cpp" / "bench" / "energymargin_rollouts"
TASKS = ("push", "balance", "topple", "grasp", "push-multi", "scoop")
FRAMES = 10

# Of the public Python implementation: 1,000 nodes of a push, at 24.7 us a step with PyBullet, on
# another machine of two cores.
PUBLIC_SECONDS = 2.7
CAMERA_MILLISECONDS = 30.0  # a frame at 33 Hz

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """How much is measured."""

    tasks: tuple[str, ...] = TASKS
    states: int = 8
    rounds: int = 3
    nodes: tuple[int, int] = (100, 1000)
    growth: tuple[int, ...] = (100, 1000, 10_000, 100_000)
    memory: int = 30_000
    """Nodes of the tree that is weighed."""
    batch: int = 60
    """Problems of the dataset that is scored on one thread and on two."""

    def quick(self) -> Settings:
        """The same on little trees: shows that it works, not how fast."""
        return Settings(self.tasks, min(self.states, 2), 1, (10, 50), (10, 50), 1000, 4)

    def work(self) -> int:
        """How many pieces of work there are, for the progress."""
        return len(self.tasks) * (self.states + 1) + len(self.growth) + 4


@dataclass(frozen=True)
class Cost:
    """One state: times of the CPU [s], ours and the others' in turns."""

    ours: dict[int, list[float]]
    """By the number of nodes."""
    floor: dict[int, list[float]]
    steps: dict[int, int]
    floor_steps: dict[int, int]
    floor_apart: float
    """How far from ours the floor leaves the objects at the ends of edges, the median [m]."""
    beside: list[float]
    """Ours, in turns with PyBullet."""
    pybullet: list[float]
    pybullet_steps: int
    pybullet_apart: float
    moved: float
    """How far the objects go along an edge, the median [m]."""


@dataclass
class Results:
    """What there is so far."""

    settings: Settings
    costs: dict[str, list[Cost]] = field(default_factory=dict)
    bytes: dict[str, float] = field(default_factory=dict)
    """A node, by task."""
    threads: dict[str, tuple[str, float, float, float]] = field(default_factory=dict)
    """What, by its name: unit, rate on one thread, on two, and the median ratio of pairs."""
    camera: tuple[float, float] | None = None
    """Push: one tree on one thread, two trees of half the size on two [ms]."""
    growth: dict[int, list[float]] = field(default_factory=dict)
    """Push: time by the number of nodes [s]."""


def problems_of(task: str, count: int) -> list[em.Problem]:
    """Problems of states that are spread over as many trajectories."""
    problems = em.datasets.generate(task, trajectories=count, frames=FRAMES, seed=0).problems()
    return [problems[i * FRAMES + i * FRAMES // count] for i in range(count)]


def rollouts(problem: em.Problem, *arguments: object) -> list[dict[str, Any]]:
    """What `energymargin_rollouts` says of a problem, a dictionary for each number of nodes."""
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


def seconds_of(clock: Callable[[], float], job: Callable[[], object]) -> float:
    """How long a job takes, by a clock."""
    start = clock()
    job()
    return clock() - start


def cost_of(problem: em.Problem, nodes: Sequence[int], rounds: int) -> Cost:
    """What one state costs; PyBullet makes the edges of the smaller tree alone."""
    runs = {run["nodes"]: run for run in rollouts(problem, "--rounds", rounds, "--nodes", *nodes)}
    beside, theirs, steps, apart = against_pybullet(problem, nodes[0], rounds)
    return Cost(
        ours={n: run["ours"] for n, run in runs.items()},
        floor={n: run["floor"] for n, run in runs.items()},
        steps={n: run["steps"] for n, run in runs.items()},
        floor_steps={n: run["floor_steps"] for n, run in runs.items()},
        floor_apart=runs[nodes[-1]]["apart"],
        beside=beside,
        pybullet=theirs,
        pybullet_steps=steps,
        pybullet_apart=apart,
        moved=runs[nodes[-1]]["moved"],
    )


def against_pybullet(
    problem: em.Problem, nodes: int, rounds: int
) -> tuple[list[float], list[float], int, float]:
    """Our times, PyBullet's, its steps, and how far from ours it leaves the objects."""
    ours, theirs = [], []
    tree = em.capture_score(problem, nodes=nodes).tree
    edges = list(pybullet_rollouts.edges(problem, tree))
    scene = pybullet_rollouts.PyBulletScene(problem)
    try:
        for _ in range(rounds):
            ours.append(seconds_of(time.process_time, lambda: em.capture_score(problem, nodes)))
            theirs.append(
                seconds_of(time.process_time, lambda: [scene.rollout(*edge) for edge in edges])
            )
        apart = [
            np.linalg.norm(ends - positions(problem, tree.states[node + 1]), axis=1)
            for node, ends in enumerate(ends_of(scene, edges))
        ]
    finally:
        scene.close()
    return ours, theirs, sum(steps for _, _, steps in edges), float(np.median(apart))


def ends_of(scene: pybullet_rollouts.PyBulletScene, edges: Sequence[Any]) -> Iterator[Any]:
    """Where PyBullet leaves the objects, edge by edge."""
    for edge in edges:
        scene.rollout(*edge)
        yield scene.positions()


def positions(problem: em.Problem, state: Any) -> Any:
    """Of the objects in a state [m], shape (k, 3)."""
    scene = problem.scene
    objects = [body.name for body in scene.bodies if body.role == "object"]
    return np.array([state[scene.slice(name)][:3] for name in objects])


def measure(results: Results, tell: Progress) -> None:
    """Fills the results, piece by piece."""
    settings = results.settings
    for task in settings.tasks:
        problems = problems_of(task, settings.states)
        results.costs[task] = []
        for problem in problems:
            tell(task)
            results.costs[task].append(cost_of(problem, settings.nodes, settings.rounds))
        tell(f"{task}, memory")
        short = 4 * problems[0].scene.step  # as much memory in less time
        (run,) = rollouts(
            problems[0], "--alone", "--rounds", 1, "--duration", short, "--nodes", settings.memory
        )
        results.bytes[task] = run["bytes"] / settings.memory
    pushes = problems_of("push", settings.states)
    measure_threads(results, pushes, tell)
    for nodes in settings.growth:
        tell(f"push, {nodes:,} nodes")
        rounds = settings.rounds if nodes <= 1000 else 1
        (run,) = rollouts(pushes[0], "--alone", "--rounds", rounds, "--nodes", nodes)
        results.growth[nodes] = run["ours"]


def measure_threads(results: Results, pushes: Sequence[em.Problem], tell: Progress) -> None:
    """How much more two threads do than one."""
    settings = results.settings
    nodes, many = settings.nodes
    batch = problems_of("push", settings.batch)
    jobs: dict[str, tuple[str, int, Callable[[int], object]]] = {
        f"`em.score`: {len(batch)} states, {nodes} nodes, all metrics": (
            "states/s",
            len(batch),
            lambda threads: em.score(batch, nodes=nodes, threads=threads),
        ),
        f"`em.score`: one state, {many:,} nodes, all metrics": (
            "states/s",
            1,
            lambda threads: em.score(pushes[:1], nodes=many, threads=threads),
        ),
        f"`em.capture_score`: one state, 8 trees of {nodes} nodes": (
            "trees/s",
            8,
            lambda threads: em.capture_score(pushes[0], nodes, trees=8, threads=threads),
        ),
    }
    for name, (unit, count, job) in jobs.items():
        tell(name.replace("`", ""))
        pairs = [
            [seconds_of(time.perf_counter, lambda n=n, job=job: job(n)) for n in (1, 2)]
            for _ in range(settings.rounds)
        ]
        one, two = (count / median(column) for column in zip(*pairs, strict=True))
        results.threads[name] = (unit, one, two, median(a / b for a, b in pairs))
    tell("push, a frame")
    frames = [
        [
            1e3 * seconds_of(time.perf_counter, lambda p=p: em.capture_score(p, nodes)),
            1e3
            * seconds_of(
                time.perf_counter, lambda p=p: em.capture_score(p, nodes // 2, trees=2, threads=2)
            ),
        ]
        for p in pushes
        for _ in range(settings.rounds)
    ]
    one, two = (median(column) for column in zip(*frames, strict=True))
    results.camera = (one, two)


def over_states(costs: Sequence[Cost], of: Callable[[Cost], float]) -> float:
    """The median of the states."""
    return median(of(cost) for cost in costs)


def ratio(above: Sequence[float], below: Sequence[float]) -> float:
    """The median of the pairs' ratios."""
    return median(a / b for a, b in zip(above, below, strict=True))


def floor_ratio(costs: Sequence[Cost], nodes: int) -> float:
    """Our time over the floor's."""
    return over_states(costs, lambda cost: ratio(cost.ours[nodes], cost.floor[nodes]))


def markdown(headers: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in which all columns but the first are numbers."""
    widths = [max(map(len, column)) for column in zip(headers, *rows, strict=True)]
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    lines = [
        [cell.ljust(widths[0]) if i == 0 else cell.rjust(widths[i]) for i, cell in enumerate(row)]
        for row in (headers, rule, *rows)
    ]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def task_table(results: Results) -> str:
    """A row a task."""
    few, many = results.settings.nodes
    headers = [
        "task",
        f"{few:,} nodes [ms]",
        f"{many:,} nodes [ms]",
        f"steps of {many:,}",
        "a step [us]",
        "floor [us]",
        "ours / floor",
        "PyBullet [us]",
        "PyBullet / ours",
        "a node [B]",
    ]
    rows = []
    for task, costs in results.costs.items():
        if not costs:
            continue
        weight = results.bytes.get(task)
        rows.append(
            [
                task,
                f"{over_states(costs, lambda c: 1e3 * median(c.ours[few])):.1f}",
                f"{over_states(costs, lambda c: 1e3 * median(c.ours[many])):.0f}",
                f"{over_states(costs, lambda c: c.steps[many]):.0f}",
                f"{over_states(costs, lambda c: 1e6 * median(c.ours[many]) / c.steps[many]):.2f}",
                f"{over_states(costs, lambda c: 1e6 * median(c.floor[many]) / c.steps[many]):.2f}",
                f"{floor_ratio(costs, many):.2f}",
                f"{over_states(costs, lambda c: 1e6 * median(c.pybullet) / c.pybullet_steps):.1f}",
                f"{over_states(costs, lambda c: ratio(c.pybullet, c.beside)):.1f}",
                "" if weight is None else f"{weight:.0f}",
            ]
        )
    return markdown(headers, rows)


def agreement_table(results: Results) -> str:
    """Whether all three made the same rollouts."""
    headers = ["task", "along an edge [mm]", "floor off by [mm]", "PyBullet off by [mm]"]
    return markdown(
        headers,
        [
            [
                task,
                *(
                    f"{over_states(costs, lambda c, name=name: 1e3 * getattr(c, name)):.2f}"
                    for name in ("moved", "floor_apart", "pybullet_apart")
                ),
            ]
            for task, costs in results.costs.items()
            if costs
        ],
    )


def threads_table(results: Results) -> str:
    """A row a job."""
    rows = [
        [name, unit, f"{one:.2f}", f"{two:.2f}", f"{gain:.2f}"]
        for name, (unit, one, two, gain) in results.threads.items()
    ]
    return markdown(["push", "unit", "1 thread", "2 threads", "2 / 1"], rows)


def slopes(growth: dict[int, list[float]]) -> tuple[float, float]:
    """Of log time over log nodes: by least squares, and the largest between neighbours."""
    points = [(np.log(nodes), np.log(median(seconds))) for nodes, seconds in growth.items()]
    fitted = np.polyfit(*zip(*points, strict=True), 1)[0]
    return float(fitted), max((t - s) / (n - m) for (m, s), (n, t) in pairwise(points))


def growth_table(results: Results) -> str:
    """A row a number of nodes."""
    rows = [
        [f"{nodes:,}", f"{median(seconds):.3f}", f"{1e6 * median(seconds) / nodes:.0f}"]
        for nodes, seconds in results.growth.items()
    ]
    table = markdown(["nodes", "time [s]", "a node [us]"], rows)
    if len(results.growth) < 2:
        return table
    fitted, steepest = slopes(results.growth)
    return f"{table}\nSlope of log time over log nodes: {fitted:.3f} (least squares), at most {steepest:.3f} between neighbours.\n"


def headlines(results: Results) -> str:
    """What the library has to show, and what it shows."""
    few, many = results.settings.nodes
    rows = []
    if push := results.costs.get("push"):
        took = over_states(push, lambda cost: median(cost.ours[many]))
        rows.append(
            [f"push, {many:,} nodes: over the floor", "<= 1.10", f"{floor_ratio(push, many):.2f}"]
        )
        rows.append(
            [
                f"push, {many:,} nodes: faster than {PUBLIC_SECONDS} s",
                ">= 6, goal 10",
                f"{PUBLIC_SECONDS / took:.1f} ({took:.3f} s)",
            ]
        )
    if results.camera:
        one, two = results.camera
        rows.append([f"push, a tree of {few} nodes, one thread [ms]", "", f"{one:.1f}"])
        rows.append(
            [
                f"push, 2 trees of {few // 2} nodes, two threads [ms]",
                f"<= {CAMERA_MILLISECONDS:.0f}",
                f"{two:.1f}",
            ]
        )
    for name, (_, _, _, gain) in list(results.threads.items())[:1]:
        rows.append([f"two threads over one, {name}", ">= 1.9", f"{gain:.2f}"])
    if len(results.growth) > 1:
        fitted, steepest = slopes(results.growth)
        rows.append(
            [
                f"push, slope of time up to {max(results.growth):,} nodes",
                "<= 1.05",
                f"{fitted:.3f} (at most {steepest:.3f})",
            ]
        )
    if "push" in results.bytes:
        rows.append(["push, memory of a node [B]", "<= 1000", f"{results.bytes['push']:.0f}"])
    return markdown(["must show", "bar", "measured"], rows)


def machine() -> str:
    """What it ran on."""
    names = [
        line.split(":")[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    packages = ", ".join(
        f"{name} {version(name)}" for name in ("energymargin", "pybullet", "numpy")
    )
    return f"{len(names)} x {names[0]}, Python {platform.python_version()}, {packages}"


def report(results: Results) -> str:
    """All of it, in Markdown."""
    settings = results.settings
    few, many = settings.nodes
    parts = [
        "# Speed\n",
        f"{machine()}. Medians over {settings.states} states of a task and {settings.rounds} rounds.\n",
    ]
    if any(results.costs.values()):
        parts += [
            "## Tasks, one thread\n",
            f"A step is one of Bullet's; the floor is a stock Bullet world that makes the same steps of the tree of "
            f"{many:,} nodes, and PyBullet makes those of the tree of {few:,}, as in `python/bench/pybullet_rollouts.py`.\n",
            task_table(results),
            "How far the objects go along an edge, and how far from our ends of the edges the others leave them "
            "(medians): are these the same rollouts?\n",
            agreement_table(results),
        ]
    if results.threads:
        parts += ["## Two threads\n", "By the clock on the wall.\n", threads_table(results)]
    if results.growth:
        parts += ["## Large trees\n", growth_table(results)]
    if settings.nodes != Settings.nodes:
        return "\n".join([*parts, "Quick: shows that it works, not how fast.\n"])
    parts += [
        "## Headlines\n",
        f"{PUBLIC_SECONDS} s is what the public Python implementation takes for a push with 1,000 "
        "nodes on a machine of two cores, at 24.7 us a step.\n",
        headlines(results),
    ]
    return "\n".join(parts)


def main(
    tasks: Annotated[str, typer.Option(help="With commas between.")] = ",".join(TASKS),
    states: Annotated[int, typer.Option(min=1, help="Of each task.")] = Settings.states,
    rounds: Annotated[int, typer.Option(min=1, help="Pairs of each comparison.")] = Settings.rounds,
    quick: Annotated[bool, typer.Option("--quick", help="Little trees: does it work?")] = False,
    out: Annotated[Path | None, typer.Option(help="Markdown file to write as well.")] = None,
) -> None:
    """Measures, and prints Markdown. Ctrl-C ends it at once: then it prints what there is."""
    chosen = tuple(tasks.split(","))
    if unknown := set(chosen) - set(TASKS):
        raise typer.BadParameter(f"{sorted(unknown)}, expected some of {', '.join(TASKS)}")
    settings = Settings(chosen, states, rounds)
    results = Results(settings.quick() if quick else settings)
    done = -1

    def tell(what: str) -> None:
        nonlocal done
        done += 1
        update(what, done / results.settings.work())

    interrupted = False
    with share_bar(Console(stderr=True)) as update:
        try:
            measure(results, tell)
        except KeyboardInterrupt:
            interrupted = True
    text = report(results)
    print(text)
    if out:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(text)
    if interrupted:
        raise typer.Exit(128 + signal.SIGINT)


if __name__ == "__main__":
    typer.run(main)
