"""Scores of grasps as one page: the ranking, and pictures of the best, the most doubtful, and the
worst."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

import energymargin as em
from energymargin.base.checks import check_type
from energymargin.base.interrupts import remembered_interrupts
from energymargin.base.replacing import replaced
from energymargin.look.plots.grasps import figure_grasp, plot_grasps
from energymargin.look.report.page import Progress, check_suffix, rendered
from energymargin.look.report.pictures import svg
from energymargin.look.report.worst import png

SIZE = (10.0, 4.0)  # inch, of the probabilities by rank
MOST_ROWS = 2000  # of the table of all grasps


class GraspCard(NamedTuple):
    """A grasp with its picture."""

    which: str
    name: str
    text: str
    image: str
    """A data URI."""


def write_grasps(
    scores: em.grasps.GraspScores,
    output: str | os.PathLike[str],
    *,
    title: str = "Grasps",
    progress: Progress | None = None,
) -> None:
    """Writes a report of scores of grasps: one HTML file that needs no network.

    Args:
        scores: of `em.grasps.score`.
        output: the page, a path that ends in .html or .htm; what is there is replaced.
        title: of the page.
        progress: progress(what, share) is called with what is done now, and the share that is done.

    Raises ValueError on other scores and another suffix, and OSError if it cannot be written.
    """
    check_type("scores", scores, em.grasps.GraspScores, "GraspScores, as of em.grasps.score")
    output = Path(output)
    check_suffix(output)
    found, table = em.summary.summary(scores), scores.table()
    with remembered_interrupts(), replaced(output) as file:
        figure = Figure(figsize=SIZE, layout="constrained")
        plot_grasps(scores, figure.subplots())
        page = {
            "title": title,
            "lead": found.lead.partition(";")[0],
            "notes": found.notes,
            "about": em.summary.summary(scores.trials),
            "ranking": svg(figure),
            "cards": list(_cards(scores, progress)),
            "head": list(table),
            "rows": list(zip(*table.values(), strict=True))[:MOST_ROWS],
            "more": len(scores.grasps) - MOST_ROWS,
            "algorithm": em.searches.algorithm(),
        }
        file.write_text(rendered("grasps.html", page), encoding="utf-8")


def _cards(scores: em.grasps.GraspScores, progress: Progress | None) -> Iterator[GraspCard]:
    if not len(scores.ranked):
        return
    chosen = {scores.best: "", scores.doubtful: "The most doubtful", scores.worst: "The worst"}
    chosen[scores.best] = "The best"
    for place, (k, which) in enumerate(chosen.items()):
        if progress is not None:
            progress("Pictures", place / len(chosen))
        yield GraspCard(
            which, scores.grasps.names[k], _text(scores, k), png(figure_grasp(scores, k))
        )


def _text(scores: em.grasps.GraspScores, k: int) -> str:
    """The figures of a grasp, in a sentence."""
    low, high = scores.interval()[k]
    label, effort = scores.grasps.labels[k], scores.efforts[k]
    ways = ", ".join(f"{count} {ending}" for ending, count in scores.losses(k).items())
    parts: list[Any] = [f"Holds in {scores.probabilities[k]:.2f} of its trials "]
    parts.append(f"({low:.2f} to {high:.2f} with 95 % confidence): {ways}.")
    parts += [] if np.isnan(effort) else [f" Effort of escape {effort:.2g} J."]
    parts += [] if np.isnan(label) else [f" Label {label:g}."]
    return "".join(parts)
