"""How well the scores tell robust states from fragile ones, and successes from failures (Section
VI-E, Table I).

State level: capture, effort and force against the label "captured over a horizon of h frames", by
AUC and AP for each h. Trajectory level: the success score of the last frames against the
trajectory's success. Every cell has a bootstrap interval in which whole trajectories are drawn, for
the states of one trajectory are alike.

With several objects there are two labels, "all are captured" and "at least one is", and a score
whose name ends in "/any" is held against the second. The force score, one number for both, is held
against each.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin.metrics import ANY

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

__all__ = [
    "Cell",
    "Compared",
    "Evaluation",
    "LabelledScores",
    "auc_ap",
    "captured_labels",
    "compared_states",
    "compared_trajectories",
    "csv_fields",
    "evaluate",
    "paper_value",
    "ranked",
    "short",
    "state_metrics",
    "trajectory_score",
]

HORIZONS = range(6)  # frames; the paper leaves its horizon open, so all of them are shown
HORIZON = 2  # frames; where one is needed
LAST_FRAMES = 5  # frames, k-bar of Section VI-D
DRAWS = 1000  # bootstrap draws
MOST_WEIGHTS = 2**22  # in memory at once
CONFIDENCE = 0.95
SUCCESS, FORCE = "success", "force"
SUCCESSES = (SUCCESS, SUCCESS + ANY)  # the metrics of trajectories
ALL_TITLE = "All objects: captured together, and successful together"
ANY_TITLE = "At least one object: captured, and successful"
DASH = "—"
CSV_COLUMNS = (
    *("score", "horizon", "count", "positives"),
    *("auc", "auc_low", "auc_high", "ap", "ap_low", "ap_high", "paper_auc", "paper_ap"),
)

# AUC and AP of the paper's Table I.
PAPER: dict[str, dict[str, tuple[float, float]]] = {
    "push": {
        "capture": (0.97, 0.99),
        "effort/est": (0.92, 0.98),
        "effort/rrt": (0.92, 0.99),
        "force": (0.86, 0.95),
        "success": (0.98, 0.98),
    },
    "balance": {
        "capture": (0.98, 0.99),
        "effort/est": (0.93, 0.98),
        "effort/rrt": (0.94, 0.98),
        "force": (0.94, 0.96),
        "success": (0.93, 0.95),
    },
    "topple": {
        "capture": (0.94, 0.93),
        "effort/est": (0.93, 0.91),
        "effort/rrt": (0.93, 0.92),
        "force": (0.77, 0.62),
        "success": (0.89, 0.92),
    },
    "grasp": {
        "capture": (1.00, 1.00),
        "effort/est": (0.99, 0.99),
        "effort/rrt": (0.97, 0.99),
        "force": (0.73, 0.88),
        "success": (0.99, 0.99),
    },
}


@dataclass(frozen=True)
class LabelledScores:
    """N states of several trajectories, those of one in a row and in the order of time."""

    task: str
    trajectory: NDArray[np.int64]
    """Which trajectory a state is of, shape (N,)."""
    captured: NDArray[np.bool_]
    """Whether a state lies in its own capture set, shape (N,)."""
    success: NDArray[np.bool_]
    """Whether the state's trajectory succeeded, shape (N,)."""
    scores: dict[str, NDArray[np.float64]]
    """By metric, shape (N,): inf ranks above all else, NaN is a score that is not there."""
    captured_any: NDArray[np.bool_] | None = None
    """Whether at least one object lies in its capture set, shape (N,); None: one set for all."""
    success_any: NDArray[np.bool_] | None = None
    """Whether the state's trajectory succeeded with at least one object, shape (N,), or None."""

    def by_trajectory(self) -> list[NDArray[np.int64]]:
        """The states' numbers, one array a trajectory."""
        starts = np.flatnonzero(np.diff(self.trajectory)) + 1
        return np.split(np.arange(len(self.trajectory)), starts)


class Compared(NamedTuple):
    """Scores that are there, and what they are held against: N states, or trajectories."""

    scores: NDArray[np.float64]
    """Shape (N,); inf ranks above all else."""
    labels: NDArray[np.bool_]
    """Shape (N,)."""
    trajectory: NDArray[np.int64]
    """Which one it is of, counted from 0, shape (N,)."""
    number: NDArray[np.int64]
    """Which of all states, or trajectories, it is, shape (N,), rising."""

    @property
    def of_both_kinds(self) -> bool:
        """Whether there are two labels to tell apart."""
        return bool(self.labels.any() and not self.labels.all())


