"""Where the energy of rollouts goes, and what the simulation leaves open, on every task.

From random recorded states of each task random disturbances act, as the search draws them. The
audit of each rollout balances its energy; the leftover of the balance is the simulation's error.
It is compared with the energy that the rollout turned over, for two lengths of the step and two
numbers of solver iterations.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import datasets, tasks
from energymargin._core import Audit, Box, Problem, Scene, Sphere, World
from energymargin.base.checks import whole_number
from energymargin.base.table_text import csv_text, markdown_table
from energymargin.tasks.base import Task
from energymargin_paper.study import Progress, Study, setting

__all__ = [
    "CAUSES",
    "ENTRIES",
    "ERRORS",
    "SETTINGS",
    "STUDY",
    "TASKS",
    "AuditedRollout",
    "Audits",
    "Cause",
    "Settings",
    "stepped",
]

TASKS = ("push", "balance", "topple", "grasp", "push-multi", "scoop")
ENTRIES = (
    "wrench",
    "plan",
    "friction",
    "contacts",
    "joints",
    "damping",
    "drives",
    "overlap",
    "integration",
)
SETTINGS = ((1 / 240, 50), (1 / 480, 50), (1 / 240, 200), (1 / 480, 200))  # step [s], iterations
SHARES = {  # in the table: percentiles of entries
    "leftover": (("median", 50), ("99 %", 99), ("worst", 100)),
    "integration": (("median", 50), ("99 %", 99)),
    "overlap": (("median", 50), ("99 %", 99)),
}


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    tasks: tuple[str, ...] = setting(TASKS, "Tasks, separated by commas.")
    rollouts: int = setting(100, "Rollouts of each task with each stepping.")
    seed: int = setting(0, "Seed of the states and of the disturbances.")
    trajectories: int = 20
    """Trajectories of each task that the states are drawn from."""

    def __post_init__(self) -> None:
        """Checks the numbers; `compute` checks the names of the tasks."""
        whole_number("rollouts", self.rollouts, 1)
        whole_number("trajectories", self.trajectories, 1)


@dataclass(frozen=True)
class AuditedRollout:
    """One rollout."""

    task: str
    step: float
    """Step of the simulation [s]."""
    iterations: int
    """Iterations of the solver, at most."""
    audit: Audit

    def share(self, entry: str) -> float:
        """An entry's size over the energy turned over; 0 where nothing was."""
        size = abs(float(getattr(self.audit, entry)))
        return size / self.audit.turnover if self.audit.turnover > 0 else 0.0


@dataclass(frozen=True, eq=False)
class Audits:
    """The result."""

    rows: list[AuditedRollout] = field(default_factory=list)

    def of(self, task: str, step: float, iterations: int) -> list[AuditedRollout]:
        """The rollouts of a task with one setting."""
        return [r for r in self.rows if (r.task, r.step, r.iterations) == (task, step, iterations)]

    def groups(self) -> Iterator[tuple[str, float, int, list[AuditedRollout]]]:
        """Task, step, iterations and the rollouts, in the order they were made."""
        for key in dict.fromkeys((row.task, row.step, row.iterations) for row in self.rows):
            yield *key, self.of(*key)

    def to_csv(self) -> str:
        """One line for each rollout [J]."""
        names = ("energy_change", *ENTRIES, "leftover", "turnover")
        rows = [
            (row.task, row.step, row.iterations, *(getattr(row.audit, name) for name in names))
            for row in self.rows
        ]
        return csv_text(("task", "step", "solver_iterations", *names), rows)

    def to_markdown(self) -> str:
        """The errors as a table, and those of the small scenes."""
        columns = [f"{entry}, {name}" for entry, shares in SHARES.items() for name, _ in shares]
        text = (
            "What the balance leaves over, and what the steps and the penetration recovery "
            "are known to change, as shares of the energy that a rollout turned over."
        )
        lines = []
        for task, step, iterations, rows in self.groups():
            cells = [
                f"{100 * np.percentile([row.share(entry) for row in rows], percentile):.2g} %"
                for entry, shares in SHARES.items()
                for _, percentile in shares
            ]
            cells.append(f"{1e3 * max(abs(row.audit.leftover) for row in rows):.2g}")
            lines.append([task, f"1/{round(1 / step)} s", str(iterations), *cells])
        header = ("task", "step", "iterations", *columns, "leftover, worst, mJ")
        return f"{text}\n\n{markdown_table(header, lines)}\n\n{_causes_table()}\n"


