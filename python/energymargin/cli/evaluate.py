"""The command `energymargin evaluate`, and the table that others share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from energymargin.cli.options import RunNumber
from energymargin.cli.terminal import err, out

if TYPE_CHECKING:
    from energymargin.evaluation import Among, Evaluation, LabelledScores

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
    among: Annotated[
        str | None,
        typer.Option(
            help="Compare all states, or those that are captured now. If not given, there is a "
            "table of each.",
            metavar="all|captured",
        ),
    ] = None,
    clipped: Annotated[
        bool,
        typer.Option(
            "--clipped",
            help="Let a horizon end with its trajectory, instead of leaving such states out.",
        ),
    ] = False,
    seed: Annotated[int, typer.Option(help="Of the bootstrap intervals.")] = 0,
) -> None:
    """Compare scores with what happened: AUC and AP by horizon, beside the paper's if it has them.

    Twice: among all states, of which many are lost already, and among those that are captured now,
    which is what foresight means.

    Example: `energymargin evaluate push-scores.db --markdown table.md`
    """
    from energymargin.checks import one_of, whole_number
    from energymargin.evaluation import AMONG
    from energymargin.store import ScoreStore

    whole_number("last", last, 1)
    if among is not None:
        one_of("among", among, AMONG)
    which = [choice for choice in AMONG if among in (None, choice)]
    with ScoreStore(scores) as store:
        labelled = store.run(run).labelled_scores()
    print_evaluation(labelled, markdown, csv, seed, last, among=which, clipped=clipped)


def print_evaluation(
    labelled: LabelledScores,
    markdown: Path | None,
    csv: Path | None,
    seed: int,
    last: int = 5,
    *,
    among: Sequence[Among] = ("all", "captured"),
    clipped: bool = False,
) -> None:
    """AUC and AP, on the terminal and into files: a table for each of `among`."""
    results = [_evaluated(labelled, which, last, seed, clipped=clipped) for which in among]
    for number, result in enumerate(results):
        if number:
            out.print()
        out.print(result.render())
    if markdown is not None:
        markdown.write_text("\n".join(result.to_markdown() for result in results))
    if csv is not None:
        first, *more = (result.to_csv() for result in results)
        csv.write_text(first + "".join(text.split("\n", 1)[1] for text in more))


def _evaluated(
    labelled: LabelledScores, among: Among, last: int, seed: int, *, clipped: bool
) -> Evaluation:
    from energymargin import evaluation
    from energymargin.cli.progress import share_bar

    with share_bar(err) as told:
        return evaluation.evaluate(
            labelled,
            seed=seed,
            last=last,
            among=among,
            clipped=clipped,
            progress=lambda done, total: told("AUC and AP", done / total),
        )
