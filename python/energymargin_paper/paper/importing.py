"""The command `energymargin import-published`: the authors' data as datasets and stores of ours.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter
from rich.markup import escape

from energymargin.cli.terminal import progress_bar, require_free, say

__all__ = ["app"]

app = App(name="import-published")


@app.default
def import_published(
    data: Path,
    /,
    *,
    output: Annotated[Path, Parameter(alias="-o")] = Path("published"),
    overwrite: bool = False,
) -> None:
    """Read the data that the paper's authors published: a dataset of each part, and their scores.

    Example: `energymargin import-published dynamicCageForMPPI-data`

    Args:
        data: The folder of the authors' data.
        output: A dataset of each part, with its scores beside it.
        overwrite: Replace files that exist.
    """
    from energymargin.records.datasets.dataset import left_out_text
    from energymargin_paper.paper import authors

    parts = authors.parts(data)
    output.mkdir(parents=True, exist_ok=True)
    for part in parts:
        require_free(output / f"{part}.h5", overwrite=overwrite)
    states = left_out = 0
    with progress_bar("Reading", "parts") as progress:
        progress(0, len(parts))
        for done, part in enumerate(parts, 1):
            dataset = authors.dataset(data, part)
            dataset.save(output / f"{part}.h5")
            authors.add_scores(output / f"{part}-scores.db", data, dataset, part)
            _, reasons = dataset.possible_problems()
            if reasons:
                say(f"[yellow]{part}: {escape(left_out_text(reasons, dataset.size))}[/]")
            states, left_out = states + dataset.size, left_out + len(reasons)
            progress(done, len(parts))
    one = escape(str(output / parts[0]))
    say(
        f"Wrote {len(parts)} datasets with the authors' scores to {escape(str(output))}: {states} "
        f"states, of which {left_out} cannot be simulated. Next: "
        f"[bold]energymargin evaluate {one}-scores.db[/], or "
        f"[bold]energymargin score {one}.h5 --paper[/]"
    )
