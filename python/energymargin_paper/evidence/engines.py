"""The paper's four tasks in MuJoCo: do labels, escapes and probabilities come out as here?

Each trajectory's script runs in both engines from the same start. From its states on that are
captured now, escapes that were found here are played there, and random disturbances act in both.
MuJoCo takes a part of our step: its contacts are as stiff as a step lets them be.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from energymargin.base.checks import one_of, positive_number, whole_number
from energymargin.base.plausibility import PlausibilityWarning
from energymargin.base.table_text import csv_text, markdown_table
from energymargin.model.scenes.mjcf_model import engine
from energymargin_paper.evidence.engines_states import (
    AHEAD,
    FRAMES,
    LARGEST_SCALE,
    QUESTIONS,
    Both,
    Escape,
    Job,
    Label,
    Probability,
    run,
)
from energymargin_paper.jobs import Lines, resumed
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["STUDY", "TASKS", "Engines", "Settings", "figure_engines"]

TASKS = ("push", "balance", "topple", "grasp")
RUNS_FILE = "runs.jsonl"


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    tasks: tuple[str, ...] = setting(TASKS, "Tasks, separated by commas.")
    trajectories: int = setting(12, "Trajectories of each task.")
    nodes: int = setting(1000, "Nodes of a search for an escape.")
    rollouts: int = setting(20, "Rollouts of a probability, in each engine.")
    strength: float = setting(0.6, "Strength of the random disturbances, as a share of the bounds.")
    parts: int = setting(4, "Steps of MuJoCo in one of ours.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        for task in self.tasks:
            one_of("tasks", task, TASKS)
        for name in ("trajectories", "nodes", "rollouts", "parts"):
            whole_number(name, getattr(self, name), 1)
        positive_number("strength", self.strength)


@dataclass(frozen=True, eq=False)
class Engines:
    """What came out, by job."""

    settings: Settings
    found: dict[Job, Both]

    def of(self, task: str) -> list[Both]:
        """All trajectories of a task."""
        return [both for job, both in self.found.items() if job.task == task]

    def labels(self, task: str) -> list[Label]:
        """Labels of all frames."""
        return [label for both in self.of(task) for label in both.labels]

    def escapes(self, task: str, question: str) -> list[Escape]:
        """Escapes of all states that were asked."""
        return [e for both in self.of(task) for e in both.escapes if e.question == question]

    def probabilities(self, task: str) -> list[Probability]:
        """Probabilities of all states that were asked."""
        return [p for both in self.of(task) for p in both.probabilities]

    def to_csv(self) -> str:
        """A line for each question about a state."""
        header = ("task", "seed", "frame", "question", "here", "there", "scale", "apart")
        return csv_text(
            header, [row for job, both in self.found.items() for row in _rows(job, both)]
        )

    def to_markdown(self) -> str:
        """Three tables, and what they are of."""
        s = self.settings
        intro = (
            f"{s.trajectories} trajectories of {FRAMES} frames of each task, seeds from 0. MuJoCo "
            f"takes {s.parts} steps in one of ours."
        )
        return "\n".join(["# Two engines\n", intro, "", *self._short(), *self._sections()])

    def _short(self) -> Iterator[str]:
        """What the tables say, over all tasks."""
        tasks = self.settings.tasks
        labels = [label for task in tasks for label in self.labels(task)]
        alike = sum(label.captured == label.captured_there for label in labels)
        coarse = sum(label.captured == label.captured_coarse for label in labels)
        yield f"- {alike} of {len(labels)} labels agree, with our step {coarse}."
        found = [e for t in tasks for q in QUESTIONS for e in self.escapes(t, q)]
        free = [escape for escape in found if escape.effort == 0.0]
        paid = [escape for escape in found if escape.effort]
        yield (
            f"- Of {len(free)} escapes that cost nothing {sum(e.escaped for e in free)} lead out "
            f"in MuJoCo, of {len(paid)} that cost work {sum(e.escaped for e in paid)} unchanged, "
            f"and {sum(e.scale is None for e in paid)} not even with wrenches {LARGEST_SCALE:g} "
            "times as strong."
        )
        off = [abs(p.captured - p.captured_there) for t in tasks for p in self.probabilities(t)]
        if off:
            yield (
                f"- Probabilities differ by {np.mean(off):.3f} in the mean and {max(off):.2f} at "
                "most."
            )

    def _sections(self) -> Iterator[str]:
        s = self.settings
        yield "\n## Labels\n"
        yield (
            "The script of each trajectory from the same start, also in MuJoCo: whether a frame is "
            "captured, whether the trajectory succeeds, and how far the objects of a frame are "
            "apart. *With our step* MuJoCo's are as long as ours.\n"
        )
        header = ["task", "frames", "labels that agree", "captured here, there"]
        header += ["agree with our step", "successes that agree"]
        header += ["apart, median [mm]", "90 %", "most"]
        yield _table(header, [self._of_labels(task) for task in s.tasks])
        yield "\n## Escapes\n"
        yield (
            f"Of each state that is captured now, the best escape of {s.nodes} nodes, played in "
            "MuJoCo. *No clock* is the paper's question, of all such states; *script* that of "
            f"the next {AHEAD} frames, of those with so many left. An escape of effort 0 is one of "
            "an object that leaves by itself. *Out* leads out unchanged; *stronger* with wrenches "
            f"up to {LARGEST_SCALE:g} times as strong. Work is MuJoCo's effort over ours, of those "
            "that lead out unchanged.\n"
        )
        header = ["task", "question", "states", "without escape", "effort 0", "out", "effort > 0"]
        header += ["out", "stronger", "never", "work, median", "10 to 90 %", "all"]
        rows = [self._of_escapes(t, q) for t in s.tasks for q in QUESTIONS]
        yield _table(header, rows)
        yield "\n## Probabilities\n"
        yield (
            f"To stay captured over the next {AHEAD} frames of the script: {s.rollouts} rollouts "
            f"under the same random wrenches in both engines, within {s.strength:g} of the bounds. "
            "*Between* are the states with a probability of neither 0 nor 1 in at least one "
            "engine. *Alike* is the share of rollouts that end alike.\n"
        )
        header = ["task", "states", "mean here", "mean there", "difference, mean", "most"]
        header += ["between", "their difference, mean", "rank correlation", "alike"]
        yield _table(header, [self._of_probabilities(task) for task in s.tasks])

    def _of_labels(self, task: str) -> list[str]:
        labels, both = self.labels(task), self.of(task)
        alike = sum(label.captured == label.captured_there for label in labels)
        here = sum(label.captured for label in labels)
        there = sum(label.captured_there for label in labels)
        success = sum(one.success == one.success_there for one in both)
        apart = 1e3 * np.quantile([label.apart for label in labels], [0.5, 0.9, 1.0])
        coarse = sum(label.captured == label.captured_coarse for label in labels)
        shown = [str(alike), f"{here}, {there}", str(coarse), f"{success} of {len(both)}"]
        return [task, str(len(labels)), *shown, *(f"{value:.2g}" for value in apart)]

    def _of_escapes(self, task: str, question: str) -> list[str]:
        escapes = self.escapes(task, question)
        free = [escape for escape in escapes if escape.effort == 0.0]
        paid = [escape for escape in escapes if escape.effort]
        out = sum(escape.escaped for escape in paid)
        never = sum(escape.scale is None for escape in paid)
        counts = [len(escapes), sum(e.effort is None for e in escapes), len(free)]
        counts += [sum(e.escaped for e in free), len(paid), out, len(paid) - out - never, never]
        return [task, question, *map(str, counts), *_ratio_cells(ratios(paid))]

    def _of_probabilities(self, task: str) -> list[str]:
        states = self.probabilities(task)
        if not states:
            return [task, "0", *[""] * 8]
        here = np.array([p.captured for p in states])
        there = np.array([p.captured_there for p in states])
        between = ((here > 0) & (here < 1)) | ((there > 0) & (there < 1))
        off = np.abs(here - there)
        alike = np.mean([p.alike for p in states])
        numbers = [here.mean(), there.mean(), off.mean(), off.max()]
        shown = [f"{number:.3f}" for number in numbers]
        among = f"{off[between].mean():.3f}" if between.any() else ""
        rank = rank_correlation(here, there)
        correlation = "" if rank is None else f"{rank:.3f}"
        return [
            task,
            str(len(states)),
            *shown,
            str(between.sum()),
            among,
            correlation,
            f"{alike:.3f}",
        ]


def ratios(escapes: Sequence[Escape]) -> list[float]:
    """MuJoCo's effort over ours, of escapes of some effort that lead out unchanged."""
    return [e.effort_there / e.effort for e in escapes if e.effort and e.effort_there is not None]


