"""How near `escape_effort` comes to the least work, on states of the tasks and where it is known.

On a task's states nobody knows the least work. The best known is the lowest of the library's own
efforts and of a reference search that has more rollouts (`reference_search`). Every search is one
line of a file in the folder, written as soon as it is finished: stopped and started again, the
study goes on with what is missing.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Cancel, Problem, escape_effort
from energymargin.base.checks import whole_number
from energymargin.evaluate.searches import ALGORITHM, ALGORITHM_IMPROVED
from energymargin_paper.evidence import reference_search
from energymargin_paper.evidence.energy_barriers import BARRIERS
from energymargin_paper.evidence.known_answers import KNOWN, known_answers
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "STUDY",
    "LeastEfforts",
    "Search",
    "SearchJob",
    "Settings",
    "State",
    "figure_least_efforts",
    "search",
]

FEW, MANY = 1000, 5000  # nodes at which the efforts are compared
NEGLIGIBLE = 1e-6  # J: efforts below it count as this one
CLOSED_FORMS = {
    name: make for name, make in {**KNOWN, **BARRIERS}.items() if 0.0 < make().answer < math.inf
}
TRAJECTORIES = 200  # of a task, at most, in which states are looked for


@dataclass(frozen=True)
class Settings:
    """Settings of the study; raises ValueError on numbers out of range."""

    tasks: tuple[str, ...] = setting(
        ("push", "balance", "topple", "grasp", "scoop"), "Which tasks, with commas between."
    )
    states: int = setting(10, "States of each task.")
    rollouts: int = setting(20_000, "Of the reference search of a state.")
    nodes: int = setting(MANY, "Of each search of the library.")
    seeds: int = setting(3, "Searches of the library of a state.")
    answer_seeds: int = setting(10, "Searches of each problem whose answer is known; 0 for none.")

    def __post_init__(self) -> None:
        """Checks the numbers."""
        for name in ("states", "rollouts", "nodes", "seeds"):
            whole_number(name, getattr(self, name), 1)
        whole_number("answer_seeds", self.answer_seeds, 0)


@dataclass(frozen=True)
class State:
    """One recorded state of a task: a frame of one trajectory."""

    task: str
    seed: int
    frame: int

    @property
    def name(self) -> str:
        """As it stands in the table of numbers."""
        return f"{self.task} {self.seed} {self.frame}"

    def problem(self) -> Problem:
        """At the state."""
        task = tasks.make(self.task)
        trajectory = task.rollout(seed=self.seed)
        contacts = trajectory.contacts
        return task.problem(
            trajectory.states[self.frame],
            trajectory.params,
            None if contacts is None else contacts[self.frame],
        )


@dataclass(frozen=True)
class ReferenceJob:
    """A reference search of a state, confirmed by a simulation of so many finer steps."""

    algorithm: str
    state: str
    rollouts: int
    finer: int


@dataclass(frozen=True, eq=False)
class Reference:
    """Its effort [J], and the wrench [N and N m, all together] and duration [s] of each piece."""

    effort: float
    pieces: list[tuple[float, float]]


@dataclass(frozen=True)
class SearchJob:
    """A search of the library, of a state or a problem whose answer is known."""

    algorithm: str
    problem: str
    nodes: int
    seed: int


@dataclass(frozen=True, eq=False)
class Search:
    """Its best efforts [J], each with the nodes at which it was found, and its simulation steps."""

    history: list[tuple[int, float]]
    steps: int

    def effort(self, nodes: int) -> float:
        """After so many nodes [J]; inf without an escape."""
        return min((effort for at, effort in self.history if at <= nodes), default=math.inf)


@dataclass(frozen=True, eq=False)
class LeastEfforts:
    """What came out."""

    nodes: int
    answers: dict[str, float]
    """Least work [J] by problem: on paper, or the best known of a state."""
    searches: dict[str, list[Search]]
    """By problem, those of the library."""

    @property
    def groups(self) -> dict[str, list[str]]:
        """The problems of each task, and each problem on its own whose answer is known."""
        groups: dict[str, list[str]] = {}
        for name in self.answers:
            of_task = f"states of {name.split()[0]}"
            groups.setdefault(name if name in CLOSED_FORMS else of_task, []).append(name)
        return groups

    def ratios(self, group: str, nodes: int) -> NDArray[np.float64]:
        """Effort over least work, of each search of a group."""
        return np.array(
            [
                _ratio(search.effort(nodes), self.answers[name])
                for name in self.groups[group]
                for search in self.searches[name]
            ]
        )

    def to_csv(self) -> str:
        """One line a search."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(("problem", "least", "search", *self.columns, "steps"))
        for name, least in self.answers.items():
            for i, search in enumerate(self.searches[name]):
                efforts = [search.effort(nodes) for nodes in self.columns]
                writer.writerow((name, least, i, *efforts, search.steps))
        return text.getvalue()

    def to_markdown(self) -> str:
        """Median and worst ratio of each group."""
        head = " | ".join(f"{n:,} nodes: median | lowest | worst" for n in self.columns)
        lines = [f"| problem | searches | least [J] | {head} |"]
        lines.append("| --- " * (3 + 3 * len(self.columns)) + "|")
        for group, names in self.groups.items():
            cells = []
            for nodes in self.columns:
                ratios = self.ratios(group, nodes)
                cells += [f"**{np.median(ratios):.3f}**", f"{ratios.min():.3f}"]
                cells += [f"{ratios.max():.3f}"]
            least = [self.answers[name] for name in names]
            energies = f"{min(least):.2g} to {max(least):.2g}" if least[1:] else f"{least[0]:.4g}"
            searches = sum(len(self.searches[name]) for name in names)
            lines.append(f"| {group} | {searches} | {energies} | {' | '.join(cells)} |")
        return "\n".join(lines) + "\n"

    @property
    def columns(self) -> list[int]:
        """Nodes at which the efforts are compared."""
        return sorted({min(FEW, self.nodes), self.nodes})


