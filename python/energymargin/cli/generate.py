"""The command `energymargin generate`."""

from __future__ import annotations

from contextlib import nullcontext
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from energymargin.cli.options import (
    PICTURE_NODES,
    Parameters,
    Scheduler,
    Seed,
    Timeout,
    cluster,
    parsed,
    require_one,
)
from energymargin.cli.terminal import TIMED_OUT, err, say

if TYPE_CHECKING:
    from energymargin.datasets import Dataset

__all__ = ["generate"]


def generate(
    *,
    task: Annotated[str, typer.Argument(help="Name of a task, see `energymargin tasks`.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The dataset; TASK.h5 if not given.")
    ] = None,
    trajectories: Annotated[int, typer.Option(help="How many trajectories.")] = 50,
    frames: Annotated[int, typer.Option(help="How many frames of each are recorded.")] = 10,
    seed: Seed = 0,
    parameter: Parameters = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the file if it exists.")
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(help="Draw a failed and a successful trajectory with their search trees."),
    ] = None,
    processes: Annotated[
        int | None,
        typer.Option(
            help="Processes; all cores if not given, and there is work for them. The file does "
            "not depend on it."
        ),
    ] = None,
    scheduler: Scheduler = None,
    timeout: Timeout = None,
) -> None:
    """Generate random trajectories of a task, with their labels. Stop it with Ctrl-C: the same
    command goes on from there.

    Example: `energymargin generate push -o push.h5 --trajectories 50 -p friction=0.3`
    """
    from energymargin import datasets
    from energymargin import tasks as registry

    if picture is not None and find_spec("matplotlib") is None:  # said now, not at the end
        raise ImportError("--picture draws with matplotlib: pip install 'energymargin[plots]'")
    require_one(processes=processes, scheduler=scheduler)
    output = output or Path(f"{task}.h5")
    made = registry.make(task, **parsed(parameter or []))
    if output.exists() and not overwrite:
        raise ValueError(f"{output} exists: choose another -o, or give --overwrite")
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
    written = escape(str(output))
    with datasets.open(output) as dataset:
        if picture is not None:
            from energymargin.plots.datasets import figure_trees

            figure_trees(dataset, PICTURE_NODES, seed).savefig(picture)
        say(f"Wrote {_counts(dataset)} to {written}. Next: [bold]energymargin score {written}[/]")
    if count < trajectories:
        say(
            f"[yellow]the time was over[/] before there were {trajectories} trajectories; "
            "with --overwrite the same command goes on from there."
        )
        raise typer.Exit(TIMED_OUT)


def _generate(task: Any, output: Path, *, scheduler: str | None, **options: Any) -> int:
    """Makes the file; returns how many trajectories it has. What ends it says what was kept."""
    from energymargin import datasets
    from energymargin.cli.progress import progress_bar
    from energymargin.datasets.generation_to_file import trajectories_kept

    try:
        with (
            nullcontext() if scheduler is None else cluster(scheduler).pool() as pool,
            progress_bar(err, f"Generating {task.name}", "trajectories") as progress,
            datasets.generate(task, path=output, pool=pool, progress=progress, **options) as made,
        ):
            return len(made.trajectories)
    except (KeyboardInterrupt, OSError, RuntimeError):
        kept = trajectories_kept(output)
        if kept:
            shares = f"{kept} of {options['trajectories']} trajectories are kept"
            say(f"{shares} beside {escape(str(output))}; the same command goes on from there.")
        raise


def _counts(dataset: Dataset) -> str:
    trajectories = (
        f"{len(dataset.trajectories)} trajectories ({dataset.successes.sum()} successful)"
    )
    return f"{trajectories}, {dataset.size} states"
