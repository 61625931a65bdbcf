"""The command `energymargin learn`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.markup import escape

import energymargin as em
from energymargin.cli.terminal import dataset_of, loading, out, require_free, say


def learn(
    scores: Path,
    /,
    *,
    output: Annotated[Path, Parameter(alias="-o")],
    data: Path | None = None,
    run: int | None = None,
    metric: str | None = None,
    coverage: float = 0.9,
    seed: int = 0,
    overwrite: bool = False,
) -> None:
    """Learn a score from the states that have it, so that it takes microseconds a state: a
    surrogate, for `em.Surrogate.load`.

    It needs a few hundred trajectories, and 50 at least. Of ten, six grow boosted trees, two say
    how wide the intervals are, and two are the test that is shown: AUC beside that of the scores,
    calibration, coverage. States unlike the training are refused later on.

    Example: `energymargin score push.h5 --frames 2 --metrics probability`, and then
    `energymargin learn push-scores.db -o push-surrogate.npz`

    Args:
        scores: A file of scores, from `energymargin score`.
        output: The surrogate, a .npz file.
        data: The dataset; if not given, the one beside the scores: push.h5 of push-scores.db.
        run: Which run, if there are several; `energymargin export` lists them.
        metric: Which score; the probability of the run if not given, or else its first.
        coverage: How probable it is that the score of a state of a new trajectory is within its
            interval.
        seed: The same seed gives the same numbers, to the last bit.
        overwrite: Replace the file if it exists.
    """
    require_free(output, overwrite=overwrite, suffixes=(".npz",))
    with loading():
        import energymargin.surrogates  # noqa: F401

    with (
        em.store.ScoreStore(scores) as store,
        em.datasets.open(dataset_of(scores, data)) as dataset,
    ):
        chosen = store.run(run)
        surrogate = em.Surrogate.learn(chosen, dataset, metric, coverage=coverage, seed=seed)
    surrogate.save(output)
    out.print(em.summary.summary(surrogate))
    say(f"Wrote {escape(str(output))}. Next: em.Surrogate.load({escape(repr(str(output)))})")
