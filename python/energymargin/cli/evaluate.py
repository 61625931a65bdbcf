"""The command `energymargin evaluate`, and the table that others share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import energymargin as em
from energymargin.base.replacing import replace_text
from energymargin.cli.options import Outputs
from energymargin.cli.places import require_free
from energymargin.cli.progress import share_bar
from energymargin.cli.terminal import err, out

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
    for path in output or []:
        require_free(path, overwrite=overwrite, suffixes=WRITERS)
    with em.store.ScoreStore(scores) as store:
        labelled, now = question_of(store, store.run(run))
    options: dict[str, Any] = {"last": last, "clipped": clipped, "draws": draws, "seed": seed}
    print_evaluation(labelled, output or [], among, now=now, frames=frames, **options)


def question_of(
    store: em.store.ScoreStore, run: em.store.Run
) -> tuple[em.evaluation.LabelledScores, em.evaluation.LabelledScores | None]:
    """The scores of a run; and of one with a horizon, those of the states as they are."""
    now = store.beside(run)
    return run.labelled_scores(), None if now is None else now.labelled_scores()


def print_evaluation(
    labelled: em.evaluation.LabelledScores,
    outputs: Sequence[Path],
    among: em.evaluation.Among | None = None,
    *,
    now: em.evaluation.LabelledScores | None = None,
    frames: Sequence[int] | None = None,
    **options: Any,
) -> None:
    """AUC and AP, on the terminal and into files: the tables of `tables_of`, or with `among` or
    `frames` those that are chosen.

    `options` are others of `evaluation.evaluate`.
    """
    clipped = options.get("clipped", False)
    tables = em.evaluation.tables_of(labelled, now, among=among, frames=frames, clipped=clipped)
    results = print_tables(tables, **options)
    for path in outputs:
        replace_text(path, WRITERS[path.suffix](results))


def print_tables(
    tables: Sequence[tuple[em.evaluation.LabelledScores, em.evaluation.Among, Sequence[int]]],
    **options: Any,
) -> list[em.evaluation.Evaluation]:
    """Prints tables as of `tables_of`, and returns them."""
    with share_bar(err) as bar:
        options["progress"] = lambda done, total: bar("AUC and AP", done / total)
        results = [
            em.evaluation.evaluate(scores, among=among, frames=frames, **options)
            for scores, among, frames in tables
        ]
    for number, result in enumerate(results):
        if number:
            out.print()
        out.print(em.summary.summary(result))
    return results


def _markdown(results: Sequence[em.evaluation.Evaluation]) -> str:
    return "\n".join(result.to_markdown() for result in results)


def _csv(results: Sequence[em.evaluation.Evaluation]) -> str:
    first, *more = (result.to_csv() for result in results)
    return first + "".join(text.split("\n", 1)[1] for text in more)


WRITERS = {".md": _markdown, ".csv": _csv}
