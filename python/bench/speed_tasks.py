"""Part `tasks`: what a score costs, beside Bullet alone, MuJoCo and PyBullet on the same edges."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from statistics import mean, median

import numpy as np

import energymargin as em
from edges import Edge, edges_of, positions
from energymargin.base.aliases import Floats
from energymargin.mujoco.mjcf import TOLERANCE
from measurements import Pairs, Settings, Tell, digits, in_turns, problems_of, rollouts
from mujoco_rollouts import MuJoCoEdges
from pybullet_rollouts import PyBulletScene
from tables import markdown

__all__ = ["Cost", "Tasks", "cost_of", "measure_tasks"]

SHORT = 4  # steps of the longest edge of trees that are weighed: as much memory in less time
HEADLINE = "push"  # the task whose large tree PyBullet replays too


@dataclass(frozen=True)
class MuJoCo:
    """On the larger tree."""

    step: Pairs
    """Against mj_step."""
    rollout: Pairs
    """Against mujoco.rollout."""
    contacts: tuple[float, float]
    """Mean number of contacts at the ends of edges: ours, and MuJoCo's at its own ends."""
    iterations: float
    """Iterations of its solver, the mean of all steps."""


@dataclass(frozen=True)
class Cost:
    """Cost of one state."""

    floor: dict[int, Pairs]
    """Against Bullet alone, by the number of nodes."""
    mujoco: MuJoCo
    pybullet: Pairs
    """On the smaller tree; of HEADLINE, on the larger one."""


@dataclass
class Tasks:
    """What there is so far."""

    settings: Settings
    costs: dict[str, list[Cost]] = field(default_factory=dict)
    """Costs of the states of each task."""
    bytes: dict[str, float] = field(default_factory=dict)
    """Memory of a node, by task [B]."""

    def of(self, task: str, value: Callable[[Cost], float]) -> float:
        """The median of a task's states."""
        return median(value(cost) for cost in self.costs[task])

    def step(self, task: str) -> float:
        """Time of a step of ours, in large trees [s]."""
        return self.of(task, lambda c: a_step(self._floor(c).ours, self._floor(c).steps))

    def over_floor(self, task: str) -> float:
        """Our time over that of Bullet alone."""
        return self.of(task, lambda c: self._floor(c).ratio())

    def over_mujoco(self, task: str) -> float:
        """Our time over that of mj_step."""
        return self.of(task, lambda c: c.mujoco.step.ratio())

    def _floor(self, cost: Cost) -> Pairs:
        return cost.floor[self.settings.nodes[1]]

    def tables(self) -> str:
        """In Markdown."""
        tasks = [task for task, costs in self.costs.items() if costs]
        return "\n".join(self._tables(tasks)) if tasks else ""

    def _tables(self, tasks: Sequence[str]) -> Iterator[str]:
        few, many = self.settings.nodes
        yield (
            f"A step is one of the trees of {many:,} nodes; stock Bullet and MuJoCo replay their"
            f" edges, PyBullet those of {few:,} nodes (of {HEADLINE}, {many:,}). Times are of the"
            " CPU, ratios the medians of pairs that take turns.\n"
        )
        headers = [f"{few:,} nodes [ms]", f"{many:,} nodes [ms]", "steps", "a step [us]"]
        headers += ["Bullet [us]", "mj_step [us]", "mujoco.rollout [us]", "PyBullet [us]"]
        headers += ["ours / Bullet", "ours / mj_step", "ours / mujoco.rollout", "a node [B]"]
        yield markdown(["task", *headers], [self._times(task) for task in tasks])
        yield (
            "How far the objects go along an edge, and how far from our ends of the edges the"
            " others leave them, all medians. Contacts are those at the ends of edges, the mean."
            f" MuJoCo: Newton to a tolerance of {TOLERANCE:g}, elliptic friction cones; iterations"
            " are its solver's, the mean of all steps. Bullet has at most"
            f" {em.Scene().solver_iterations} a step. PyBullet controls joints its own way.\n"
        )
        headers = ["along an edge [mm]", "Bullet off by", "MuJoCo off by", "PyBullet off by"]
        headers += ["contacts, ours", "contacts, MuJoCo", "iterations, MuJoCo"]
        yield markdown(["task", *headers], [self._agreement(task) for task in tasks])

    def _times(self, task: str) -> list[str]:
        few, many = self.settings.nodes
        of = partial(self.of, task)
        weight = self.bytes.get(task)
        return [
            task,
            digits(1e3 * of(lambda c: median(c.floor[few].ours))),
            digits(1e3 * of(lambda c: median(c.floor[many].ours))),
            f"{of(lambda c: c.floor[many].steps):.0f}",
            f"{1e6 * self.step(task):.2f}",
            f"{1e6 * of(lambda c: others_step(c.floor[many])):.2f}",
            f"{1e6 * of(lambda c: others_step(c.mujoco.step)):.2f}",
            f"{1e6 * of(lambda c: others_step(c.mujoco.rollout)):.2f}",
            f"{1e6 * of(lambda c: others_step(c.pybullet)):.1f}",
            f"{self.over_floor(task):.3f}",
            f"{self.over_mujoco(task):.3f}",
            f"{of(lambda c: c.mujoco.rollout.ratio()):.3f}",
            "" if weight is None else f"{weight:.0f}",
        ]

    def _agreement(self, task: str) -> list[str]:
        of = partial(self.of, task)
        return [
            task,
            digits(1e3 * of(lambda c: self._floor(c).moved)),
            digits(1e3 * of(lambda c: self._floor(c).apart)),
            digits(1e3 * of(lambda c: c.mujoco.step.apart)),
            digits(1e3 * of(lambda c: c.pybullet.apart)),
            f"{of(lambda c: c.mujoco.contacts[0]):.1f}",
            f"{of(lambda c: c.mujoco.contacts[1]):.1f}",
            f"{of(lambda c: c.mujoco.iterations):.1f}",
        ]


