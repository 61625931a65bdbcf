"""The command `energymargin export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from energymargin.cli.options import RunOption, ScoresArgument
from energymargin.cli.terminal import out, say

__all__ = ["export"]


def export(
    scores: ScoresArgument,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="A .csv or .parquet file; without it, the runs are listed."
        ),
    ] = None,
    run: RunOption = None,
) -> None:
    """Write scores and labels as a table, a row a state; or list the runs of a file of scores.

    Example: `energymargin export push-scores.db -o push-scores.csv`
    """
    from energymargin import store
    from energymargin.store.export import curves_path

    if output is None:
        with store.ScoreStore(scores) as opened:
            for listed in opened.runs():
                out.print(str(listed), soft_wrap=True, highlight=False)
        return
    rows = store.export(scores, output, run=run)
    with store.ScoreStore(scores) as opened:
        chosen = opened.runs() if run is None else [opened.run(run)]
        curves = any(written.has_curves for written in chosen)
    beside = f", and their curves to {escape(str(curves_path(output)))}" if curves else ""
    say(f"Wrote {rows} states to {escape(str(output))}{beside}")
