"""The command `energymargin generate`."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from energymargin.cli.options import (
    PICTURE_NODES,
    WHERE,
    OverwriteOption,
    ParameterOption,
    SchedulerOption,
    SeedOption,
    TimeoutOption,
    cluster,
    parsed,
    require_one,
)
from energymargin.cli.places import require_free
from energymargin.cli.terminal import TIMED_OUT, err, say

if TYPE_CHECKING:
    from energymargin.datasets import Dataset


TaskArgument = Annotated[str, typer.Argument(help="Name of a task, see `energymargin tasks`.")]
OutputOption = Annotated[
    Path | None, typer.Option("--output", "-o", help="The dataset; TASK.h5 if not given.")
]
TrajectoriesOption = Annotated[int, typer.Option(help="How many trajectories.")]
FramesOption = Annotated[int, typer.Option(help="How many frames of each are recorded.")]
PictureOption = Annotated[
    Path | None,
    typer.Option(help="Draw a failed and a successful trajectory with their search trees."),
]
ProcessesOption = Annotated[
    int | None,
    typer.Option(
        help="Processes; all cores if not given, and there is work for them. The file does not "
        "depend on it.",
        rich_help_panel=WHERE,
    ),
]


def generate(
    *,
    task: TaskArgument,
    output: OutputOption = None,
    trajectories: TrajectoriesOption = 50,
    frames: FramesOption = 10,
    seed: SeedOption = 0,
    parameter: ParameterOption = None,
    overwrite: OverwriteOption = False,
    picture: PictureOption = None,
    processes: ProcessesOption = None,
    scheduler: SchedulerOption = None,
    timeout: TimeoutOption = None,
) -> None:
    """Generate random trajectories of a task, with their labels. Stop it with Ctrl-C: the same
    command goes on from there.

    Example: `energymargin generate push -o push.h5 --trajectories 50 -p friction=0.3`
    """
    from energymargin import tasks as registry

    if picture is not None and find_spec("matplotlib") is None:  # before there is work to lose
        raise ImportError("--picture draws with matplotlib: pip install 'energymargin[plots]'")
    require_one(processes=processes, scheduler=scheduler)
    output = output or Path(f"{task}.h5")
    made = registry.make(task, **parsed(parameter or []))
    require_free(output, overwrite=overwrite)
    if picture is not None:
        require_free(picture, overwrite=overwrite, option="--picture")
    count = _generate(
        made,
        output,
        trajectories=trajectories,
        frames=frames,
        seed=seed,
        processes=processes,
        scheduler=scheduler,
        timeout=timeout,
    )
    _finish(output, picture, seed)
    if count < trajectories:
        say(
            f"[yellow]the time was over[/] before there were {trajectories} trajectories; "
            "with --overwrite the same command goes on from there."
        )
        raise typer.Exit(TIMED_OUT)


def _finish(output: Path, picture: Path | None, seed: int) -> None:
    """Draws the picture, if there is to be one, and says what was written."""
    from energymargin import datasets

    written = escape(str(output))
    with datasets.open(output) as dataset:
        if picture is not None:
            from energymargin.plots.datasets import figure_trees

            figure_trees(dataset, PICTURE_NODES, seed).savefig(picture)
        say(f"Wrote {_counts(dataset)} to {written}. Next: [bold]energymargin score {written}[/]")


def _generate(task: Any, output: Path, *, scheduler: str | None, **options: Any) -> int:
    """Makes the file; returns how many trajectories it has. If it is stopped, prints how many
    trajectories the parts beside the file have."""
    from energymargin import datasets
    from energymargin.cli.progress import progress_bar
    from energymargin.datasets.generation import trajectories_kept

    options["executor"] = None if scheduler is None else cluster(scheduler)
    try:
        with (
            progress_bar(err, f"Generating {task.name}", "trajectories") as progress,
            datasets.generate(task, path=output, progress=progress, **options) as made,
        ):
            return len(made.trajectories)
    except (KeyboardInterrupt, OSError, RuntimeError):
        count = trajectories_kept(output)
        if count:
            stored = f"{count} of {options['trajectories']} trajectories are kept"
            say(f"{stored} beside {escape(str(output))}; the same command goes on from there.")
        raise


def _counts(dataset: Dataset) -> str:
    trajectories = (
        f"{len(dataset.trajectories)} trajectories ({dataset.successes.sum()} successful)"
    )
    return f"{trajectories}, {dataset.size} states"