class AuditStudy(Study[Settings, Audits]):
    """Where the energy of rollouts goes, and how much of it the simulation leaves open.

    Random disturbances on random states of each task, with two lengths of the simulation's step and
    two numbers of solver iterations; and small scenes, each with one cause of error. The folder
    gets audit.md and audit.csv. Stopped with Ctrl-C, it writes what is done.

    Example: `energymargin reproduce audit --tasks push,grasp`
    """

    name = "audit"
    title, unit = "Auditing", "rollouts"
    settings = Settings()
    quick = Settings(rollouts=10)
    resumes = threaded = False

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Audits:
        """Audits random rollouts of each task, with every setting of SETTINGS. Raises ValueError on
        an unknown task."""
        audits = Audits()
        made = [tasks.make(name) for name in settings.tasks]
        total = len(made) * settings.rollouts * len(SETTINGS)
        try:
            for row in _rows(made, settings):
                audits.rows.append(row)
                progress(len(audits.rows), total)
        except KeyboardInterrupt:
            self.write(audits, folder)
            raise
        return audits


STUDY = AuditStudy()


def _rows(made: list[Task], settings: Settings) -> Iterator[AuditedRollout]:
    for task in made:
        random = np.random.default_rng(settings.seed)
        dataset = datasets.generate(task, trajectories=settings.trajectories, seed=settings.seed)
        recorded = dataset.problems()
        problems = [recorded[i] for i in random.integers(len(recorded), size=settings.rollouts)]
        wrenches = [_wrench(problem, random) for problem in problems]
        for step, iterations in SETTINGS:
            for problem, wrench in zip(problems, wrenches, strict=True):
                yield _audited(task.name, problem, wrench, step, iterations)


def stepped(problem: Problem, **stepping: float) -> Problem:
    """The problem with another `step` [s], `solver_iterations` or `solver_tolerance` of its
    scene, which is changed in its text: a Scene keeps what it was made with."""
    fields = json.loads(problem.to_json())
    fields["scene"] |= stepping
    return Problem.from_json(json.dumps(fields))


def _wrench(problem: Problem, random: np.random.Generator) -> NDArray[np.float64]:
    """Within the bounds, on each of k objects: shape (6,), or (k, 6) for more than one."""
    most = np.concatenate([problem.force, problem.torque])
    objects = sum(body.role == "object" for body in problem.scene.bodies)
    return random.uniform(-most, most, (objects, 6) if objects > 1 else (6,))


def _audited(
    name: str, problem: Problem, wrench: NDArray[np.float64], step: float, iterations: int
) -> AuditedRollout:
    again = stepped(problem, step=step, solver_iterations=iterations)
    rollout = World(again.scene).rollout(again.state, wrench, again.duration, audit=True)
    assert rollout.audit is not None  # it was asked for
    return AuditedRollout(name, step, iterations, rollout.audit)


# Small scenes, each with one cause of error in the energy, undisturbed.
GRAVITY = 9.81  # m/s^2
NONE = (0.0, 0.0, 0.0)
ERRORS = ("contacts", "integration", "overlap", "leftover")  # of an audit


@dataclass(frozen=True)
class Cause:
    """One scene."""

    name: str
    scale: float
    """The energy that its errors are compared with [J]."""
    seconds: float
    build: Callable[[float, int], Scene]
    """From the step [s] and the number of solver iterations; it starts as it is built."""

    def audit(self, step: float, iterations: int) -> Audit:
        """Audit of one rollout without a disturbance."""
        scene = self.build(step, iterations)
        rollout = World(scene).rollout(scene.pack(), np.zeros(6), self.seconds, audit=True)
        assert rollout.audit is not None  # it was asked for
        return rollout.audit


def _fall(step: float, iterations: int) -> Scene:
    scene = Scene(step=step, solver_iterations=iterations)
    scene.add_body("ball", Sphere(0.05), mass=1.0, role="object")
    return scene