def a_step(times: Sequence[float], steps: int) -> float:
    """The median [s]."""
    return median(times) / steps


def others_step(pairs: Pairs) -> float:
    """The other one's [s]."""
    return a_step(pairs.others, pairs.others_steps)


def measure_tasks(tasks: Tasks, tell: Tell) -> None:
    """Fills it state by state."""
    settings = tasks.settings
    for task in settings.tasks:
        problems = problems_of(task, settings.states)
        costs = tasks.costs.setdefault(task, [])
        for number, problem in enumerate(problems, 1):
            tell(f"{task}: state {number} of {len(problems)}")
            large = task == HEADLINE
            costs.append(cost_of(problem, settings.nodes, settings.rounds, large=large))
        tell(f"{task}: memory")
        tasks.bytes[task] = bytes_of_node(problems[0], settings.weighed)


def cost_of(problem: em.Problem, nodes: tuple[int, int], rounds: int, *, large: bool) -> Cost:
    """What one state costs. `large`: PyBullet too replays the larger tree."""
    runs = rollouts(problem, "--rounds", rounds, "--nodes", *nodes)
    floor = {run.pop("nodes"): Pairs(**run) for run in runs}
    mujoco = against_mujoco(problem, nodes[1], rounds)
    return Cost(floor, mujoco, against_pybullet(problem, nodes[large], rounds))


def against_mujoco(problem: em.Problem, nodes: int, rounds: int) -> MuJoCo:
    """Our trees, and MuJoCo on their edges."""
    tree = em.capture_score(problem, nodes=nodes, warn=False).tree
    edges = edges_of(problem, tree)
    twin = MuJoCoEdges(problem, edges)
    twin.roll_out()  # which makes its arrays
    score = partial(em.capture_score, problem, nodes=nodes, warn=False)
    ours, stepped, rolled = in_turns([score, twin.step, twin.roll_out], rounds)
    _, contacts, iterations = twin.stepped()
    moved, apart = distances(problem, tree, edges, twin.step())
    last = np.cumsum([edge.steps for edge in edges]) - 1
    world = em.World(problem.scene)
    touching = mean(len(world.contacts(state)) for state in tree.states[1:])
    step, rollout = (
        Pairs(ours, times, twin.steps, twin.steps, moved, apart) for times in (stepped, rolled)
    )
    return MuJoCo(
        *(step, rollout),
        contacts=(touching, float(np.mean(np.array(contacts)[last]))),
        iterations=mean(iterations),
    )


def against_pybullet(problem: em.Problem, nodes: int, rounds: int) -> Pairs:
    """Our trees, and PyBullet on their edges."""
    tree = em.capture_score(problem, nodes=nodes, warn=False).tree
    edges = edges_of(problem, tree)
    scene = PyBulletScene(problem)
    score = partial(em.capture_score, problem, nodes=nodes, warn=False)
    try:
        ours, others = in_turns([score, partial(scene.replay, edges)], rounds)
        ends = scene.replay(edges)
    finally:
        scene.close()
    steps = round(tree.durations.sum() / problem.scene.step)
    moved, apart = distances(problem, tree, edges, ends)
    return Pairs(ours, others, steps, scene.steps // (rounds + 1), moved, apart)


def distances(
    problem: em.Problem, tree: em.Tree, edges: Sequence[Edge], ends: Floats
) -> tuple[float, float]:
    """How far the objects go along an edge, and how far from there they are at `ends` [m], shape
    (M, k, 3): medians [m]."""
    wanted = positions(problem.scene, tree.states[1:])
    starts = positions(problem.scene, [edge.start for edge in edges])
    moved, apart = (np.linalg.norm(wanted - places, axis=-1) for places in (starts, ends))
    return float(np.median(moved)), float(np.median(apart))


def bytes_of_node(problem: em.Problem, nodes: int) -> float:
    """Peak memory over the nodes."""
    short = SHORT * problem.scene.step
    (run,) = rollouts(problem, "--alone", "--rounds", 1, "--duration", short, "--nodes", nodes)
    return float(run["bytes"]) / nodes
