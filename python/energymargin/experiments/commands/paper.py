"""What the paper's evaluation shows, made again."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from energymargin.cli.options import PICTURE_NODES, Seed, Threads, real, split, whole
from energymargin.cli.terminal import err, out, say
from energymargin.experiments.commands.shared import (
    Folder,
    Quick,
    app,
    changed,
    folder_of,
    run,
    show,
)

__all__ = ["efficiency", "figure_quality", "perturbation", "table1", "table2"]


@app.command()
def table1(
    *,
    tasks: Annotated[
        str | None, typer.Option(help="Which tasks, with commas between; all if not given.")
    ] = None,
    trajectories: Annotated[
        int | None, typer.Option(help="How many trajectories of each task.", show_default="50")
    ] = None,
    nodes: Annotated[
        int | None, typer.Option(help="Nodes of each search tree.", show_default="1000")
    ] = None,
    continuations: Annotated[
        int | None,
        typer.Option(help="Of each state, for the ceiling.", show_default="100"),
    ] = None,
    seed: Seed = 0,
    threads: Threads = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Folder for all files.",
            show_default="out/table1, or out/table1-quick",
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="A first picture in a few minutes: 20 trajectories, 50 nodes, 20 continuations.",
        ),
    ] = False,
) -> None:
    """How well each score predicts robustness and success, on every task, beside the paper's.

    AUC and AP of the scores of recorded states against what happened afterwards, in both readings
    of the effector. The *ceiling* is what a score could reach at most: it lets the robot's own
    script go on from each state, many times, with fresh noise.

    The folder gets table1.md and table1.csv, the trajectories (TASK.h5), every score (*.db) and a
    picture of each task (TASK.png).
    With 1000 nodes it takes hours; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce table1 --tasks push --nodes 100`
    """
    from dataclasses import replace

    from energymargin.cli.progress import share_bar
    from energymargin.experiments import table1 as experiment

    chosen: dict[str, Any] = {
        "tasks": experiment.paper_tasks() if tasks is None else split(tasks),
        "trajectories": trajectories,
        "nodes": nodes,
        "continuations": continuations,
        "seed": seed,
    }
    settings = replace(
        experiment.QUICK if quick else experiment.FULL,
        **{name: value for name, value in chosen.items() if value is not None},
    )
    experiment.check_tasks(settings.tasks)
    output = folder_of(output, "table1", quick)
    output.mkdir(parents=True, exist_ok=True)
    command = settings.command(output)
    try:
        with share_bar(err) as progress:
            table = experiment.reproduce(settings, output, threads=threads, progress=progress)
    except KeyboardInterrupt:
        kept = f"All that was finished is kept in {escape(str(output))}; go on with:"
        say(f"{kept} [bold]{escape(command)}[/]")
        raise
    out.print(table.render())
    (output / "table1.md").write_text(table.to_markdown())
    (output / "table1.csv").write_text(table.to_csv())
    drawn = _draw_tasks(settings.tasks, output, seed)
    files = f"table1.md, table1.csv, trajectories (.h5), scores (.db), {drawn}"
    say(f"In {escape(str(output))}/: {files}")


@app.command()
def efficiency(
    *,
    trajectories: Annotated[
        int | None, typer.Option(help="How many pushes, of 10 states each.", show_default="50")
    ] = None,
    nodes: Annotated[
        str | None,
        typer.Option(
            help="Sizes of the search trees, with commas between.", show_default="10,30,100,1000"
        ),
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(help="Searches of each state.", show_default="5")
    ] = None,
    threads: Threads = None,
    output: Folder = None,
    quick: Quick = False,
) -> None:
    """How well success is predicted, and how long a state takes, against the nodes of the tree.

    The paper's figure of time efficiency, on planar pushing: AUC and AP of the success score of a
    trajectory's last states, and the computing time of a state, beside the paper's curves.

    The folder gets efficiency.md, efficiency.csv, efficiency.png, the pushes (push.h5) and all
    scores (scores.db). It takes half an hour on one core; stop it with Ctrl-C: the same command
    goes on from there.

    Example: `energymargin reproduce efficiency --nodes 10,100 --seeds 3`
    """
    from energymargin.experiments import efficiency as experiment

    settings = changed(
        experiment.QUICK if quick else experiment.Settings(),
        trajectories=trajectories,
        nodes=nodes and tuple(whole("nodes", word) for word in split(nodes)),
        seeds=seeds,
    )
    output = folder_of(output, "efficiency", quick)
    result = run(
        experiment.reproduce, settings, output, threads, title="Growing trees", unit="nodes"
    )

    def draw() -> Any:
        from energymargin.experiments.efficiency_picture import figure_efficiency

        return figure_efficiency(result)

    show(output, "efficiency", draw, "push.h5", "scores.db")


@app.command()
def perturbation(
    *,
    trajectories: Annotated[
        int | None, typer.Option(help="How many pushes, of 10 states each.", show_default="50")
    ] = None,
    nodes: Annotated[
        int | None, typer.Option(help="Nodes of each search tree.", show_default="100")
    ] = None,
    levels: Annotated[
        str | None,
        typer.Option(
            help="Scaled largest errors, from 0 to 1, with commas between.",
            show_default="0,0.1,0.2,0.5,1",
        ),
    ] = None,
    draws: Annotated[
        int | None, typer.Option(help="Of the errors, at each level.", show_default="5")
    ] = None,
    threads: Threads = None,
    output: Folder = None,
    quick: Quick = False,
) -> None:
    """How well capture is predicted from a wrong friction, velocity or position; or wrong forces.

    The paper's figure of robustness against errors of the model, on planar pushing: AP of the
    capture score, and of the force score, whose inputs have errors of growing size, beside the
    paper's curves.

    The folder gets perturbation.md, perturbation.csv, perturbation.png, the pushes (push.h5) and
    all scores (scores.db). It takes half an hour on one core; stop it with Ctrl-C: the same command
    goes on from there.

    Example: `energymargin reproduce perturbation --levels 0,0.5,1 --draws 3`
    """
    from energymargin.experiments import perturbation as experiment

    settings = changed(
        experiment.QUICK if quick else experiment.Settings(),
        trajectories=trajectories,
        nodes=nodes,
        levels=levels and tuple(real("levels", word) for word in split(levels)),
        draws=draws,
    )
    output = folder_of(output, "perturbation", quick)
    result = run(
        experiment.reproduce, settings, output, threads, title="Scoring with errors", unit="states"
    )

    def draw() -> Any:
        from energymargin.experiments.perturbation_picture import figure_perturbation

        return figure_perturbation(result)

    show(output, "perturbation", draw, "push.h5", "scores.db")


@app.command()
def figure_quality(
    *,
    trajectories: Annotated[
        int | None,
        typer.Option(help="Of the dataset that the two pushes are of.", show_default="50"),
    ] = None,
    nodes: Annotated[
        int | None, typer.Option(help="Nodes of each search tree.", show_default="100")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of the searches.", show_default="0")] = None,
    threads: Threads = None,
    output: Folder = None,
    quick: Quick = False,
) -> None:
    """Search trees in three frames of a failed and of a successful push, with their scores.

    The paper's qualitative figure: the capture set is light blue, the success set grey, and the
    bodies at three random nodes are half transparent. Under each frame stands (success, capture),
    as the dataset's states get it from as many nodes and the same seed.

    The folder gets figure_quality.md, figure_quality.csv, figure_quality.png and the pushes
    (push.h5). It takes a few seconds.

    Example: `energymargin reproduce figure-quality --nodes 300`
    """
    from energymargin.experiments import figure_quality as experiment

    settings = changed(
        experiment.QUICK if quick else experiment.Settings(),
        trajectories=trajectories,
        nodes=nodes,
        seed=seed,
    )
    output = folder_of(output, "figure-quality", quick)
    result = run(
        experiment.reproduce, settings, output, threads, title="Growing trees", unit="frames"
    )

    def draw() -> Any:
        from energymargin.experiments.figure_quality_picture import figure_quality

        return figure_quality(result)

    show(output, "figure_quality", draw, "push.h5")


@app.command()
def table2(
    *,
    combinations: Annotated[
        str | None,
        typer.Option(
            help="Of object and end-effector, as rectangle-jaw, with commas between.",
            show_default="all ten",
        ),
    ] = None,
    nodes: Annotated[
        int | None, typer.Option(help="Nodes of each search tree.", show_default="100")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of the searches.", show_default="0")] = None,
    threads: Threads = None,
    output: Folder = None,
    quick: Quick = False,
) -> None:
    """How well capture and success are predicted on recorded pushes of five objects by two tools.

    The recordings are a simulated stand-in for the paper's, which `reproduce published` scores:
    pushes in another physics engine, with an arm's and a camera's errors (data/push_real).

    The folder gets table2.md, table2.csv, table2.png and all scores (scores.db). It takes about an
    hour on one core; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce table2 --combinations rectangle-jaw,convex-round`
    """
    from energymargin.experiments import table2 as experiment

    settings = changed(
        experiment.QUICK if quick else experiment.Settings(),
        combinations=combinations and tuple(split(combinations)),
        nodes=nodes,
        seed=seed,
    )
    output = folder_of(output, "table2", quick)
    result = run(experiment.reproduce, settings, output, threads, title="Scoring", unit="states")

    def draw() -> Any:
        from energymargin.experiments.table2_picture import figure_table2

        return figure_table2(result)

    show(output, "table2", draw, "scores.db")


def _draw_tasks(names: Sequence[str], folder: Path, seed: int) -> str:
    """A picture of each task beside its dataset, and what there is to say of them."""
    if find_spec("matplotlib") is None:
        return "and no pictures: they need pip install 'energymargin[plots]'"
    from energymargin import datasets
    from energymargin.experiments import pictures

    for name in names:
        dataset = datasets.load(folder / f"{name}.h5")
        pictures.figure_trees(dataset, PICTURE_NODES, seed).savefig(folder / f"{name}.png")
    return "a picture of each task (.png)"
