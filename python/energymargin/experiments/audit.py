"""Where the energy of rollouts goes, and what the simulation leaves open, on every task.

From random recorded states of each task random disturbances act, as the search draws them. The
audit of each rollout balances its energy; the leftover of the balance is the simulation's error.
It is compared with the energy that the rollout turned over, for two lengths of the step and two
numbers of solver iterations.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from energymargin import datasets, tasks
from energymargin._core import Audit, Problem, World
from energymargin.tasks.base import whole_number

__all__ = [
    "ENTRIES",
    "QUICK",
    "ROLLOUTS",
    "SETTINGS",
    "TASKS",
    "Audits",
    "Row",
    "reproduce",
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
ROLLOUTS = 100
QUICK = 10
SETTINGS = ((1 / 240, 50), (1 / 480, 50), (1 / 240, 200), (1 / 480, 200))  # step [s], iterations
TRAJECTORIES = 20  # of each task, that the states are drawn from
SHARES = {  # in the table: percentiles of entries
    "leftover": (("median", 50), ("99 %", 99), ("worst", 100)),
    "integration": (("median", 50), ("99 %", 99)),
    "overlap": (("median", 50), ("99 %", 99)),
}


@dataclass(frozen=True)
class Row:
    """One rollout."""

    task: str
    step: float
    """Of the simulation [s]."""
    iterations: int
    """Of the solver, at most."""
    audit: Audit

    def share(self, entry: str) -> float:
        """An entry's size over the energy turned over; 0 where nothing was."""
        size = abs(float(getattr(self.audit, entry)))
        return size / self.audit.turnover if self.audit.turnover > 0 else 0.0


@dataclass(frozen=True)
class Audits:
    """What came out."""

    rows: list[Row] = field(default_factory=list)

    def of(self, task: str, step: float, iterations: int) -> list[Row]:
        """The rollouts of a task with one setting."""
        return [r for r in self.rows if (r.task, r.step, r.iterations) == (task, step, iterations)]

    def groups(self) -> Iterator[tuple[str, float, int, list[Row]]]:
        """Task, step, iterations and the rollouts, in the order they were made."""
        for key in dict.fromkeys((row.task, row.step, row.iterations) for row in self.rows):
            yield *key, self.of(*key)

    def to_csv(self) -> str:
        """One line for each rollout [J]."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        names = ("energy_change", *ENTRIES, "leftover", "turnover")
        writer.writerow(("task", "step", "solver_iterations", *names))
        for row in self.rows:
            values = (getattr(row.audit, name) for name in names)
            writer.writerow((row.task, row.step, row.iterations, *values))
        return text.getvalue()

    def to_markdown(self) -> str:
        """The errors as a table."""
        columns = [f"{entry}, {name}" for entry, shares in SHARES.items() for name, _ in shares]
        lines = [
            "What the balance leaves over, and what the steps and the penetration recovery "
            "are known to change, as shares of the energy that a rollout turned over.",
            "",
            f"| task | step | iterations | {' | '.join(columns)} | leftover, worst, mJ |",
            "| --- " * (4 + len(columns)) + "|",
        ]
        for task, step, iterations, rows in self.groups():
            cells = [
                f"{100 * np.percentile([row.share(entry) for row in rows], percentile):.2g} %"
                for entry, shares in SHARES.items()
                for _, percentile in shares
            ]
            cells.append(f"{1e3 * max(abs(row.audit.leftover) for row in rows):.2g}")
            lines.append(f"| {task} | 1/{round(1 / step)} s | {iterations} | {' | '.join(cells)} |")
        return "\n".join(lines) + "\n"


def reproduce(
    rollouts: int,
    *,
    names: Sequence[str] = TASKS,
    trajectories: int = TRAJECTORIES,
    seed: int = 0,
    into: Audits | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Audits:
    """Audits `rollouts` random rollouts of each task, with every setting.

    Rows go `into` an object of the caller's as they are made, who has them also if this is stopped.
    `progress(done, total)` is called after each rollout. Raises ValueError on an unknown task.
    """
    rollouts = whole_number("rollouts", rollouts, 1)
    audits = Audits() if into is None else into
    made = [tasks.make(name) for name in names]
    total = len(made) * rollouts * len(SETTINGS)
    for task in made:
        random = np.random.default_rng(seed)
        recorded = datasets.generate(task, trajectories=trajectories, seed=seed).problems()
        problems = [recorded[i] for i in random.integers(len(recorded), size=rollouts)]
        wrenches = [_wrench(problem, random) for problem in problems]
        for step, iterations in SETTINGS:
            for problem, wrench in zip(problems, wrenches, strict=True):
                audits.rows.append(_audited(task.name, problem, wrench, step, iterations))
                if progress is not None:
                    progress(len(audits.rows), total)
    return audits


def stepped(problem: Problem, step: float, iterations: int) -> Problem:
    """The same problem, simulated in other steps [s]."""
    said = json.loads(problem.to_json())
    said["scene"].update(step=step, solver_iterations=iterations)
    return Problem.from_json(json.dumps(said))


def _wrench(problem: Problem, random: np.random.Generator) -> NDArray[np.float64]:
    """Within the bounds, on each of k objects: shape (6,), or (k, 6) for more than one."""
    most = np.concatenate([problem.force, problem.torque])
    objects = sum(body.role == "object" for body in problem.scene.bodies)
    return random.uniform(-most, most, (objects, 6) if objects > 1 else (6,))


def _audited(
    name: str, problem: Problem, wrench: NDArray[np.float64], step: float, iterations: int
) -> Row:
    again = stepped(problem, step, iterations)
    rollout = World(again.scene).rollout(again.state, wrench, again.duration, audit=True)
    assert rollout.audit is not None  # it was asked for
    return Row(name, step, iterations, rollout.audit)
