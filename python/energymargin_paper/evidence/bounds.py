"""Efforts of escape between two bounds: against answers known on paper, in cages, and on the tasks.

Every problem is one line of runs.jsonl in the folder, written as soon as it is finished: stopped
and started again, the study goes on with what is missing.
"""

from __future__ import annotations

import csv
import io
import math
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, fields
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from energymargin import tasks
from energymargin._core import Cancel, Problem, effort_lower_bound, escape_effort
from energymargin.base.checks import whole_number
from energymargin.base.plausibility import PlausibilityWarning
from energymargin_paper.evidence import cages, planar_cages
from energymargin_paper.evidence.known_answers import KNOWN
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["STUDY", "Bounds", "Job", "Row", "Settings", "figure_bounds"]

RUNS_FILE = "runs.jsonl"
TASKS = ("push", "balance", "topple", "grasp", "scoop")
# Where the answer is a rise of potential energy alone, along any way that the object can go.
CONSERVATIVE = ("edge", "notch", "rim", "bowl")
OPEN_BOXES = ("boxes", "compound", "hulls")
GAPS = (0.0, 0.8, 0.9, 1.05, 1.2)  # in widths of the bar
BAR = 0.8  # of the least ratio of lower bound and answer
KINDS = {
    "conservative": "Answers on paper: a rise of potential energy",
    "other": "Answers on paper: friction, a compliant joint, a cage, nothing at all",
    "gap": "A bar in a pen with a gap, in widths of the bar",
    "planar cage": "Closed cages in a plane",
    "cage": "Closed cages in space, whose object turns freely",
    "task": "Captured states of the tasks",
}


@dataclass(frozen=True)
class Settings:
    """Settings of the study; raises ValueError on numbers out of range."""

    cells: int = setting(200_000, "Cells of each lower bound.")
    nodes: int = setting(2000, "Nodes of each search.")
    cages: int = setting(100, "Closed cages of each kind.")
    states: int = setting(5, "Captured states of each task.")

    def __post_init__(self) -> None:
        """Checks the numbers."""
        for name in ("cells", "nodes"):
            whole_number(name, getattr(self, name), 1)
        for name in ("cages", "states"):
            whole_number(name, getattr(self, name), 0)


@dataclass(frozen=True)
class Job:
    """One problem to be bounded."""

    version: str
    kind: str
    """One of KINDS."""
    name: str
    cells: int
    nodes: int


@dataclass(frozen=True)
class Row:
    """What came out."""

    kind: str
    name: str
    lower: float
    """Lower bound [J]; inf: a proved cage."""
    upper: float
    """Effort of the best escape found [J]; inf without one."""
    answer: float
    """On paper [J]; nan: unknown."""
    cells: int
    """That were looked at."""
    complete: bool
    reason: str
    seconds: float
    """That the lower bound took, on one thread [s]."""

    @property
    def proved(self) -> bool:
        """Whether it is a proved cage."""
        return math.isinf(self.lower)


