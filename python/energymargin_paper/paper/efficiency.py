"""The paper's figure of time efficiency: success prediction and time a state, against nodes.

The states of one dataset of pushes are searched with trees of several sizes, by several seeds. All
scores are kept in one file, state by state: stopped and started again, the study goes on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from energymargin.checks import whole_number
from energymargin.evaluation.labelled import HORIZON, LAST_FRAMES
from energymargin.executors.threads import Threads
from energymargin.searches import SearchSettings
from energymargin.store import Run, ScoreStore
from energymargin.store.scoring import begin_run, score_run
from energymargin.table_text import csv_text, markdown_table
from energymargin_paper.paper.quality import FRAMES, TASK, pushes, quality
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "PAPER",
    "QUANTITIES",
    "STUDY",
    "Efficiency",
    "Measurement",
    "Settings",
    "figure_efficiency",
]

METRICS = ("capture", "success")  # which share a tree
QUANTITIES = ("success_auc", "success_ap", "capture_auc", "capture_ap", "seconds")

# The paper's curve, from the source of its figure: mean, and half of what its error bar spans.
PAPER: dict[int, dict[str, tuple[float, float]]] = {
    10: {
        "success_auc": (0.823, 0.021),
        "success_ap": (0.823, 0.029),
        "seconds": (0.0237, 0.0003),
    },
    30: {
        "success_auc": (0.870, 0.044),
        "success_ap": (0.897, 0.023),
        "seconds": (0.0608, 0.0004),
    },
    100: {
        "success_auc": (0.903, 0.023),
        "success_ap": (0.927, 0.015),
        "seconds": (0.1938, 0.0106),
    },
    1000: {
        "success_auc": (0.907, 0.015),
        "success_ap": (0.933, 0.012),
        "seconds": (1.7498, 0.0181),
    },
}


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    trajectories: int = setting(50, "Pushes, of 10 states each.")
    nodes: tuple[int, ...] = setting(
        (10, 30, 100, 1000), "Sizes of the search trees, separated by commas."
    )
    """The paper's iterations."""
    seeds: int = setting(5, "Searches of each state.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        whole_number("trajectories", self.trajectories, 2)
        whole_number("seeds", self.seeds, 1)
        for nodes in self.nodes:
            whole_number("nodes", nodes, 1)
        if len(set(self.nodes)) < max(len(self.nodes), 1):
            raise ValueError(f"nodes is {list(self.nodes)}, expected some numbers, each once")


@dataclass(frozen=True)
class Measurement:
    """All states, searched with one size of trees by one seed."""

    nodes: int
    seed: int
    values: dict[str, float]
    """By QUANTITIES."""


@dataclass(frozen=True)
class Efficiency:
    """The result."""

    settings: Settings
    runs: list[Measurement]

    @property
    def nodes(self) -> list[int]:
        """The sizes of the trees, rising."""
        return sorted(self.settings.nodes)

    def values(self, nodes: int, quantity: str) -> NDArray[np.float64]:
        """One of QUANTITIES of each seed, shape (seeds,)."""
        return np.array([run.values[quantity] for run in self.runs if run.nodes == nodes])

    def mean_sd(self, nodes: int, quantity: str) -> tuple[float, float]:
        """Over the seeds; the deviation of a single one is 0."""
        values = self.values(nodes, quantity)
        return float(values.mean()), float(values.std(ddof=1)) if len(values) > 1 else 0.0

    def to_csv(self) -> str:
        """One line a size of trees, times in seconds; the paper's columns are empty where it has no
        such size."""
        of_paper, rows = list(PAPER[100]), []
        names = [*QUANTITIES, *(f"paper_{quantity}" for quantity in of_paper)]
        for nodes in self.nodes:
            ours = [number for q in QUANTITIES for number in self.mean_sd(nodes, q)]
            paper = PAPER.get(nodes)
            theirs = [number for q in of_paper for number in (paper[q] if paper else ("", ""))]
            rows.append([nodes, *ours, *theirs])
        header = ["nodes", *(f"{name}{what}" for name in names for what in ("", "_sd"))]
        return csv_text(header, rows)

    def to_markdown(self) -> str:
        """The table, and what it is of."""
        s = self.settings
        header = ["nodes", "success AUC", "success AP", "capture AUC", "capture AP", "time a state"]
        header += ["paper: success AUC", "success AP", "time a state"]
        text = (
            f"{TASK}: {s.trajectories} trajectories of {FRAMES} states, seed 0. Success: the "
            f"score of the last {LAST_FRAMES} states of a trajectory against its success. Capture: "
            f"of each state, against being captured over the next {HORIZON} frames; the paper's "
            "figure does not show it. Time: of the search of a state that gives both scores, on "
            "one thread of this machine, with whatever else it did; the paper's on an Intel Core "
            f"i9-12900H. Mean ± standard deviation of {s.seeds} seeds of the search; the paper's ± "
            "is its error bar."
        )
        rows = []
        for nodes in self.nodes:
            ours = [_cell(quantity, *self.mean_sd(nodes, quantity)) for quantity in QUANTITIES]
            paper = PAPER.get(nodes, {})
            theirs = [_cell(q, *paper[q]) if q in paper else "" for q in PAPER[100]]
            rows.append([str(nodes), *ours, *theirs])
        table = markdown_table(header, rows, ["right"] * len(header))
        return f"# Time efficiency\n\n{text}\n\n{table}\n"


class EfficiencyStudy(Study[Settings, Efficiency]):
    """How well success is predicted, and how long a state takes, against the nodes of the tree.

    The paper's figure of time efficiency, on planar pushing: AUC and AP of the success score of a
    trajectory's last states, and the computing time of a state, beside the paper's curves.

    The folder gets efficiency.md, efficiency.csv, efficiency.png, the pushes (push.h5) and all
    scores (scores.db). It takes half an hour on one core; stop it with Ctrl-C: the same command
    goes on from there.

    Example: `energymargin reproduce efficiency --nodes 10,100 --seeds 3`
    """

    name = "efficiency"
    title, unit = "Growing trees", "nodes"
    settings = Settings()
    quick = Settings(trajectories=12, nodes=(10, 30, 100), seeds=2)

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Efficiency:
        """Scores what the folder's store lacks. Raises ValueError on a folder of other
        trajectories, and on trajectories that all have the same label."""
        dataset = pushes(folder, settings.trajectories)
        before, total = 0, dataset.size * settings.seeds * sum(settings.nodes)
        runs = []
        with ScoreStore(folder / "scores.db", create=True) as store:
            for nodes, seed in product(settings.nodes, range(settings.seeds)):

                def count(done: int, _of: int, nodes: int = nodes, before: int = before) -> None:
                    progress(before + done * nodes, total)

                search = SearchSettings(nodes, seed, search="published")
                run = begin_run(store, dataset, METRICS, search)
                score_run(dataset, run, executor=Threads(threads), progress=count)
                before += dataset.size * nodes
                runs.append(Measurement(nodes, seed, _values(run)))
        return Efficiency(settings, runs)

    def figures(self, result: Efficiency) -> Iterator[tuple[str, Figure]]:
        """Success prediction and time a state, against nodes."""
        yield "efficiency.png", figure_efficiency(result)


STUDY = EfficiencyStudy()


def _values(run: Run) -> dict[str, float]:
    """Of a run that is complete."""
    found = quality(run.labelled_scores())
    (success_auc, success_ap), (capture_auc, capture_ap) = found["success"], found["capture"]
    numbers = (success_auc, success_ap, capture_auc, capture_ap, run.seconds())
    return dict(zip(QUANTITIES, numbers, strict=True))


def _cell(quantity: str, mean: float, sd: float) -> str:
    if quantity == "seconds":
        return f"{1e3 * mean:.1f} ± {1e3 * sd:.1f} ms"
    return f"{mean:.3f} ± {sd:.3f}"


# Label, colour of Okabe and Ito, marker, and how far the points stand aside, so that equal ones
# are both seen.
STYLES = {
    "success_auc": ("AUC", "#0072B2", "o", 0.96),
    "success_ap": ("AP", "#D55E00", "s", 1.04),
    "seconds": ("time", "#009E73", "^", 1.0),
}
PAPER_COLOR = "0.6"


def figure_efficiency(result: Efficiency) -> Figure:
    """AUC and AP on the left axis, time on the right one; the paper's in grey, dashed."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    figure = Figure(figsize=(6.4, 4.3), dpi=200, layout="constrained")
    left = figure.subplots()
    right = left.twinx()
    for quantity in STYLES:
        ax = right if quantity == "seconds" else left
        theirs = {nodes: values[quantity] for nodes, values in PAPER.items()}
        ours = {nodes: result.mean_sd(nodes, quantity) for nodes in result.nodes}
        _draw(ax, quantity, ours, paper=False)
        _draw(ax, quantity, theirs, paper=True)
    left.set_xscale("log")
    left.set_xticks(sorted({*PAPER, *result.nodes}))
    left.xaxis.set_major_formatter("{x:g}")
    left.xaxis.set_minor_formatter(NullFormatter())
    left.set_xlabel("nodes of the search tree (the paper's iterations)")
    left.set_ylabel("AUC, AP of the success prediction")
    left.set_ylim(top=1.015)
    right.set_ylabel("time a state [s]")
    slowest = max(right.get_ylim()[1], 1e-3)
    right.set_ylim(-0.03 * slowest, 1.15 * slowest)  # below the best AUC and AP
    left.grid(alpha=0.25, linewidth=0.5)
    pairs = [ax.get_legend_handles_labels() for ax in (left, right)]
    handles = [handle for own, _ in pairs for handle in own]
    labels = [label for _, own in pairs for label in own]
    figure.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=len(STYLES),
        frameon=False,
        fontsize=9,
    )
    return figure


def _draw(ax: Axes, quantity: str, curve: dict[int, tuple[float, float]], *, paper: bool) -> None:
    """A curve of means and deviations, by nodes."""
    label, color, marker, aside = STYLES[quantity]
    means, deviations = zip(*curve.values(), strict=True)
    ax.errorbar(
        [aside * nodes for nodes in curve],
        means,
        yerr=deviations,
        color=PAPER_COLOR if paper else color,
        marker=marker,
        linestyle="--" if paper else "-",
        markersize=5,
        linewidth=1.3,
        elinewidth=0.9,
        capsize=3,
        label=f"paper: {label}" if paper else label,
        zorder=2 if paper else 3,
    )
