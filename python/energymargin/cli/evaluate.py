"""The command `energymargin evaluate`, and the table that others share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import energymargin as em
from energymargin.base.replacing import replace_text
from energymargin.cli.options import Outputs
from energymargin.cli.terminal import out, require_outputs, share_bar

Labelled = em.evaluation.LabelledScores


def evaluate(
    scores: Path,
    /,
    *,
    output: Outputs = None,
    run: int | None = None,
    frames: list[int] | None = None,
    last: int = 5,
    among: Literal["all", "captured"] | None = None,
    clipped: bool = False,
    draws: int = 1000,
    seed: int = 0,
    overwrite: bool = False,
) -> None:
    """Compare scores with what happened: AUC and AP, with their intervals.

    Of scores with a horizon first what they ask: of the states that are captured now, which stay so
    over the next frames? Then all states by horizon, of which many are lost already. Of scores
    without one both by horizon.

    Example: `energymargin evaluate push-scores.db -o table.md`

    Args:
        scores: A file of scores, from `energymargin score`.
        output: Write the table to a .md file, or every number to a .csv file; may be repeated.
        run: Which run, if there are several; `energymargin export` lists them.
        last: Frames of a trajectory whose success scores count: k-bar.
        frames: How many frames the label looks ahead; may be repeated.
        among: Compare all states, or those that are captured now, by horizon.
        clipped: Let a horizon end with its trajectory, instead of leaving such states out.
        draws: Bootstrap resamples of each interval: with many states, fewer do.
        seed: Seed of the bootstrap intervals.
        overwrite: Replace the file if it exists.
    """
    require_outputs(output or (), overwrite=overwrite)
    with em.store.ScoreStore(scores) as store:
        asked = store.labelled_scores(store.run(run))
    tables = em.evaluation.tables_of(*asked, among=among, frames=frames, clipped=clipped)
    options: dict[str, Any] = {"last": last, "clipped": clipped, "draws": draws, "seed": seed}
    print_evaluation(tables, output or (), **options)


def print_evaluation(
    tables: Sequence[tuple[em.evaluation.LabelledScores, em.evaluation.Among, Sequence[int]]],
    outputs: Sequence[Path] = (),
    **options: Any,
) -> None:
    """AUC and AP, on the terminal and into files: the tables of `em.evaluation.tables_of`, with
    these options of `em.evaluation.evaluate`."""
    with share_bar() as bar:
        options["progress"] = lambda done, total: bar("AUC and AP", done / total)
        results = [
            em.evaluation.evaluate(scores, among=among, frames=frames, **options)
            for scores, among, frames in tables
        ]
    for number, result in enumerate(results):
        if number:
            out.print()
        out.print(em.summary.summary(result))
    for path in outputs:
        replace_text(path, WRITERS[path.suffix](results))


def _markdown(results: Sequence[em.evaluation.Evaluation]) -> str:
    return "\n".join(result.to_markdown() for result in results)


def _csv(results: Sequence[em.evaluation.Evaluation]) -> str:
    first, *more = (result.to_csv() for result in results)
    return first + "".join(text.split("\n", 1)[1] for text in more)


WRITERS = {".md": _markdown, ".csv": _csv}