def rank_correlation(one: np.ndarray, other: np.ndarray) -> float | None:
    """Spearman's; None where all of one are alike."""
    from scipy.stats import spearmanr

    if len(np.unique(one)) < 2 or len(np.unique(other)) < 2:
        return None
    return float(spearmanr(one, other).statistic)


def _ratio_cells(found: Sequence[float]) -> list[str]:
    if not found:
        return ["", "", ""]
    least, low, middle, high, most = np.quantile(found, [0.0, 0.1, 0.5, 0.9, 1.0])
    return [f"{middle:.3f}", f"{low:.3f} to {high:.3f}", f"{least:.3f} to {most:.3f}"]


def _table(header: list[str], rows: list[list[str]]) -> str:
    return markdown_table(header, rows, ["left", *["right"] * (len(header) - 1)])


def _rows(job: Job, both: Both) -> Iterator[tuple[object, ...]]:
    for label in both.labels:
        values = (int(label.captured), int(label.captured_there), None, label.apart)
        yield job.task, job.seed, label.frame, "captured", *values
    for e in both.escapes:
        yield job.task, job.seed, e.frame, e.question, e.effort, e.effort_there, e.scale, e.apart
    for p in both.probabilities:
        yield job.task, job.seed, p.frame, "probability", p.captured, p.captured_there, None, None


