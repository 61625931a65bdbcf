"""The command `energymargin export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from rich.markup import escape

import energymargin as em
from energymargin.cli.options import Output, panel, require_beside
from energymargin.cli.terminal import dataset_of, out, require_free, say

WITH_DATA = panel("With the dataset")


def export(
    scores: Path,
    /,
    *,
    output: Output = None,
    run: int | None = None,
    lerobot: Annotated[Path | None, WITH_DATA] = None,
    data: Annotated[Path | None, WITH_DATA] = None,
    overwrite: bool = False,
) -> None:
    """Write scores and labels as a table, a row a state; or list the runs of a file of scores.

    Example: `energymargin export push-scores.db -o push-scores.csv`

    Back into a LeRobot dataset: `energymargin export P-recorded-scores.db --lerobot pusht -o
    pusht-scored`

    Args:
        scores: A file of scores, from `energymargin score`.
        output: A .csv or .parquet file; without it, the runs are listed. With --lerobot it is a
            new folder.
        run: Which run, if there are several; `energymargin export` lists them.
        overwrite: Replace the file if it exists.
        lerobot: The LeRobot dataset that was imported: a copy of it gets each score as a column.
        data: The dataset, for --lerobot; if not given, the one beside the scores: push.h5 of
            push-scores.db.
    """
    if lerobot is not None:
        if output is None:
            raise ValueError(f"--lerobot is {lerobot}, expected -o with the name of a new folder")
        names = em.store.export_lerobot(scores, dataset_of(scores, data), lerobot, output, run=run)
        say(f"Wrote {escape(str(output))}, a copy with {', '.join(names)}")
        return
    require_beside("lerobot", lerobot, data=data)
    with em.store.ScoreStore(scores) as opened:
        if output is None:
            for listed in opened.runs():
                out.print(str(listed), soft_wrap=True, highlight=False)
            return
        chosen = opened.runs() if run is None else [opened.run(run)]
        curves = any(written.has_curves for written in chosen)
    curves_file = em.store.curves_path(output)
    for path in (output, curves_file) if curves else (output,):
        require_free(path, overwrite=overwrite)
    rows = em.store.export(scores, output, run=run)
    more = f", and their curves to {escape(str(curves_file))}" if curves else ""
    of = f" of {len(chosen)} runs" if len(chosen) > 1 else ""
    say(f"Wrote {rows} rows{of} to {escape(str(output))}{more}")
    if curves_file.exists() and not curves:
        say(f"[yellow]{escape(str(curves_file))} is not of these scores[/], which have no curves")
