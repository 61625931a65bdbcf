"""The command `energymargin generate`."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter
from rich.markup import escape

import energymargin as em
from energymargin.base.bars import bar
from energymargin.base.replacing import replace_figure
from energymargin.cli import options
from energymargin.cli.terminal import PICTURES, TIMED_OUT, require_free, say


def generate(
    task: str,
    /,
    *,
    output: options.Output = None,
    trajectories: int = 50,
    frames: int = 10,
    seed: int = 0,
    parameter: options.Parameters = None,
    engine: str = "native",
    overwrite: bool = False,
    picture: Path | None = None,
    processes: Annotated[int | None, Parameter(group=options.WHERE)] = None,
    where: options.Elsewhere = options.Elsewhere(),
) -> None:
    """Generate random trajectories of a task, with their labels. Stop it with Ctrl-C: the same
    command goes on from there.

    Example: `energymargin generate push -o push.h5 --trajectories 50 -p friction=0.3`

    Args:
        task: Name of a task, see `energymargin tasks`.
        output: The dataset; TASK.h5 if not given.
        trajectories: How many trajectories.
        frames: How many frames of each are recorded.
        seed: The same seed gives the same numbers, to the last bit.
        parameter: A parameter of the task: NAME=VALUE; may be repeated.
        engine: What steps the simulation, native or bullet.
        overwrite: Replace the file if it exists.
        picture: Draw a failed and a successful trajectory with their search trees.
        processes: Processes; all cores if not given, and there is work for them. The file does not
            depend on it.
    """
    if picture is not None and find_spec("matplotlib") is None:  # before there is work to lose
        raise ImportError("--picture draws with matplotlib: pip install 'energymargin[plots]'")
    options.require_one(processes=processes, scheduler=where.scheduler)
    output = output or Path(f"{task}.h5")
    given = options.parsed(parameter)
    if "engine" in given:
        raise ValueError(f"engine is no parameter: expected --engine {given['engine']}")
    made = em.tasks.make(task, engine=engine, **given)
    require_free(output, overwrite=overwrite)
    if picture is not None:
        require_free(picture, overwrite=overwrite, option="--picture", suffixes=PICTURES)
    try:
        with bar(f"Generating {made.name}", "trajectories") as progress:
            asked: Any = {"trajectories": trajectories, "frames": frames, "seed": seed}
            asked |= {"processes": processes, "executor": where.cluster()}
            asked |= {"timeout": where.timeout, "progress": progress}
            dataset = em.datasets.generate(made, path=output, **asked)
    except (KeyboardInterrupt, OSError, RuntimeError):
        if count := em.datasets.trajectories_kept(output):
            kept = f"{count} of {trajectories} trajectories are kept beside {escape(str(output))}"
            say(f"{kept}; the same command goes on from there.")
        raise
    with dataset:
        if picture is not None:
            replace_figure(picture, em.plots.figure_trees(dataset, options.PICTURE_NODES, seed))
        say_written(dataset, output)
        if len(dataset.trajectories) < trajectories:
            text = f"[yellow]the time was over[/] before there were {trajectories} trajectories"
            say(f"{text}; with --overwrite the same command goes on from there.")
            raise SystemExit(TIMED_OUT)


def say_written(dataset: em.datasets.Dataset, path: Path, judged: str = "") -> None:
    """Prints what a dataset's file has, and the command that comes next."""
    counts = f"{len(dataset.trajectories)} trajectories ({dataset.successes.sum()} successful"
    text = f"Wrote {counts}{judged}), {dataset.size} states to {escape(str(path))}. Next"
    say(f"{text}: [bold]energymargin score {escape(str(path))}[/]")