class EnginesStudy(Study[Settings, Engines]):
    """Labels, escapes and probabilities of the paper's four tasks, here and in MuJoCo.

    The folder gets engines.md, engines.csv, engines.png and all runs (runs.jsonl).

    Example: `energymargin reproduce engines --tasks topple --trajectories 4`
    """

    name = "engines"
    title, unit = "Playing in MuJoCo", "trajectories"
    settings = Settings()
    quick = Settings(trajectories=1, nodes=100, rollouts=2, parts=2)
    packages = ("mujoco",)
    improved = True

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Engines:
        """Runs what the folder does not have yet."""
        engine()
        s, program = settings, version("energymargin")
        jobs = [
            Job(program, task, seed, s.nodes, s.rollouts, s.strength, s.parts)
            for seed in range(s.trajectories)
            for task in s.tasks
        ]
        lines = Lines(_from_json, _to_json)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PlausibilityWarning)  # of states that leave at once
            found = resumed(folder / RUNS_FILE, jobs, run, threads, lines=lines, progress=progress)
        return Engines(settings, found)

    def figures(self, result: Engines) -> Iterator[tuple[str, Figure]]:
        """Efforts and probabilities, there against here."""
        yield "engines.png", figure_engines(result)


STUDY = EnginesStudy()


def _to_json(job: Job, both: Both) -> str:
    return json.dumps([asdict(job), asdict(both)])


def _from_json(line: str) -> tuple[Job, Both]:
    job, both = json.loads(line)
    parts = {"labels": Label, "escapes": Escape, "probabilities": Probability}
    lists = {name: [kind(**values) for values in both[name]] for name, kind in parts.items()}
    return Job(**job), Both(**{**both, **lists})


COLORS = {"push": "#0072B2", "balance": "#D55E00", "topple": "#009E73", "grasp": "#CC79A7"}
MARKERS = {"no clock": "o", "script": "x"}


def figure_engines(result: Engines) -> Figure:
    """On the left the efforts of escapes that lead out unchanged, on the right probabilities."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4.2), dpi=200, layout="constrained")
    efforts, probabilities = figure.subplots(1, 2)
    _draw_efforts(efforts, result)
    _draw_probabilities(probabilities, result)
    return figure


def _draw_efforts(ax: Axes, result: Engines) -> None:
    ends = []
    for task in result.settings.tasks:
        for question, marker in MARKERS.items():
            escapes = result.escapes(task, question)
            pairs = [(e.effort, e.effort_there) for e in escapes if e.effort and e.effort_there]
            here, there = [one for one, _ in pairs], [other for _, other in pairs]
            label = f"{task}, {question}" if pairs else None
            ax.plot(here, there, marker, color=COLORS[task], markersize=4, label=label)
            ends += [*here, *there]
    line = (min(ends, default=1.0), max(ends, default=1.0))
    ax.plot(line, line, color="0.6", linewidth=0.8, zorder=0)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("effort of the escape here [J]")
    ax.set_ylabel("effort in MuJoCo [J]")
    if ends:
        ax.legend(fontsize=7, frameon=False)


def _draw_probabilities(ax: Axes, result: Engines) -> None:
    ax.plot((0, 1), (0, 1), color="0.6", linewidth=0.8, zorder=0)
    for number, task in enumerate(result.settings.tasks):
        states = result.probabilities(task)
        aside = 0.006 * (number - 1.5)  # so that equal points are seen
        here = [state.captured + aside for state in states]
        there = [state.captured_there - aside for state in states]
        ax.plot(here, there, "o", color=COLORS[task], markersize=4, alpha=0.6, label=task)
    ax.set_xlabel("probability to stay captured here")
    ax.set_ylabel("probability in MuJoCo")
    ax.legend(fontsize=7, frameon=False)
