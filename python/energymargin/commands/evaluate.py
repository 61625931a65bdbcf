"""The command `energymargin evaluate`, and the table that others share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from energymargin.terminal import RunNumber, err, out

if TYPE_CHECKING:
    from energymargin.evaluation import LabelledScores

__all__ = ["evaluate", "print_evaluation"]


def evaluate(
    scores: Annotated[Path, typer.Argument(help="A file of scores, from `energymargin score`.")],
    *,
    markdown: Annotated[
        Path | None, typer.Option(help="Write the table to this file as well.")
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(help="Write every number to this file as well.")
    ] = None,
    run: RunNumber = None,
    last: Annotated[
        int, typer.Option(help="Frames of a trajectory whose success scores count: k-bar.")
    ] = 5,
    seed: Annotated[int, typer.Option(help="Of the bootstrap intervals.")] = 0,
) -> None:
    """Compare scores with what happened: AUC and AP by horizon, beside the paper's if it has them.

    Example: `energymargin evaluate push-scores.db --markdown table.md`
    """
    from energymargin.store import ScoreStore
    from energymargin.tasks.base import whole_number

    whole_number("last", last, 1)
    with ScoreStore(scores) as store:
        print_evaluation(store.run(run).labelled_scores(), markdown, csv, seed, last)


def print_evaluation(
    labelled: LabelledScores, markdown: Path | None, csv: Path | None, seed: int, last: int = 5
) -> None:
    """AUC and AP, on the terminal and into files."""
    from energymargin import evaluation
    from energymargin.progress import share_bar

    with share_bar(err) as told:
        result = evaluation.evaluate(
            labelled,
            seed=seed,
            last=last,
            progress=lambda done, total: told("AUC and AP", done / total),
        )
    out.print(result.render())
    if markdown is not None:
        markdown.write_text(result.to_markdown())
    if csv is not None:
        csv.write_text(result.to_csv())
