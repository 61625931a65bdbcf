"""The command `energymargin evaluate`, and the table that others share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from energymargin.cli.options import (
    BootstrapSeedOption,
    DrawsOption,
    LastOption,
    OverwriteOption,
    RunOption,
    ScoresArgument,
)
from energymargin.cli.places import require_free
from energymargin.cli.terminal import err, out
from energymargin.replacing import replace_text
from energymargin.summary import summary

if TYPE_CHECKING:
    from energymargin.evaluation import Among, Evaluation, LabelledScores


OutputsOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--output",
        "-o",
        help="Write the table to a .md file, or every number to a .csv file; may be repeated.",
    ),
]
HorizonsOption = Annotated[
    list[int] | None,
    typer.Option(
        help="How many frames the label looks ahead; may be repeated.",
        metavar="FRAMES",
        show_default="0 to 5",
    ),
]
AmongOption = Annotated[
    str | None,
    typer.Option(
        help="Compare all states, or those that are captured now; if not given, a table of each.",
        metavar="all|captured",
    ),
]
ClippedOption = Annotated[
    bool,
    typer.Option(
        "--clipped",
        help="Let a horizon end with its trajectory, instead of leaving such states out.",
    ),
]


def evaluate(
    scores: ScoresArgument,
    *,
    output: OutputsOption = None,
    run: RunOption = None,
    horizon: HorizonsOption = None,
    last: LastOption = 5,
    among: AmongOption = None,
    clipped: ClippedOption = False,
    draws: DrawsOption = 1000,
    seed: BootstrapSeedOption = 0,
    overwrite: OverwriteOption = False,
) -> None:
    """Compare scores with what happened: AUC and AP by horizon, beside the paper's if it has them.

    Twice: among all states, of which many are lost already, and among those that are captured now,
    which is what foresight means.

    Example: `energymargin evaluate push-scores.db -o table.md`
    """
    from energymargin.checks import one_of, whole_number
    from energymargin.evaluation.labelled import AMONG, HORIZONS
    from energymargin.store import ScoreStore

    outputs = output or []
    for path in outputs:
        if path.suffix not in WRITERS:
            raise ValueError(f"--output is {path}, expected a name with {' or '.join(WRITERS)}")
        require_free(path, overwrite=overwrite)
    whole_number("last", last, 1)
    if among is not None:
        one_of("among", among, AMONG)
    which = [choice for choice in AMONG if among in (None, choice)]
    with ScoreStore(scores) as store:
        labelled = store.run(run).labelled_scores()
    print_evaluation(
        labelled,
        outputs,
        among=which,
        frames=[whole_number("horizon", frames, 0) for frames in horizon or HORIZONS],
        draws=draws,
        seed=seed,
        last=last,
        clipped=clipped,
    )


def print_evaluation(
    labelled: LabelledScores,
    outputs: Sequence[Path],
    *,
    among: Sequence[Among] = ("all", "captured"),
    **options: Any,
) -> None:
    """AUC and AP, on the terminal and into files: a table for each of `among`.

    `options` are those of `evaluation.evaluate`.
    """
    results = [_evaluated(labelled, among=choice, **options) for choice in among]
    for number, result in enumerate(results):
        if number:
            out.print()
        out.print(summary(result))
    for path in outputs:
        replace_text(path, WRITERS[path.suffix](results))


def _evaluated(labelled: LabelledScores, **options: Any) -> Evaluation:
    from energymargin import evaluation
    from energymargin.cli.progress import share_bar

    with share_bar(err) as bar:
        return evaluation.evaluate(
            labelled,
            progress=lambda done, total: bar("AUC and AP", done / total),
            **options,
        )


def _markdown(results: Sequence[Evaluation]) -> str:
    return "\n".join(result.to_markdown() for result in results)


def _csv(results: Sequence[Evaluation]) -> str:
    first, *more = (result.to_csv() for result in results)
    return first + "".join(text.split("\n", 1)[1] for text in more)


WRITERS = {".md": _markdown, ".csv": _csv}