class LeastEffortsStudy(Study[Settings, LeastEfforts]):
    """How near the effort of escape comes to the least work.

    States of the tasks that are captured, stay so if nothing disturbs them, and can be lost: the
    library's efforts over the best known, which is the lowest of them and of a reference search
    (CMA-ES over a few constant wrenches). And problems whose least work is known on paper.

    The folder gets least_efforts.md, least_efforts.csv, least_efforts.png, and one line a search in
    references.jsonl and searches.jsonl.

    Example: `energymargin reproduce least-efforts --tasks topple --states 3`
    """

    name = "least-efforts"
    title, unit = "Searching ways out", "searches"
    settings = Settings()
    quick = Settings(tasks=("topple",), states=1, rollouts=1500, nodes=300, seeds=1, answer_seeds=1)
    packages = ("cma",)
    improved = True

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> LeastEfforts:
        """Makes every search that is not in the folder yet. Raises ValueError on an unknown task,
        and on one that has too few such states."""
        problems, references = _states(settings, folder, threads, progress)
        known = known_answers(of=CLOSED_FORMS) if settings.answer_seeds else []
        problems |= {answer.name: answer.problem for answer in known}
        jobs = [
            SearchJob(ALGORITHM_IMPROVED, name, settings.nodes, seed)
            for name in problems
            for seed in range(settings.answer_seeds if name in CLOSED_FORMS else settings.seeds)
        ]
        runs = resumed(
            folder / "searches.jsonl",
            jobs,
            lambda job, cancel: search(problems[job.problem], job, cancel),
            threads,
            lines=pairs(SearchJob, Search),
            progress=progress,
        )
        searches = {
            name: [r for job, r in runs.items() if job.problem == name] for name in problems
        }
        answers = {answer.name: answer.answer for answer in known}
        for name, reference in references.items():
            found = [search.effort(settings.nodes) for search in searches[name]]
            answers[name] = min([reference.effort, *found])
        return LeastEfforts(settings.nodes, answers, searches)

    def figures(self, result: LeastEfforts) -> Iterator[tuple[str, Figure]]:
        """The ratios of all groups."""
        yield "least_efforts.png", figure_least_efforts(result)


STUDY = LeastEffortsStudy()