@dataclass(frozen=True)
class Cell:
    """One comparison of a score with a label."""

    auc: float
    ap: float
    auc_interval: tuple[float, float] | None
    """95 % bootstrap interval; None if there are not two trajectories to draw from."""
    ap_interval: tuple[float, float] | None
    count: int
    """How many states, or trajectories."""
    positives: int
    """How many of them have the label 1."""

    def value(self) -> str:
        """AUC/AP, such as ".981/.992"."""
        return f"{short(self.auc)}/{short(self.ap)}"

    def intervals(self) -> tuple[str, str]:
        """Of AUC and of AP, such as ".96-.99"; a dash if there is none."""
        return _span(self.auc_interval), _span(self.ap_interval)


@dataclass(frozen=True)
class Evaluation:
    """AUC and AP of every score. A cell is None if there is but one label to tell apart."""

    task: str
    horizons: tuple[int, ...]
    states: dict[str, dict[int, Cell | None]]
    """By score, then by horizon."""
    success: Cell | None
    """The trajectory score; None also if the success score was not computed."""
    missing: int
    """States that lack a score, and are left out."""
    success_any: Cell | None = None
    """The trajectory score of at least one object."""
    last: int = LAST_FRAMES
    """k-bar, the frames of the trajectory score."""

    def render(self) -> RenderableType:
        """A table for the terminal, 80 columns wide."""
        from rich.console import Group
        from rich.table import Table
        from rich.text import Text

        parts: list[RenderableType] = [Text(self._caption(), "dim"), Text()]
        for title, rows in self._sections():
            table = Table(box=None, padding=(0, 1, 1, 0), pad_edge=False)
            table.add_column("")
            for column in self._columns():
                table.add_column(column, justify="center", no_wrap=True)
            for score, cells in rows:
                paper = [Text(value, "cyan") for value in self._paper(score)]
                table.add_row(score, *map(_bold_first, cells), *paper)
            parts += [Text(title, "bold cyan"), Text(), table, Text()] if title else [table]
        return Group(*parts)

    def to_markdown(self) -> str:
        """The same as a Markdown table, or two: of all objects, and of at least one."""
        parts = [self._caption()]
        for title, rows in self._sections():
            lines = [["score", *self._columns()], ["---"] * (len(self._columns()) + 1)]
            for score, cells in rows:
                shown = [cell.replace("\n", "<br>") for cell in cells]
                lines.append([score, *shown, *self._paper(score)])
            table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
            parts += [f"**{title}**", table] if title else [table]
        return "\n\n".join(parts) + "\n"

    def to_csv(self) -> str:
        """One line a cell, in full precision; what is not there is empty."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(CSV_COLUMNS if self.task in PAPER else CSV_COLUMNS[:-2])
        writer.writerows(self.csv_rows())
        return text.getvalue()

    def csv_rows(self) -> list[list[Any]]:
        """The lines of `to_csv`, with CSV_COLUMNS; the paper's are there if it has the task."""
        cells: list[tuple[str, int | str, Cell | None]] = [
            (score, horizon, cell)
            for score, by_horizon in self.states.items()
            for horizon, cell in by_horizon.items()
        ]
        cells.append((SUCCESS, "", self.success))
        if self._several():
            cells.append((SUCCESS + ANY, "", self.success_any))
        papers, missing = PAPER.get(self.task, {}), ("", "") if self.task in PAPER else ()
        return [
            [score, horizon, *csv_fields(cell), *papers.get(score, missing)]
            for score, horizon, cell in cells
        ]

    def _several(self) -> bool:
        """Whether there are scores of at least one object."""
        return self.success_any is not None or any(score.endswith(ANY) for score in self.states)

    def _columns(self) -> list[str]:
        paper = ["paper"] if self.task in PAPER else []
        return [*(f"h = {horizon}" for horizon in self.horizons), *paper]

    def _paper(self, score: str) -> list[str]:
        """The cell of the paper's column, if there is one."""
        return [paper_value(self.task, score)] if self.task in PAPER else []

    def _sections(self) -> list[tuple[str, list[tuple[str, list[str]]]]]:
        """Titles, empty if there is one section alone, and rows: a score's name and its cells."""
        rows = {
            score: [_stacked(c) for c in cells.values()] for score, cells in self.states.items()
        }
        for score, cell in ((SUCCESS, self.success), (SUCCESS + ANY, self.success_any)):
            if cell is not None:
                rows[score] = [_stacked(cell), *[""] * (len(self.horizons) - 1)]
        of_all = [row for row in rows.items() if not row[0].endswith(ANY)]
        of_any = [row for row in rows.items() if row[0].endswith(ANY)]
        return [(ALL_TITLE, of_all), (ANY_TITLE, of_any)] if self._several() else [("", of_all)]

    def _caption(self) -> str:
        caption = (
            f"{self.task}: AUC/AP of each score, with their 95 % intervals below. "
            "States: captured over the next h frames. "
            f"Success: the last {self.last} frames of a trajectory, whose success has no horizon."
        )
        if self.missing:
            caption += f" {self.missing} states have no score yet and are left out."
        return caption


