"""How many losses does an alarm announce, if it may be false on 5 % of the trajectories?

Each score gets its own threshold from the same calibration trajectories, by split conformal
prediction (`energymargin.monitor.threshold`), and is then held against others: of the same kind, of
other friction, and the authors' recordings. Every state is one line of runs.jsonl in the folder,
written as soon as it is scored: stopped and started again, the study goes on with what is missing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin.base.checks import whole_number
from energymargin.base.table_text import DASH, csv_text, markdown_table
from energymargin.monitor import Alarms, Threshold, alarms, threshold
from energymargin.records.datasets.generation import load_or_generate
from energymargin_paper.evidence.early_warning_states import (
    AHEAD,
    OBJECTS,
    PROBABILITY,
    RECORDED,
    RECORDED_AHEAD,
    SCORES,
    STRENGTH,
    Episode,
    Job,
    StateScores,
    Trajectories,
    Watched,
    recordings_of,
    run,
)
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["STUDY", "EarlyWarning", "Settings", "Warned", "figure_early_warning"]

RUNS_FILE = "runs.jsonl"
FRAMES = 10  # of a trajectory
CALIBRATION, HELD_OUT = "calibration", "held out"
CONFIDENCE = 0.95


@dataclass(frozen=True, eq=False)
class Other:
    """Trajectories of another kind than those of the calibration."""

    name: str
    parameters: Mapping[str, float]
    """Parameters of the task."""
    believed: Mapping[str, float]
    """Parameters of the model, in place of the trajectory's own."""


