"""The command `energymargin report`: a file of scores as one page.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from energymargin.cli.options import (
    BootstrapSeedOption,
    DrawsOption,
    LastOption,
    OverwriteOption,
    RunOption,
    ScoresArgument,
)
from energymargin.cli.places import require_free
from energymargin.cli.terminal import err, loading, say

PageOption = Annotated[
    Path | None,
    typer.Option("--output", "-o", help="The page; SCORES with .html if not given."),
]
DataOption = Annotated[
    Path | None,
    typer.Option(
        help="The dataset, for times and pictures; if not given, the one beside the scores: "
        "push.h5 of push-scores.db."
    ),
]
TrajectoriesOption = Annotated[
    int,
    typer.Option(
        help="How many trajectories are shown at most: half of them those that the scores get "
        "most wrong, the others evenly spaced."
    ),
]
PicturesOption = Annotated[
    int,
    typer.Option(
        help="How many states of each score and label are drawn, whose trees are grown again."
    ),
]
HorizonOption = Annotated[
    int | None,
    typer.Option(
        help="Frames that the label looks ahead in histograms and pictures; if not given 2, or "
        "fewer if no trajectory has as many."
    ),
]


def report(
    scores: ScoresArgument,
    *,
    output: PageOption = None,
    run: RunOption = None,
    data: DataOption = None,
    trajectories: TrajectoriesOption = 30,
    pictures: PicturesOption = 2,
    horizon: HorizonOption = None,
    last: LastOption = 5,
    draws: DrawsOption = 1000,
    seed: BootstrapSeedOption = 0,
    overwrite: OverwriteOption = False,
) -> None:
    """Make one page of a file of scores, to be opened in a browser without a network: tables,
    scores along trajectories, ROC, histograms, pictures of the states that the scores get most
    wrong, and what is missing.

    Example: `energymargin report push-scores.db -o report.html`
    """
    with loading():
        from energymargin.cli.progress import share_bar
        from energymargin.report import Options, write

    output = output or scores.with_suffix(".html")
    require_free(output, overwrite=overwrite)
    options = Options(
        trajectories=trajectories,
        pictures=pictures,
        frames=horizon,
        last=last,
        draws=draws,
        seed=seed,
    )
    with share_bar(err) as progress:
        lacking = write(scores, output, run=run, options=options, data=data, progress=progress)
    size = output.stat().st_size / 1e6
    say(f"Wrote {escape(str(output))}, {size:.1f} MB: open it in a browser")
    for text in lacking:
        say(f"[yellow]Notice in the page:[/] {escape(text)}")