def captured_labels(captured: NDArray[np.bool_], horizon: int) -> NDArray[np.bool_]:
    """Label of each state of one trajectory, shape (K,): captured in all frames k to k + horizon.

    A horizon that runs past the last frame ends there: all K states have a label (Section VI-D).
    """
    return np.array([captured[k : k + horizon + 1].all() for k in range(len(captured))], dtype=bool)


def trajectory_score(scores: NDArray[np.float64], last: int = LAST_FRAMES) -> float:
    """Omega_suc(z, k-bar) of one trajectory, shape (K,) (Section VI-D).

    The weighted mean of its last frames, with weights 1, 2, 3, ...
    """
    tail = scores[-last:]
    return float(np.average(tail, weights=np.arange(1, len(tail) + 1)))


def evaluate(
    labelled: LabelledScores,
    horizons: Sequence[int] = HORIZONS,
    draws: int = DRAWS,
    seed: int = 0,
    *,
    last: int = LAST_FRAMES,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Compares every score with its label. States without a score are left out, and counted.

    `last`: k-bar, the frames of a trajectory whose success scores count. `progress(done, total)`
    counts the cells of the states: with 20,000 of these, each takes seconds.
    """
    weights = _bootstrap_weights(len(labelled.by_trajectory()), draws, seed)
    states: dict[str, dict[int, Cell | None]] = {m: {} for m in state_metrics(labelled)}
    cells = [(metric, horizon) for metric in states for horizon in horizons]
    for done, (metric, horizon) in enumerate(cells):
        if progress is not None:
            progress(done, len(cells))
        states[metric][horizon] = _cell(compared_states(labelled, metric, horizon), weights)
    missing = np.any([np.isnan(values) for values in labelled.scores.values()], axis=0)
    return Evaluation(
        task=labelled.task,
        horizons=tuple(horizons),
        states=states,
        success=_success_cell(labelled, SUCCESS, weights, last),
        missing=int(missing.sum()),
        success_any=_success_cell(labelled, SUCCESS + ANY, weights, last),
        last=last,
    )


def state_metrics(labelled: LabelledScores) -> list[str]:
    """The metrics that `evaluate` holds against the label "captured"."""
    metrics = [metric for metric in labelled.scores if metric not in SUCCESSES]
    if labelled.captured_any is not None and FORCE in metrics:
        metrics.append(FORCE + ANY)
    return metrics


def paper_value(task: str, score: str) -> str:
    """AUC/AP in the paper's Table I, or a dash."""
    found = PAPER.get(task, {}).get(score)
    return DASH if found is None else f"{found[0]:.2f}/{found[1]:.2f}".replace("0.", ".")


def csv_fields(cell: Cell | None) -> list[float | str]:
    """Its columns of a CSV file, from count to ap_high; empty without a cell."""
    if cell is None:
        return [""] * 8
    return [
        *(cell.count, cell.positives),
        *(cell.auc, *(cell.auc_interval or ("", ""))),
        *(cell.ap, *(cell.ap_interval or ("", ""))),
    ]


def compared_states(labelled: LabelledScores, metric: str, horizon: int) -> Compared:
    """The states that have a score, against "captured over a horizon of `horizon` frames".

    A metric that ends in "/any" is held against the label of at least one object, and "force/any"
    is the force score against it. Raises ValueError if there is no such metric, or no such label.
    """
    captured = _label(metric, labelled.captured, labelled.captured_any)
    scores = _scores(labelled, metric)
    members = labelled.by_trajectory()
    labels = [captured_labels(captured[states], horizon) for states in members]
    return _there(
        np.concatenate([scores[states] for states in members]),
        np.concatenate(labels),
        np.repeat(np.arange(len(members)), [len(own) for own in labels]),
    )


def compared_trajectories(labelled: LabelledScores, metric: str, last: int) -> Compared:
    """The trajectories whose last frames have scores, by `trajectory_score`, against success.

    Metrics and errors as of `compared_states`.
    """
    success = _label(metric, labelled.success, labelled.success_any)
    scores = _scores(labelled, metric)
    members = labelled.by_trajectory()
    return _there(
        np.array([trajectory_score(scores[states], last) for states in members]),
        np.array([success[states[-1]] for states in members]),
        np.arange(len(members)),
    )


def auc_ap(scores: NDArray[np.float64], labels: NDArray[np.bool_]) -> tuple[float, float]:
    """AUC and AP of scores, shape (N,), that may be infinite; there are labels of both kinds."""
    from sklearn.metrics import average_precision_score, roc_auc_score

    ranks = ranked(scores)
    return float(roc_auc_score(labels, ranks)), float(average_precision_score(labels, ranks))


def ranked(scores: NDArray[np.float64]) -> NDArray[np.int64]:
    """The same order in whole numbers from 0, shape (N,): scikit-learn refuses inf."""
    return np.asarray(np.unique(scores, return_inverse=True)[1])


def _scores(labelled: LabelledScores, metric: str) -> NDArray[np.float64]:
    """What has the name of a metric; the force score is one for all objects and for any."""
    name = FORCE if metric == FORCE + ANY else metric
    if name not in labelled.scores:
        there = ", ".join(labelled.scores) or "none"
        raise ValueError(f"metric is {metric!r}, expected one that has scores: {there}")
    return labelled.scores[name]


def _label(
    metric: str, of_all: NDArray[np.bool_], of_any: NDArray[np.bool_] | None
) -> NDArray[np.bool_]:
    """The label of all objects, or that of at least one for a metric that ends so."""
    if not metric.endswith(ANY):
        return of_all
    if of_any is None:
        raise ValueError(f"there are scores of {metric!r}, but no labels of at least one object")
    return of_any


def _there(
    scores: NDArray[np.float64], labels: NDArray[np.bool_], trajectory: NDArray[np.int64]
) -> Compared:
    """Those that have a score."""
    there = ~np.isnan(scores)
    return Compared(scores[there], labels[there], trajectory[there], np.flatnonzero(there))


def _success_cell(
    labelled: LabelledScores, metric: str, weights: NDArray[np.int64], last: int
) -> Cell | None:
    if metric not in labelled.scores:
        return None
    return _cell(compared_trajectories(labelled, metric, last), weights)


def _cell(compared: Compared, weights: NDArray[np.int64]) -> Cell | None:
    """AUC and AP; each of the N takes the column of its trajectory of the (draws, T) weights."""
    scores, labels, trajectory, _ = compared
    if not compared.of_both_kinds:
        return None
    ranks = ranked(scores)
    block = max(1, MOST_WEIGHTS // len(trajectory))
    drawn = [
        weighted_auc_ap(ranks, labels, weights[first : first + block, trajectory])
        for first in range(0, len(weights), block)
    ]
    aucs, aps = (np.concatenate(values) for values in zip(*drawn, strict=True))
    several = len(np.unique(trajectory)) > 1
    auc, ap = auc_ap(scores, labels)
    return Cell(
        auc=auc,
        ap=ap,
        auc_interval=_interval(aucs) if several else None,
        ap_interval=_interval(aps) if several else None,
        count=len(labels),
        positives=int(labels.sum()),
    )


def weighted_auc_ap(
    ranks: NDArray[np.int64], labels: NDArray[np.bool_], weights: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """AUC and AP for each row of `weights`, (draws, N), the number of times each of N samples
    counts.

    The numbers of scikit-learn with `sample_weight`, for all draws at once: one by one they take a
    minute for a table. Draws in which only one label is left are dropped.
    """
    order = np.argsort(-ranks, kind="stable")  # from the best score down
    first = np.flatnonzero(np.diff(ranks[order], prepend=np.inf))  # where a new threshold starts
    positive = np.add.reduceat(weights[:, order] * labels[order], first, axis=1)
    negative = np.add.reduceat(weights[:, order] * ~labels[order], first, axis=1)
    true, false = positive.cumsum(axis=1), negative.cumsum(axis=1)
    both = (true[:, -1] > 0) & (false[:, -1] > 0)
    positive, negative, true, false = positive[both], negative[both], true[both], false[both]

    pairs = (negative * (true - 0.5 * positive)).sum(axis=1)  # a tie counts half
    auc = pairs / (true[:, -1] * false[:, -1])
    precision = true / np.maximum(true + false, 1)
    ap = (positive * precision).sum(axis=1) / true[:, -1]
    return auc, ap


def _bootstrap_weights(trajectories: int, draws: int, seed: int) -> NDArray[np.int64]:
    """How often each trajectory is drawn, shape (draws, T)."""
    return np.random.default_rng(seed).multinomial(
        trajectories, np.full(trajectories, 1 / trajectories), size=draws
    )


def _interval(values: NDArray[np.float64]) -> tuple[float, float] | None:
    if len(values) == 0:
        return None
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(values, [tail, 1 - tail])
    return float(low), float(high)


def _bold_first(cell: str) -> Text:
    """A cell for the terminal: its first line counts, the others say more about it."""
    from rich.text import Text

    value, *intervals = cell.split("\n")
    return Text.assemble((value, "bold"), *((f"\n{line}", "dim") for line in intervals))


def _stacked(cell: Cell | None) -> str:
    return DASH if cell is None else "\n".join((cell.value(), *cell.intervals()))


def _span(interval: tuple[float, float] | None) -> str:
    return DASH if interval is None else f"{short(interval[0])}-{short(interval[1])}"


def short(value: float) -> str:
    """Three decimals without the leading zero: .981, 1.00."""
    return "1.00" if value >= 0.9995 else f"{value:.3f}"[1:]
