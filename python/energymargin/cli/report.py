"""The command `energymargin report`: a file of scores as one page.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from __future__ import annotations

from pathlib import Path

from rich.markup import escape

import energymargin as em
from energymargin.cli.options import Output
from energymargin.cli.terminal import loading, require_free, say, share_bar


def report(
    scores: Path,
    /,
    *,
    output: Output = None,
    run: int | None = None,
    data: Path | None = None,
    trajectories: int = 30,
    pictures: int = 2,
    frames: int | None = None,
    last: int = 5,
    draws: int = 1000,
    seed: int = 0,
    overwrite: bool = False,
) -> None:
    """Make one page of a file of scores, to be opened in a browser without a network: tables,
    scores along trajectories, ROC, histograms, pictures of the states that the scores get most
    wrong, and what is missing.

    Example: `energymargin report push-scores.db -o report.html`

    Args:
        scores: A file of scores, from `energymargin score`.
        output: The page; SCORES with .html if not given.
        run: Which run, if there are several; `energymargin export` lists them.
        data: The dataset, for times and pictures; if not given, the one beside the scores:
            push.h5 of push-scores.db.
        trajectories: How many trajectories are shown at most: half of them those that the scores
            get most wrong, the others evenly spaced.
        pictures: How many states of each score and label are drawn, whose trees are grown again.
        frames: Frames that the label looks ahead in histograms and pictures; if not given 2, or
            fewer if no trajectory has as many.
        last: Frames of a trajectory whose success scores count: k-bar.
        draws: Bootstrap resamples of each interval: with many states, fewer do.
        seed: Seed of the bootstrap intervals.
        overwrite: Replace the file if it exists.
    """
    with loading():
        import energymargin.report  # noqa: F401

    output = output or scores.with_suffix(".html")
    require_free(output, overwrite=overwrite)
    options = em.report.Options(trajectories, pictures, frames, last, draws, seed)
    with share_bar() as progress:
        lacking = em.report.write(
            scores, output, run=run, options=options, data=data, progress=progress
        )
    say(f"Wrote {escape(str(output))}, {output.stat().st_size / 1e6:.1f} MB: open it in a browser")
    for text in lacking:
        say(f"[yellow]Notice in the page:[/] {escape(text)}")
