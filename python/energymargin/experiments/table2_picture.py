"""The picture of `table2`: of each combination the state that the capture score gets most wrong."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import plots
from energymargin._core import capture_score, stream
from energymargin.evaluation.labelled import captured_labels
from energymargin.experiments.table2 import FRAME_RATE, LONG_HORIZON, Row, Settings, Table2
from energymargin.tasks.printed import TOOLS

try:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
except ImportError as error:
    raise ImportError("pictures need matplotlib: pip install 'energymargin[plots]'") from error

__all__ = ["figure_table2", "most_wrong"]

VIEW = ((-0.12, 0.12), (-0.08, 0.16))  # m
LEGEND = 0.5  # inch


def figure_table2(result: Table2) -> Figure:
    """A column an object and a row an end-effector, as far as they were asked for."""
    rows = {row.combination: row for row in result.rows}
    objects = list(dict.fromkeys(name.split("-")[0] for name in rows))
    tools = [tool for tool in TOOLS if any(name.endswith(tool) for name in rows)]
    size = (2.4 * len(objects) + 0.6, 2.9 * len(tools) + LEGEND)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    axes = figure.subplots(len(tools), len(objects), squeeze=False, sharex=True, sharey=True)
    for (i, tool), (j, name) in product(enumerate(tools), enumerate(objects)):
        row = rows.get(f"{name}-{tool}")
        if row is None:
            axes[i, j].set_axis_off()
            continue
        handles = _draw(axes[i, j], row, result.settings)
        axes[i, j].label_outer()
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=min(len(handles), 2 * len(objects)),
        frameon=False,
        fontsize=7,
    )
    return figure


def _draw(ax: Axes, row: Row, settings: Settings) -> list[Artist]:
    """The tree of the state that is most wrong; the entries of a legend."""
    number = most_wrong(row)
    (problem,) = row.dataset.problems([number])
    score = capture_score(
        problem, nodes=settings.nodes, seed=stream(settings.seed, number), warn=False
    )
    most = float(score.tree.costs.max())
    look: dict[str, Any] = {"limits": VIEW, "most": most, "path": False, "color_bar": False}
    plots.plot_state(problem, score, ax, **look, ghosts=2)
    truth = "stays" if _labels(row)[number] else "lost"
    ax.set_title(
        f"{row.combination}\n{truth} within {LONG_HORIZON / FRAME_RATE:.1f} s, "
        f"score {row.labelled.scores['capture'][number]:.2f}",
        fontsize=8,
    )
    return list(plots.state_legend(problem))


def most_wrong(row: Row) -> int:
    """The number of the state whose score lies on the wrong side of most states of the other label,
    captured over the long horizon or not."""
    labels = _labels(row)
    scores = row.labelled.scores["capture"]
    wrong = np.where(
        labels,
        [(scores[~labels] > score).mean() for score in scores],
        [(scores[labels] < score).mean() for score in scores],
    )
    return int(wrong.argmax())


def _labels(row: Row) -> NDArray[np.bool_]:
    members = row.labelled.by_trajectory()
    captured = row.labelled.captured
    return np.concatenate([captured_labels(captured[own], LONG_HORIZON) for own in members])
