"""The command `energymargin import`: from recordings of a camera to a dataset.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from energymargin.cli.options import Parameters, parsed
from energymargin.cli.terminal import err, say

if TYPE_CHECKING:
    from energymargin.recordings import Recording

__all__ = ["import_recordings"]


def import_recordings(
    *,
    files: Annotated[
        list[Path] | None, typer.Argument(help="The recordings: CSV files, a row a frame.")
    ] = None,
    task: Annotated[
        str | None, typer.Option(help="Whose scene and capture set these recordings have.")
    ] = None,
    labels: Annotated[
        Path | None,
        typer.Option(help="CSV file recording,success: a row for each recording's file name."),
    ] = None,
    published: Annotated[
        Path | None,
        typer.Option(
            help="Instead of files, the folder of the data that the paper's authors published: "
            "each part becomes a dataset, with the authors' scores in a file beside it.",
            metavar="DIR",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="The dataset; TASK-recorded.h5 if not given. With --published, the folder.",
        ),
    ] = None,
    parameter: Parameters = None,
    columns: Annotated[
        Path | None,
        typer.Option(help="JSON file that says which column is what, and in which units."),
    ] = None,
    captured: Annotated[
        Path | None,
        typer.Option(
            help="CSV file recording,frame,captured; if not given, the task's capture set says it."
        ),
    ] = None,
    mend: Annotated[
        bool,
        typer.Option(
            "--mend/--no-mend", help="Fill short gaps and replace outliers, or refuse them."
        ),
    ] = True,
    longest_gap: Annotated[
        float, typer.Option(help="Seconds that a body may not be seen, or frames be missing.")
    ] = 0.1,
    smoothing: Annotated[
        float,
        typer.Option(help="Time scale of the smoothing where the files have no velocities, in s."),
    ] = 0.06,
    most_overlap: Annotated[
        float, typer.Option(help="Metres that a body may be moved out of another one.")
    ] = 0.01,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the file if it exists.")
    ] = False,
) -> None:
    """Read recordings of a camera and make them a dataset of a task, to be scored frame by frame.

    Example: `energymargin import a.csv b.csv --task push -p friction=0.3 --labels labels.csv`

    The authors' data: `energymargin import --published dynamicCageForMPPI-data -o published`
    """
    if published is not None:
        if files or task or labels:
            raise ValueError(
                "--published reads a whole folder, so no files, --task or --labels go with it"
            )
        _import_published(published, output or Path("published"), overwrite=overwrite)
        return
    if not files or task is None or labels is None:
        raise ValueError(
            "expected recordings with --task and --labels, or --published DIR: "
            "energymargin import --help has examples"
        )
    from energymargin import recordings
    from energymargin import tasks as registry

    output = output or Path(f"{task}-recorded.h5")
    made = registry.make(task, **parsed(parameter or []))
    if output.exists() and not overwrite:
        raise ValueError(f"{output} exists: choose another -o, or give --overwrite")
    layout = recordings.Columns.of(columns)
    success = recordings.read_labels(labels)
    frame_labels = None if captured is None else recordings.read_frame_labels(captured)
    read = []
    for path in files:
        read.append(
            recordings.read_csv(
                path, layout, mend=mend, longest_gap=longest_gap, smoothing=smoothing
            )
        )
        say(f"{escape(str(path))}: {_summary(read[-1])}")
    names = {recording.name for recording in read}
    if frame_labels is not None:
        frame_labels = {name: own for name, own in frame_labels.items() if name in names}
    of_these = {r.name: success[r.name] for r in read if r.name in success}
    if len(success) > len(of_these):
        say(f"{escape(str(labels))}: {len(success) - len(of_these)} labels are of other recordings")
    dataset = recordings.dataset(
        made,
        read,
        of_these,
        captured=frame_labels,
        most_overlap=most_overlap,
        notice=lambda text: say(escape(text)),
    )
    dataset.save(output)
    written = escape(str(output))
    say(
        f"Wrote {len(read)} trajectories ({dataset.successes.sum()} successful), {dataset.size} "
        f"states to {written}. Next: [bold]energymargin score {written}[/]"
    )


def _summary(recording: Recording) -> str:
    times = recording.times
    return f"{len(recording)} frames, {times[-1] - times[0]:.3g} s; {recording.mended}"


def _import_published(data: Path, folder: Path, *, overwrite: bool) -> None:
    """A dataset and a file of scores for each part of the authors' data."""
    from energymargin import published
    from energymargin.cli.progress import progress_bar

    parts = published.parts(data)
    folder.mkdir(parents=True, exist_ok=True)
    there = [path for part in parts if (path := folder / f"{part}.h5").exists()]
    if there and not overwrite:
        raise ValueError(f"{there[0]} exists: choose another -o, or give --overwrite")
    with progress_bar(err, "Reading", "parts") as progress:
        progress(0, len(parts))
        for done, part in enumerate(parts, 1):
            dataset = published.dataset(data, part)
            dataset.save(folder / f"{part}.h5")
            published.add_scores(folder / f"{part}-scores.db", data, dataset, part)
            progress(done, len(parts))
    one = escape(str(folder / parts[0]))
    say(
        f"Wrote {len(parts)} datasets with the authors' scores to {escape(str(folder))}. Next: "
        f"[bold]energymargin evaluate {one}-scores.db[/], or [bold]energymargin score {one}.h5[/]"
    )
