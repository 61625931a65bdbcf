"""The command `energymargin evaluate`, and the table that others share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from energymargin.cli.places import require_free
from energymargin.cli.terminal import err, out
from energymargin.replacing import replace_text
from energymargin.summary import summary

if TYPE_CHECKING:
    from energymargin.evaluation import Among, Evaluation, LabelledScores


def evaluate(
    scores: Path,
    *,
    output: list[Path] | None = None,
    run: int | None = None,
    frames: list[int] | None = None,
    last: int = 5,
    among: Literal["all", "captured"] | None = None,
    clipped: bool = False,
    draws: int = 1000,
    seed: int = 0,
    overwrite: bool = False,
) -> None:
    """Compare scores with what happened: AUC and AP by horizon, beside the paper's if it has them.

    Twice: among all states, of which many are lost already, and among those that are captured now,
    which is what foresight means.

    Example: `energymargin evaluate push-scores.db -o table.md`

    Args:
        output: Write the table to a .md file, or every number to a .csv file; may be repeated.
        frames: How many frames the label looks ahead, 0 to 5 if not given; may be repeated.
        among: Compare all states, or those that are captured now; if not given, a table of each.
        clipped: Let a horizon end with its trajectory, instead of leaving such states out.
        seed: Seed of the bootstrap intervals.
    """
    from energymargin.store import ScoreStore

    for path in output or []:
        require_free(path, overwrite=overwrite, suffixes=WRITERS)
    with ScoreStore(scores) as store:
        labelled = store.run(run).labelled_scores()
    options: dict[str, Any] = {"frames": frames} if frames else {}
    options |= {"last": last, "clipped": clipped, "draws": draws, "seed": seed}
    print_evaluation(labelled, output or [], among, **options)


def print_evaluation(
    labelled: LabelledScores,
    outputs: Sequence[Path],
    among: Among | None = None,
    **options: Any,
) -> None:
    """AUC and AP, on the terminal and into files: a table among all states, and one among those
    that are captured now, unless one of them is chosen.

    `options` are those of `evaluation.evaluate`.
    """
    from energymargin import evaluation
    from energymargin.cli.progress import share_bar
    from energymargin.evaluation.labelled import AMONG

    with share_bar(err) as bar:
        options["progress"] = lambda done, total: bar("AUC and AP", done / total)
        which = AMONG if among is None else [among]
        results = [evaluation.evaluate(labelled, among=each, **options) for each in which]
    for number, result in enumerate(results):
        if number:
            out.print()
        out.print(summary(result))
    for path in outputs:
        replace_text(path, WRITERS[path.suffix](results))


def _markdown(results: Sequence[Evaluation]) -> str:
    return "\n".join(result.to_markdown() for result in results)


def _csv(results: Sequence[Evaluation]) -> str:
    first, *more = (result.to_csv() for result in results)
    return first + "".join(text.split("\n", 1)[1] for text in more)


WRITERS = {".md": _markdown, ".csv": _csv}