OTHERS = {
    "push": (  # the friction of its calibration is drawn from 0.2 to 0.4
        Other("friction 0.1", {"friction": 0.1}, {}),
        Other("friction 0.6", {"friction": 0.6}, {}),
        Other("friction 0.6, believed 0.3", {"friction": 0.6}, {"friction": 0.3}),
    ),
    "balance": (),  # whose friction is fixed
    "grasp": (Other("friction 0.45", {"friction": 0.45}, {}),),  # from 0.1 to 1: here it is decided
    "scoop": (Other("friction 1.2", {"friction": 1.2}, {}),),  # from 0.02 to 0.8
}


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    tasks: tuple[str, ...] = setting(
        ("push", "balance"), f"Tasks, separated by commas; also grasp, and {RECORDED} with --data."
    )
    data: str = setting("", "Folder of the authors' data, for their recordings.", shown="none")
    trajectories: int = setting(
        160, "Trajectories for the calibration, and as many held out; of others half as many."
    )
    false_alarms: float = setting(0.05, "Share of the trajectories that may have a false alarm.")
    lead: int = setting(3, "Frames from an alarm to a loss that count as early.")
    rollouts: int = setting(30, "Rollouts of each probability.")
    nodes: int = setting(100, "Nodes of the capture score's trees.")
    every: int = setting(5, "Frames of a recording from one scored state to the next.")
    seed: int = setting(0, "Seed of every random draw.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        known = (*OTHERS, RECORDED)
        wrong = [name for name in self.tasks if name not in known]
        if wrong or not self.tasks or len(set(self.tasks)) < len(self.tasks):
            what = repr(wrong[0]) if wrong else ", ".join(self.tasks) or "empty"
            raise ValueError(f"tasks is {what}, expected some of {', '.join(known)}, each once")
        if (RECORDED in self.tasks) != bool(self.data):
            raise ValueError(
                f"tasks is {', '.join(self.tasks)} and data is {self.data!r}: data has the "
                f"{RECORDED}, and they have to be given"
            )
        for name in ("trajectories", "lead", "rollouts", "nodes", "every"):
            whole_number(name, getattr(self, name), 1)
        whole_number("seed", self.seed, 0, 2**63 - 1)
        if not 0 < self.false_alarms < 1:
            raise ValueError(
                f"false_alarms is {self.false_alarms:g}, expected a number between 0 and 1"
            )


@dataclass(frozen=True, eq=False)
class Warned:
    """What the alarm of one score does on one group of trajectories."""

    task: str
    group: str
    score: str
    threshold: Threshold | None
    """From the calibration; None if too few of its trajectories hold."""
    alarms: Alarms | None
    values: list[NDArray[np.float64]]
    """By trajectory, the scores of its frames before the loss."""
    lost: list[int | None]


@dataclass(frozen=True, eq=False)
class EarlyWarning:
    """The result."""

    settings: Settings
    rows: list[Warned]
    failed: int
    """States without scores."""

    def to_markdown(self) -> str:
        """A table for each group of trajectories."""
        own = self.settings
        lines = [
            "# Early warning",
            "",
            f"Alarms that are false on at most {own.false_alarms:.0%} of the trajectories, and how "
            f"many losses they announce at least {own.lead} frames before. "
            f"{own.trajectories} trajectories of {FRAMES} frames for "
            f"the calibration and as many held out, half as many of others, seed {own.seed}; "
            f"{own.rollouts} rollouts under "
            f"Uniform(strength={STRENGTH:g}, objects={OBJECTS}), trees of {own.nodes} nodes. A "
            f"score looks {AHEAD} frames ahead, {RECORDED_AHEAD} in recordings; an alarm earlier "
            f"than that before a loss is false. Intervals: {CONFIDENCE:.0%}, by trajectory. "
            f"{self.failed} states could not be scored.",
        ]
        for task, group in dict.fromkeys((row.task, row.group) for row in self.rows):
            rows = [row for row in self.rows if (row.task, row.group) == (task, group)]
            title = group if task == RECORDED else f"{task}, {group}"
            lines += ["", f"## {title}", "", self._table(rows)]
        return "\n".join(lines) + "\n"

    def _table(self, rows: Sequence[Warned]) -> str:
        lead = self.settings.lead
        header = (
            "",
            "threshold",
            "false alarms",
            f"announced by {lead}",
            "announced",
            "median lead",
        )
        cells = [
            [
                SCORES[row.score],
                f"{row.threshold.value:.3g}" if row.threshold else DASH,
                _share(row.alarms.false_alarms if row.alarms else None),
                _share(row.alarms.announced(lead) if row.alarms else None),
                _share(row.alarms.announced() if row.alarms else None),
                _median_lead(row.alarms),
            ]
            for row in rows
        ]
        return markdown_table(header, cells, ["left", *["right"] * (len(header) - 1)])

    def to_csv(self) -> str:
        """One line for each group and score."""
        lead, lines = self.settings.lead, []
        for row in self.rows:
            found: tuple[object, ...] = ("",) * 8
            if row.threshold is not None and row.alarms is not None:
                found = (
                    *(row.threshold.value, row.threshold.level, len(row.threshold.statistics)),
                    *row.alarms.false_alarms,
                    *row.alarms.announced(lead),
                    _median(row.alarms),
                )
            lines.append((row.task, row.group, row.score, *found))
        header = (
            *("task", "group", "score", "threshold", "level", "calibration"),
            *("false", "of_trajectories", "announced", "of_losses", "median_lead"),
        )
        return csv_text(header, lines)


class EarlyWarningStudy(Study[Settings, EarlyWarning]):
    """How many losses are announced by an alarm that is false on at most 5 % of the trajectories.

    The capture probability along the script, the capture score, the script alone and a distance,
    each with a threshold from the same calibration trajectories: on held-out trajectories, on other
    friction, and on the authors' recordings.

    The folder gets early_warning.md, early_warning.csv, early_warning.png, runs.jsonl and the
    trajectories; it goes on with the states that it has.

    Example: `energymargin reproduce early-warning --tasks push`
    """

    name = "early-warning"
    title, unit = "Watching", "states"
    settings = Settings()
    quick = Settings(tasks=("push",), trajectories=100, false_alarms=0.1, rollouts=8, nodes=10)

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> EarlyWarning:
        """Scores what is not in the folder yet."""
        halves = recordings_of(Path(settings.data), settings.every) if settings.data else []
        watched: dict[tuple[str, str], Watched] = {
            (task, own.group): own
            for task in settings.tasks
            if task != RECORDED
            for own in _groups(settings, folder, task)
        }
        watched |= {(RECORDED, half.group): half for half in halves}
        jobs = [
            Job(
                *(version("energymargin"), task, group, settings.trajectories, index),
                *(settings.rollouts, settings.nodes, settings.seed),
            )
            for (task, group), own in watched.items()
            for index in own.scored
        ]
        found = resumed(
            folder / RUNS_FILE,
            jobs,
            partial(run, watched),
            threads,
            lines=pairs(Job, StateScores),
            progress=progress,
        )
        by_state = {(job.task, job.group, job.index): state for job, state in found.items()}
        rows = [
            row
            for task in dict.fromkeys(task for task, _ in watched)
            for row in _warned(task, watched, by_state, settings)
        ]
        failed = sum(state.error is not None for state in found.values())
        return EarlyWarning(settings, rows, failed)

    def figures(self, result: EarlyWarning) -> Iterator[tuple[str, Figure]]:
        """Share of the losses that are announced, by frames before."""
        yield "early_warning.png", figure_early_warning(result)


STUDY = EarlyWarningStudy()


def _groups(settings: Settings, folder: Path, name: str) -> Iterator[Trajectories]:
    """Groups of a task: for the calibration, held out, and of other kinds."""
    groups = [Other(CALIBRATION, {}, {}), Other(HELD_OUT, {}, {}), *OTHERS[name]]
    for number, other in enumerate(groups):
        path = folder / f"{name}-{number}.h5"
        made: Any = tasks.make(name, **dict[str, Any](other.parameters))
        count = settings.trajectories
        count = count if other.name in (CALIBRATION, HELD_OUT) else max(count // 2, 1)
        dataset = load_or_generate(path, made, count, FRAMES, settings.seed + number)
        yield Trajectories(other.name, dataset, other.believed)


def _warned(
    task: str,
    watched: Mapping[tuple[str, str], Watched],
    by_state: Mapping[tuple[str, str, int], StateScores],
    settings: Settings,
) -> Iterator[Warned]:
    """The rows of a task. Each half of the recordings calibrates for the other one."""
    groups = {group: own for (of, group), own in watched.items() if of == task}
    for group, own in groups.items():
        if group == CALIBRATION:
            continue
        other = next(name for name in groups if name != group)
        for score in SCORES:
            values, lost = _values(own.episodes, by_state, (task, group), score)
            known = _values(groups[other].episodes, by_state, (task, other), score)
            if not any(np.isfinite(row).any() for row in values):
                continue  # a score that these states do not have
            found = _threshold(*known, settings.false_alarms, own.ahead)
            seen = None if found is None else alarms(values, lost, found.alarm(), ahead=own.ahead)
            yield Warned(task, group, score, found, seen, values, lost)


def _values(
    episodes: Sequence[Episode],
    by_state: Mapping[tuple[str, str, int], StateScores],
    place: tuple[str, str],
    score: str,
) -> tuple[list[NDArray[np.float64]], list[int | None]]:
    """By trajectory, a score of its frames before the loss, and the frame of the loss."""
    rows = []
    for episode in episodes:
        states = [None if i is None else by_state[(*place, i)] for i in episode.indices]
        values = [np.nan if state is None else state.scores.get(score, np.nan) for state in states]
        rows.append(np.array(values, dtype=float))
    return rows, [episode.lost for episode in episodes]


def _threshold(
    values: list[NDArray[np.float64]],
    lost: list[int | None],
    false_alarms: float,
    ahead: int,
) -> Threshold | None:
    """None where too few trajectories have a frame in which an alarm would be false."""
    try:
        return threshold(values, lost, false_alarms=false_alarms, ahead=ahead)
    except ValueError:
        return None


def _share(counts: tuple[int, int] | None) -> str:
    """As "12 of 80, .08 to .25"."""
    from scipy.stats import binomtest

    if counts is None or not counts[1]:
        return DASH
    low, high = binomtest(*counts).proportion_ci(CONFIDENCE)
    return f"{counts[0]} of {counts[1]} ({100 * low:.0f} to {100 * high:.0f} %)"


def _median(seen: Alarms) -> float:
    """Median lead of the losses that are announced [frames]; NaN of none."""
    leads = seen.leads[seen.leads > 0]
    return float(np.median(leads)) if len(leads) else float("nan")


def _median_lead(seen: Alarms | None) -> str:
    return DASH if seen is None or np.isnan(_median(seen)) else f"{_median(seen):g}"


COLORS = ("#0072B2", "#56B4E9", "#D55E00", "#009E73", "#777777", "#CC79A7")


def figure_early_warning(result: EarlyWarning) -> Figure:
    """Share of the losses that are announced at least so many frames before: a panel a group."""
    from matplotlib.figure import Figure

    groups = list(dict.fromkeys((row.task, row.group) for row in result.rows))
    columns = min(len(groups), 4)
    lines = -(-len(groups) // columns)
    figure = Figure(figsize=(3.4 * columns, 3.0 * lines + 0.4), dpi=160, layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False)
    for ax in axes.flat[len(groups) :]:
        ax.set_axis_off()
    for ax, (task, group) in zip(axes.flat, groups, strict=False):
        rows = [row for row in result.rows if (row.task, row.group) == (task, group)]
        _draw(ax, rows, RECORDED_AHEAD if task == RECORDED else AHEAD)
        ax.set_title(group if task == RECORDED else f"{task}, {group}", fontsize=10)
    axes[0, 0].set_ylabel("share of losses announced")
    shown = {row.score for row in result.rows}
    handles = [
        axes.flat[0].plot([], [], color=color, marker="o", markersize=3, label=name)[0]
        for (score, name), color in zip(SCORES.items(), COLORS, strict=True)
        if score in shown
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8)
    return figure


def _draw(ax: Axes, rows: Sequence[Warned], most: int) -> None:
    frames = np.arange(1, most + 1)
    for row in rows:
        if row.alarms is None:
            continue
        counts = [row.alarms.announced(int(n)) for n in frames]
        shares = [many / of if of else np.nan for many, of in counts]
        color = COLORS[list(SCORES).index(row.score)]
        width = 2.0 if row.score == PROBABILITY else 1.2
        ax.plot(frames, shares, "o-", color=color, linewidth=width, markersize=3)
    ax.set_ylim(-0.03, 1.03)
    ax.set_xlabel("at least so many frames before")