def _spin(step: float, iterations: int) -> Scene:
    scene = Scene(gravity=NONE, step=step, solver_iterations=iterations)
    spin = (0.1, 20.0, 0.1)  # rad/s, about the axis of the middle moment: it turns over
    box = Box((0.05, 0.1, 0.2))
    scene.add_body("box", box, mass=1.0, angular_velocity=spin, role="object")
    return scene


def _spring(step: float, iterations: int) -> Scene:
    scene = Scene(gravity=NONE, step=step, solver_iterations=iterations)
    scene.add_body("post", Box((0.02, 0.02, 0.02)), mass=0)
    scene.add_body(
        "ball", Sphere(0.05), mass=1.0, position=(0, 0, 0.3), velocity=(1, 0, 0), role="object"
    )
    scene.add_spring("post", "ball", stiffness=200.0, rest_length=0.3)
    return scene


def _stiff_joint(step: float, iterations: int) -> Scene:
    scene = Scene(gravity=NONE, step=step, solver_iterations=iterations)
    scene.add_body("post", Box((0.02, 0.02, 0.02)), mass=0)
    scene.add_body("rod", Box((0.2, 0.02, 0.02)), mass=0.1)
    scene.add_joint(
        "hinge",
        parent="post",
        child="rod",
        axis=(0, 1, 0),
        child_origin=(-0.1, 0, 0),
        stiffness=20.0,
        start=0.1,
        target=0.0,
    )
    scene.add_body("bystander", Sphere(0.05), mass=1.0, position=(9, 0, 0), role="object")
    return scene


def _overlap(step: float, iterations: int) -> Scene:
    scene = Scene(step=step, solver_iterations=iterations)
    scene.add_plane("table")
    scene.add_body("block", Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.049), role="object")
    return scene


def _landing(step: float, iterations: int) -> Scene:
    scene = Scene(step=step, solver_iterations=iterations)
    scene.add_plane("table")
    scene.add_body(
        "box",
        Box((0.05, 0.1, 0.2)),
        mass=1.0,
        position=(0, 0, 0.3),
        velocity=(0.5, 0, 0),
        angular_velocity=(1, 5, 2),
        role="object",
    )
    return scene


def _stack(upper: float) -> Callable[[float, int], Scene]:
    def build(step: float, iterations: int) -> Scene:
        scene = Scene(step=step, solver_iterations=iterations)
        scene.add_plane("table")
        box = Box((0.1, 0.1, 0.1))
        scene.add_body("lower", box, mass=1.0, position=(0, 0, 0.05), role="object")
        scene.add_body("upper", box, mass=upper, position=(0, 0, 0.15), velocity=(0.3, 0, 0))
        return scene

    return build


CAUSES = (
    Cause("a ball falls for 0.5 s, of its energy", 0.5 * (GRAVITY * 0.5) ** 2, 0.5, _fall),
    Cause(
        "a box spins at 20 rad/s and turns over, of its energy",
        0.5 * (0.05**2 + 0.2**2) / 12 * 20.0**2,
        1.0,
        _spin,
    ),
    Cause("a ball swings on a spring, of its energy", 0.5, 1.0, _spring),
    Cause("a stiff joint without damping, of its energy", 0.5 * 20.0 * 0.1**2, 0.2, _stiff_joint),
    Cause("a block starts 1 mm deep in the table, of m g h", GRAVITY * 0.001, 0.5, _overlap),
    Cause("a box tumbles onto a table, of m g h", GRAVITY * 0.3, 1.0, _landing),
    Cause("a box slides on one like it, of its energy", 0.5 * 0.3**2, 0.5, _stack(1.0)),
    Cause(
        "a box slides on one of 1/50 its mass, of its energy", 0.5 * 50 * 0.3**2, 0.5, _stack(50.0)
    ),
)


def _causes_table() -> str:
    """The errors of each cause with the first three of SETTINGS."""
    lines = []
    for cause, (step, iterations) in product(CAUSES, SETTINGS[:3]):
        audit = cause.audit(step, iterations)
        shares = (100 * getattr(audit, name) / cause.scale for name in ERRORS)
        cells = (f"{share:+.2g} %" if abs(share) > 1e-6 else "0" for share in shares)
        lines.append([cause.name, f"1/{round(1 / step)} s", str(iterations), *cells])
    table = markdown_table(("what happens", "step", "iterations", *ERRORS), lines)
    return f"Errors by cause, as shares of the energy that is named.\n\n{table}"
