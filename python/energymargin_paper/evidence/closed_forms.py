"""The effort of escape against answers known on paper, and what each part of the search gains.

Every search is one line of runs.jsonl in the folder, written as soon as it is finished: stopped and
started again, the study goes on with what is missing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, EscapeEffort, Problem, World, escape_effort
from energymargin.base.checks import whole_number
from energymargin.base.table_text import DASH, csv_text, markdown_table
from energymargin_paper.evidence.audit import stepped
from energymargin_paper.evidence.energy_barriers import BARRIERS
from energymargin_paper.evidence.known_answers import KNOWN, KnownAnswer, known_answers
from energymargin_paper.evidence.timed_answers import TIMED
from energymargin_paper.jobs import Lines, resumed
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "PLANNERS",
    "SEARCHES",
    "STUDY",
    "ClosedForms",
    "Search",
    "Settings",
    "figure_closed_forms",
    "measurable",
]

PLANNERS = ("est", "rrt")
PLANNER_NAMES = {"est": "AO-EST", "rrt": "AO-RRT"}
NODES = (100, 1000, 5000)  # at which the ratios are shown
SIZES = [f"{PLANNER_NAMES[p]}, {nodes} nodes" for p in PLANNERS for nodes in NODES]  # columns
STEPS = (20_000, 50_000, 150_000)  # simulation steps at which searches are compared
SEARCHES: dict[str, dict[str, Any]] = {
    "ours": {},
    "as published": {"sampling": "uniform", "shorten": False},
    "mixed controls": {"sampling": "mixed", "shorten": False},
    "shortening": {"sampling": "uniform", "shorten": True},
}
OURS, PUBLISHED = "ours", "as published"
# A simulation that is near its limit, and how much stronger its wrenches may have to be.
FINE = {"step": 1 / 3840, "solver_iterations": 500, "solver_tolerance": 1e-12}
SCALES = np.linspace(1.0, 1.1, 201)
RUNS_FILE = "runs.jsonl"


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    problems: tuple[str, ...] = setting((), "Problems, separated by commas.", shown="all")
    nodes: int = setting(max(NODES), "Nodes of each search.")
    seeds: int = setting(20, "Searches of each planner.")
    gain_seeds: int = setting(8, "Searches of each planner without one or all of our changes.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        for name in ("nodes", "seeds", "gain_seeds"):
            whole_number(name, getattr(self, name), 1)


@dataclass(frozen=True)
class Job:
    """One search that is to be made."""

    version: str
    problem: str
    planner: str
    search: str
    seed: int
    nodes: int


@dataclass(frozen=True, eq=False)
class Search:
    """One search that was made."""

    job: Job
    history: list[tuple[int, int, float]]
    """(nodes, simulation steps, best effort [J]) at each improvement."""

    @property
    def effort(self) -> float:
        """Best effort of the whole run [J]."""
        return self.after(self.job.nodes)

    def after(self, amount: int, *, steps: bool = False) -> float:
        """Best effort after so many nodes, or simulation steps [J]; inf if there was none."""
        column = 1 if steps else 0
        return min(
            (entry[2] for entry in self.history if entry[column] <= amount), default=math.inf
        )

    def to_json(self) -> str:
        """One line."""
        return json.dumps({**asdict(self.job), "history": self.history})

    @classmethod
    def from_json(cls, line: str) -> Search:
        """The inverse of `to_json`."""
        fields = json.loads(line)
        history = [(int(n), int(s), float(effort)) for n, s, effort in fields.pop("history")]
        return cls(Job(**fields), history)


@dataclass(frozen=True, eq=False)
class ClosedForms:
    """The result."""

    problems: list[KnownAnswer]
    runs: list[Search]
    finer: dict[str, float]
    """Effort of each problem that the cheapest escape of all runs takes in finer steps [J]."""

    def efforts(
        self, problem: KnownAnswer, planner: str, search: str, amount: int, *, steps: bool = False
    ) -> NDArray[np.float64]:
        """Best effort of each seed after so many nodes, or simulation steps [J]."""
        return np.array(
            [run.after(amount, steps=steps) for run in self.of(problem, planner, search)]
        )

    def of(self, problem: KnownAnswer, planner: str, search: str) -> list[Search]:
        """The runs of one problem, planner and search, by seed."""
        wanted = (problem.name, planner, search)
        found = [r for r in self.runs if (r.job.problem, r.job.planner, r.job.search) == wanted]
        return sorted(found, key=lambda run: run.job.seed)

    def to_csv(self) -> str:
        """One line a search: its best effort [J], and the answer on paper."""
        answers = {problem.name: problem.answer for problem in self.problems}
        rows = [
            (
                *(run.job.problem, run.job.planner, run.job.search, run.job.seed, run.job.nodes),
                *(run.effort, answers[run.job.problem]),
            )
            for run in self.runs
        ]
        return csv_text(("problem", "planner", "search", "seed", "nodes", "effort", "answer"), rows)

    def to_markdown(self) -> str:
        """The tables: ratios, those of problems with a horizon, and what each change gains."""
        tables = [self._ratio_table(), self._timed_table(), self._gain_table()]
        return "\n\n".join(table for table in tables if table) + "\n"

    def _ratio_table(self) -> str:
        header = ("problem", "answer [J]", *SIZES, "lowest", "the same in finer steps")
        untimed = [problem for problem in self.problems if not problem.timed]
        return markdown_table(header, [[*self._row(p), *self._lowest(p)] for p in untimed])

    def _timed_table(self) -> str:
        """Empty without such a problem."""
        timed = [problem for problem in self.problems if problem.timed]
        header = ("within a horizon", "answer [J]", *SIZES)
        return markdown_table(header, map(self._row, timed)) if timed else ""

    def _row(self, problem: KnownAnswer) -> list[str]:
        """A problem, its answer, and what each planner finds of it."""
        answer = problem.formula
        if 0.0 < problem.answer < math.inf:
            answer += f" = {problem.answer:.4g}"
        cells = [self._cell(problem, p, nodes) for p in PLANNERS for nodes in NODES]
        return [f"{problem.name}: {problem.text}", answer, *cells]

    def _cell(self, problem: KnownAnswer, planner: str, nodes: int) -> str:
        """Median and range of the ratio over the seeds; of the effort where there is no ratio."""
        efforts = self.efforts(problem, planner, OURS, nodes)
        if not 0.0 < problem.answer < math.inf:
            return _many(efforts)
        low, middle, high = (f(efforts) / problem.answer for f in (np.min, np.median, np.max))
        return f"**{middle:.3f}** {low:.3f} to {high:.3f}"

    def _lowest(self, problem: KnownAnswer) -> tuple[str, str]:
        """The least of all efforts over the answer, and the same path in finer steps."""
        if not measurable(problem):
            return DASH, DASH
        lowest, finer = self.cheapest(problem).effort, self.finer[problem.name]
        return f"{lowest / problem.answer:.4f}", f"{finer / problem.answer:.4f}"

    def cheapest(self, problem: KnownAnswer) -> Search:
        """The one of all runs of our search with the least effort."""
        runs = [run for planner in PLANNERS for run in self.of(problem, planner, OURS)]
        return min(runs, key=lambda run: run.effort)

    def _gain_table(self) -> str:
        sizes = [(planner, steps) for planner in PLANNERS for steps in STEPS]
        header = ["search", *(f"{PLANNER_NAMES[p]}, {steps:,} steps" for p, steps in sizes)]
        rows = [
            [search, *(f"{self.mean_ratio(search, *size):.3f}" for size in sizes)]
            for search in SEARCHES
        ]
        return markdown_table(header, rows)

    def mean_ratio(self, search: str, planner: str, steps: int) -> float:
        """Geometric mean over the problems of the median ratio over the seeds that all searches
        have, at equal numbers of simulation steps."""
        logs = []
        for problem in filter(measurable, self.problems):
            seeds = min(len(self.of(problem, planner, other)) for other in SEARCHES)
            efforts = self.efforts(problem, planner, search, steps, steps=True)[:seeds]
            logs.append(np.log(np.median(efforts) / problem.answer) if seeds else np.nan)
        return float(np.exp(np.mean(logs)))


class ClosedFormsStudy(Study[Settings, ClosedForms]):
    """The effort of escape against answers known on paper, by nodes; what each change gains.

    The folder gets closed_forms.md, closed_forms.csv, closed_forms.png and runs.jsonl, one line a
    search.

    Example: `energymargin reproduce closed-forms --problems push,edge --seeds 5`
    """

    name = "closed-forms"
    title, unit = "Searching ways out", "searches"
    settings = Settings()
    quick = Settings(nodes=200, seeds=2, gain_seeds=1)
    improved = True

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> ClosedForms:
        """Makes every search that is not in the folder yet: `seeds` of ours and `gain_seeds` of the
        others, for each problem and planner. Raises ValueError on an unknown problem."""
        answers = known_answers(list(settings.problems), {**KNOWN, **BARRIERS, **TIMED})
        known = {answer.name: answer for answer in answers}
        runs = resumed(
            folder / RUNS_FILE,
            list(_jobs(known.values(), settings)),
            lambda job, cancel: _run(known[job.problem], job, cancel),
            threads,
            lines=Lines(_from_json, lambda _job, run: run.to_json()),
            progress=progress,
        )
        result = ClosedForms(list(known.values()), list(runs.values()), {})
        for problem in filter(measurable, result.problems):
            result.finer[problem.name] = _in_finer_steps(problem, result.cheapest(problem).job)
        return result

    def figures(self, result: ClosedForms) -> Iterator[tuple[str, Figure]]:
        """For each problem, how the ratio falls with the nodes."""
        yield "closed_forms.png", figure_closed_forms(result)


STUDY = ClosedFormsStudy()


def _from_json(line: str) -> tuple[Job, Search]:
    run = Search.from_json(line)
    return run.job, run


def _jobs(problems: Iterable[KnownAnswer], settings: Settings) -> Iterator[Job]:
    program, nodes = version("energymargin"), settings.nodes
    for problem in problems:
        for search in SEARCHES if measurable(problem) else (OURS,):
            for planner in PLANNERS:
                for seed in range(settings.seeds if search == OURS else settings.gain_seeds):
                    yield Job(program, problem.name, planner, search, seed, nodes)


def _in_finer_steps(known: KnownAnswer, job: Job) -> float:
    """Effort of the best path of a search in a finer simulation, with its wrenches as much stronger
    as they must be to lead out there too [J]; inf if SCALES do not reach that far."""
    found = _search(known, job)
    problem = stepped(known.problem, **FINE)
    world = World(problem.scene)
    path = [(found.tree.controls[node], found.tree.durations[node]) for node in found.path[1:]]
    efforts = (
        _effort(world, problem, [(scale * wrench, time) for wrench, time in path])
        for scale in SCALES
    )
    return next((effort for effort in efforts if effort < math.inf), math.inf)


def _effort(
    world: World, problem: Problem, path: Sequence[tuple[NDArray[np.float64], float]]
) -> float:
    """Effort of a path until it is outside [J]; inf if it never is."""
    state, effort = problem.state, 0.0
    for wrench, time in path:
        rollout = world.rollout(state, wrench, time)
        state = rollout.state
        effort += rollout.effort
        if not problem.captured.contains(problem.scene, state):
            return effort
    return math.inf


def _search(known: KnownAnswer, job: Job, cancel: Cancel | None = None) -> EscapeEffort:
    options = SEARCHES[job.search]
    return escape_effort(
        known.problem, planner=job.planner, nodes=job.nodes, seed=job.seed, cancel=cancel, **options
    )


def _run(known: KnownAnswer, job: Job, cancel: Cancel) -> Search:
    found = _search(known, job, cancel)
    steps = np.cumsum(np.round(found.tree.durations / known.problem.scene.step)).astype(int)
    return Search(job, [(nodes, int(steps[nodes]), effort) for nodes, effort in found.history])


def measurable(problem: KnownAnswer) -> bool:
    """Whether there is a ratio to the answer, and no horizon: searches are compared on those."""
    return 0.0 < problem.answer < math.inf and not problem.timed


def _many(efforts: NDArray[np.float64]) -> str:
    """Efforts that should all be the same: 0, or inf."""
    values, counts = np.unique(efforts, return_counts=True)
    same = " ".join(
        f"{'∞' if np.isinf(value) else f'{value:.3g} J'} ({count})"
        for value, count in zip(values, counts, strict=True)
    )
    return same if len(values) > 1 else same.split(" (")[0]


COLORS = {"est": "#0072B2", "rrt": "#D55E00"}
COLUMNS = 4
TICKS = (1, 1.25, 2, 5, 10)
FEWEST = 30  # nodes, where the curves begin


def figure_closed_forms(result: ClosedForms) -> Figure:
    """Medians and ranges over the seeds; dashed, the search as published."""
    from matplotlib.figure import Figure

    problems = [problem for problem in result.problems if measurable(problem)]
    rows = -(-len(problems) // COLUMNS)
    figure = Figure(figsize=(3 * COLUMNS, 2.5 * rows), dpi=200, layout="constrained")
    for i, problem in enumerate(problems):
        _draw(figure.add_subplot(rows, COLUMNS, i + 1), result, problem, legend=i == 0)
    figure.supxlabel("nodes", fontsize=9)
    figure.supylabel("effort found / answer on paper", fontsize=9)
    return figure


def _draw(ax: Axes, result: ClosedForms, problem: KnownAnswer, *, legend: bool) -> None:
    most = max(run.job.nodes for run in result.runs)
    nodes = np.unique(np.geomspace(FEWEST, most, 60).astype(int))
    for planner, name in PLANNER_NAMES.items():
        ratios = _ratios(result, problem, planner, OURS, nodes)
        ax.fill_between(
            nodes, ratios.min(0), ratios.max(0), color=COLORS[planner], alpha=0.15, lw=0
        )
        ax.plot(nodes, np.median(ratios, 0), color=COLORS[planner], label=name)
        published = _ratios(result, problem, planner, PUBLISHED, nodes)
        if len(published):
            label = f"{name}, as published"
            ax.plot(nodes, np.median(published, 0), "--", lw=1, color=COLORS[planner], label=label)
    ax.axhline(1.0, color="black", linewidth=0.8)
    ax.set(xscale="log", yscale="log", ylim=(0.93, 12))
    ax.set_yticks(TICKS, [f"{tick:g}" for tick in TICKS])
    ax.set_yticks([], minor=True)
    ax.set_title(f"{problem.name}: {problem.formula}", fontsize=9)
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.25, linewidth=0.5)
    if legend:
        ax.legend(frameon=False, fontsize=6)


def _ratios(
    result: ClosedForms, problem: KnownAnswer, planner: str, search: str, nodes: NDArray[np.int_]
) -> NDArray[np.float64]:
    """One row a seed; where nothing is found yet, above the picture."""
    efforts = [result.efforts(problem, planner, search, int(n)) for n in nodes]
    return np.minimum(np.transpose(efforts) / problem.answer, 1e3)