@dataclass(frozen=True, eq=False)
class Bounds:
    """What came out."""

    rows: list[Row]

    def of(self, kind: str) -> list[Row]:
        """The rows of one of KINDS."""
        return [row for row in self.rows if row.kind == kind]

    def wrong(self) -> list[Row]:
        """Where a lower bound is above the answer, or above an escape."""
        return [
            row
            for row in self.rows
            if row.lower > row.upper or (not math.isnan(row.answer) and row.lower > row.answer)
        ]

    def to_csv(self) -> str:
        """One line for each problem."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([field.name for field in fields(Row)])
        writer.writerows(astuple(row) for row in self.rows)
        return text.getvalue()

    def to_markdown(self) -> str:
        """A table for each kind; the cages in one line each kind."""
        lines = ["# Bounds", "", f"Lower bounds above an answer or an escape: {len(self.wrong())}."]
        for kind, title in KINDS.items():
            rows = self.of(kind)
            if rows and kind in ("planar cage", "cage"):
                lines += ["", f"## {title}", "", *_cage_table(rows)]
            elif rows:
                lines += ["", f"## {title}", "", *_table(rows)]
        return "\n".join(lines) + "\n"


def _table(rows: Sequence[Row]) -> list[str]:
    lines = [
        "| problem | lower bound L [J] | answer [J] | effort found U [J] | L / answer | L / U "
        "| cells | seconds | why L is 0 |",
        "| --- " * 9 + "|",
    ]
    for row in rows:
        ratios = [_ratio(row.lower, row.answer), _ratio(row.lower, row.upper)]
        values = [_joules(row.lower), _joules(row.answer), _joules(row.upper), *ratios]
        cells = [row.name, *values, f"{row.cells:,}", f"{row.seconds:.1f}", row.reason]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _cage_table(rows: Sequence[Row]) -> list[str]:
    cells = [row.cells for row in rows if row.proved]
    seconds = [row.seconds for row in rows if row.proved]
    most = f"{max(cells):,} cells, {max(seconds):.1f} s" if cells else "—"
    middle = f"{np.median(cells):,.0f} cells, {np.median(seconds):.1f} s" if cells else "—"
    left = ", ".join(row.name for row in rows if not row.proved) or "none"
    return [
        "| cages | proved | in the median | at most | not proved |",
        "| --- | --- | --- | --- | --- |",
        f"| {len(rows)} | {sum(row.proved for row in rows)} | {middle} | {most} | {left} |",
    ]


def _joules(value: float) -> str:
    if math.isnan(value):
        return "—"
    return "∞" if math.isinf(value) else f"{value:.4g}"


def _ratio(lower: float, upper: float) -> str:
    return f"{lower / upper:.3f}" if 0.0 < upper < math.inf else "—"


class BoundsStudy(Study[Settings, Bounds]):
    """The effort of escape between a lower bound and the best escape found.

    On problems whose answer is known on paper, in closed cages, in a pen with a gap, and on
    captured states of the tasks. No lower bound is to be above an answer or an escape, and closed
    cages in a plane are to be proved. The folder gets bounds.md, bounds.csv, bounds.png and
    runs.jsonl, one line a problem.

    Example: `energymargin reproduce bounds --cells 50000 --cages 20`
    """

    name = "bounds"
    title, unit = "Bounding efforts", "problems"
    settings = Settings()
    quick = Settings(cells=20_000, nodes=100, cages=3, states=1)
    improved = True

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Bounds:
        """Bounds every problem that is not in the folder yet."""
        path, lines = folder / RUNS_FILE, pairs(Job, Row)
        with warnings.catch_warnings():
            # Random scenes float and are heavy.
            warnings.simplefilter("ignore", PlausibilityWarning)
            rows = resumed(
                path, list(_jobs(settings)), _run, threads, lines=lines, progress=progress
            )
        return Bounds(list(rows.values()))

    def figures(self, result: Bounds) -> Iterator[tuple[str, Figure]]:
        """For each problem with a finite bound, L, the answer and U."""
        yield "bounds.png", figure_bounds(result)


STUDY = BoundsStudy()


def _jobs(settings: Settings) -> Iterator[Job]:
    program, cells, nodes = version("energymargin"), settings.cells, settings.nodes
    names = {
        "conservative": [*CONSERVATIVE, *(f"open box of {walls}" for walls in OPEN_BOXES)],
        "other": [name for name in KNOWN if name not in CONSERVATIVE],
        "gap": [str(gap) for gap in GAPS],
        "planar cage": [str(seed) for seed in range(settings.cages)],
        "cage": [str(seed) for seed in range(settings.cages)],
        "task": [f"{task} {i}" for task in TASKS for i in range(settings.states)],
    }
    for kind, of in names.items():
        for name in of:
            # Searches of cages find nothing: the study of walls makes them.
            yield Job(program, kind, name, cells, 1 if kind.endswith("cage") else nodes)


def _known(name: str) -> tuple[Problem, float]:
    if name.startswith("open box of "):
        return cages.open_box(name.removeprefix("open box of "))
    known = KNOWN[name]()
    return known.problem, known.answer


def _cage(name: str) -> tuple[Problem, float]:
    walls = OPEN_BOXES[int(name) % len(OPEN_BOXES)]  # of a mesh they would take another package
    return cages.random_cage(int(name), walls).problem, math.inf


def _captured_state(name: str) -> tuple[Problem, float]:
    """The middle one of the captured states of a task's trajectory."""
    task_name, seed = name.split()
    task = tasks.make(task_name)
    trajectory = task.rollout(seed=int(seed))
    captured = np.flatnonzero(trajectory.captured)
    frame = int(captured[len(captured) // 2]) if len(captured) else 0
    return task.problem(trajectory.states[frame], trajectory.params), math.nan


PROBLEMS: dict[str, Callable[[str], tuple[Problem, float]]] = {
    "conservative": _known,
    "other": _known,
    "gap": lambda name: (planar_cages.pen(float(name)), math.nan),
    "planar cage": lambda name: (planar_cages.planar_cage(int(name))[0], math.inf),
    "cage": _cage,
    "task": _captured_state,
}


def _run(job: Job, cancel: Cancel) -> Row:
    problem, answer = PROBLEMS[job.kind](job.name)
    upper = escape_effort(problem, nodes=job.nodes, cancel=cancel).effort
    begun = time.perf_counter()
    bound = effort_lower_bound(problem, cells=job.cells, cancel=cancel)
    seconds = time.perf_counter() - begun
    outcome = (bound.effort, upper, answer, bound.cells, bound.complete, bound.reason, seconds)
    return Row(job.kind, job.name, *outcome)


COLOR, LIGHT = "#0072B2", "#D55E00"


def figure_bounds(result: Bounds) -> Figure:
    """Bars from L to U over the answer; and how many cells a proof takes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 3.6), dpi=200, layout="constrained")
    _draw_ratios(figure.add_subplot(1, 2, 1), result.of("conservative"))
    _draw_proofs(figure.add_subplot(1, 2, 2), result)
    return figure


def _draw_ratios(ax: Axes, rows: Sequence[Row]) -> None:
    places = np.arange(len(rows))
    lower = np.array([row.lower / row.answer for row in rows])
    upper = np.array([min(row.upper / row.answer, 1e3) for row in rows])
    ax.vlines(places, lower, upper, color="0.7", linewidth=4)
    ax.plot(places, lower, "^", color=COLOR, label="lower bound L")
    ax.plot(places, upper, "v", color=LIGHT, label="effort found U")
    ax.axhline(1.0, color="black", linewidth=1, linestyle="--", label="answer on paper")
    ax.axhline(BAR, color="black", linewidth=0.5, linestyle=":")
    ax.set_xticks(places, [row.name for row in rows], rotation=30, ha="right", fontsize=7)
    ax.set_ylim(0.7, min(2.0, 1.05 * float(upper.max(initial=1.1))))
    ax.set_ylabel("over the answer", fontsize=8)
    ax.legend(frameon=False, fontsize=7)


def _draw_proofs(ax: Axes, result: Bounds) -> None:
    for kind, color in (("planar cage", COLOR), ("cage", LIGHT)):
        rows = result.of(kind)
        cells = np.sort([row.cells for row in rows if row.proved])
        if len(cells):
            share = np.arange(1, len(cells) + 1) / len(rows)
            ax.step(cells, share, where="post", color=color, label=f"{kind}s ({len(rows)})")
    ax.set_xscale("log")
    ax.set_ylim(0.0, 1.05)
    ax.set_xlabel("cells", fontsize=8)
    ax.set_ylabel("share of closed cages proved", fontsize=8)
    if ax.lines:
        ax.legend(frameon=False, fontsize=7)