def _ratio(effort: float, least: float) -> float:
    return max(effort, NEGLIGIBLE) / max(least, NEGLIGIBLE)


def _states(
    settings: Settings, folder: Path, threads: int, progress: Progress
) -> tuple[dict[str, Problem], dict[str, Reference]]:
    """The first states of each task that are captured, do not leave by themselves, and have an
    escape that the reference search finds."""
    problems: dict[str, Problem] = {}
    references: dict[str, Reference] = {}
    for task in settings.tasks:
        candidates = _candidates(task)
        missing = settings.states
        while missing:
            batch = dict(next(candidates) for _ in range(missing))
            made = _references(batch, settings, folder, threads, progress)
            escapes = {name: r for name, r in made.items() if r.effort < math.inf}
            references |= escapes
            problems |= {name: batch[name] for name in escapes}
            missing -= len(escapes)
    return problems, references


def _candidates(task: str) -> Iterator[tuple[str, Problem]]:
    """One frame of each trajectory, if it is captured and does not leave by itself."""
    frames = len(tasks.make(task).rollout(seed=0).states)
    for seed in range(TRAJECTORIES):
        state = State(task, seed, seed % frames)
        problem = state.problem()
        captured = problem.captured.contains(problem.scene, problem.state)
        if captured and not reference_search.leaves_by_itself(problem):
            yield state.name, problem
    raise ValueError(f"tasks has {task!r}, which has too few states that can be lost")


def _references(
    batch: dict[str, Problem], settings: Settings, folder: Path, threads: int, progress: Progress
) -> dict[str, Reference]:
    made = resumed(
        folder / "references.jsonl",
        [
            ReferenceJob(ALGORITHM, name, settings.rollouts, reference_search.FINER)
            for name in batch
        ],
        lambda job, cancel: _reference(batch[job.state], job, cancel),
        threads,
        lines=pairs(ReferenceJob, Reference),
        progress=progress,
    )
    return {job.state: reference for job, reference in made.items()}


def _reference(problem: Problem, job: ReferenceJob, cancel: Cancel) -> Reference:
    found = reference_search.least_effort(problem, job.rollouts, 0, cancel)
    pieces = [(float(np.linalg.norm(wrench)), duration) for wrench, duration in found.path]
    return Reference(found.effort, pieces)


def search(problem: Problem, job: SearchJob, cancel: Cancel | None = None) -> Search:
    """A search of the library."""
    found = escape_effort(problem, nodes=job.nodes, seed=job.seed, cancel=cancel)
    steps = int(np.round(found.tree.durations.sum() / problem.scene.step))
    return Search([(nodes, effort) for nodes, effort in found.history], steps)


HIGHEST = 10.0  # ratio shown


def figure_least_efforts(result: LeastEfforts) -> Figure:
    """Median and range of each group's ratios: hollow after few nodes, filled after all."""
    from matplotlib.figure import Figure

    groups = list(result.groups)
    figure = Figure(figsize=(7, 1 + 0.3 * len(groups)), dpi=200, layout="constrained")
    ax = figure.add_subplot()
    for shift, nodes, face in zip(
        (0.15, -0.15), result.columns, ("white", "#0072B2"), strict=False
    ):
        for row, group in enumerate(groups):
            _draw(ax, row + shift, result.ratios(group, nodes), face)
    ax.axvline(1.0, color="black", linewidth=0.8)
    ax.set_xscale("log")
    ax.set_xticks((1, 1.1, 1.5, 2, 5, 10), labels=("1", "1.1", "1.5", "2", "5", "≥ 10"))
    ax.minorticks_off()
    ax.set_xlim(0.95, 1.05 * HIGHEST)
    ax.set_yticks(range(len(groups)), labels=groups)
    ax.invert_yaxis()
    ax.set_xlabel("effort found / least work")
    return figure


def _draw(ax: Axes, y: float, ratios: NDArray[np.float64], face: str) -> None:
    low, middle, high = np.minimum((ratios.min(), np.median(ratios), ratios.max()), HIGHEST)
    ax.plot((low, high), (y, y), color="#0072B2", linewidth=1)
    ax.plot(middle, y, "o", color="#0072B2", markerfacecolor=face, markersize=5)
