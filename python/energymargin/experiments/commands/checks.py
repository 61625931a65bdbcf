"""What the definitions say on paper, where the energy goes, and what our own changes gain."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from energymargin.cli.options import Seed, Threads, split, whole
from energymargin.cli.terminal import err, out, say
from energymargin.experiments.commands.shared import (
    Folder,
    Quick,
    app,
    changed,
    folder_of,
    picture,
    run,
    show,
)

__all__ = [
    "audit",
    "bowl",
    "closed_forms",
    "enlarged",
    "fewer_steps",
    "foresight",
    "published",
    "uncertainty",
    "walls",
]


@app.command()
def bowl(
    *,
    samples: Annotated[int, typer.Option(help="Poses of the ball that each search draws.")] = 2000,
    seeds: Annotated[int, typer.Option(help="How many searches with each planner.")] = 10,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for all files.")] = Path(
        "out/bowl"
    ),
) -> None:
    """The escape energy of a ball in a bowl (Definition 2), beside its closed form.

    The bowl is a mesh that is taken apart into convex parts. The folder gets bowl.md, bowl.csv,
    bowl.png, the mesh and the problem file. It takes half a minute.

    Example: `energymargin reproduce bowl --seeds 3`
    """
    from energymargin.cli.progress import progress_bar
    from energymargin.experiments import bowl as experiment
    from energymargin.tasks.base import whole_number

    whole_number("samples", samples, 1)
    whole_number("seeds", seeds, 1)
    output.mkdir(parents=True, exist_ok=True)
    with progress_bar(err, "Searching ways out of the bowl", "searches") as progress:
        result = experiment.reproduce(output, samples, seeds, progress=progress)
    out.print(result.to_markdown(), markup=False, highlight=False)

    def draw() -> Any:
        from energymargin.experiments.bowl_picture import figure_bowl

        return figure_bowl(result)

    drawn = picture(output / "bowl.png", draw)
    say(f"In {escape(str(output))}/: bowl.md, bowl.csv, bowl.obj, problem.json, {drawn}")


@app.command()
def closed_forms(
    *,
    problems: Annotated[
        str | None, typer.Option(help="Which, with commas between; all if not given.")
    ] = None,
    nodes: Annotated[int, typer.Option(help="Nodes of each search.")] = 5000,
    seeds: Annotated[int, typer.Option(help="Searches of each planner.")] = 20,
    gain_seeds: Annotated[
        int, typer.Option(help="Of each planner without one or all of our changes.")
    ] = 8,
    threads: Threads = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for all files.")] = Path(
        "out/closed-forms"
    ),
) -> None:
    """The effort of escape against answers known on paper, by nodes; what each change gains.

    The folder gets closed_forms.md, closed_forms.png and runs.jsonl, one line a search. It takes a
    quarter of an hour on two cores. Stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce closed-forms --problems push,edge --seeds 5`
    """
    from energymargin.cli.progress import progress_bar
    from energymargin.experiments import closed_forms as experiment
    from energymargin.tasks.base import whole_number

    for name, value in (("nodes", nodes), ("seeds", seeds), ("gain-seeds", gain_seeds)):
        whole_number(name, value, 1)
    output.mkdir(parents=True, exist_ok=True)
    try:
        with progress_bar(err, "Searching ways out", "searches") as progress:
            result = experiment.reproduce(
                output,
                problems=None if problems is None else split(problems),
                nodes=nodes,
                seeds=seeds,
                gain_seeds=gain_seeds,
                threads=threads,
                progress=progress,
            )
    except KeyboardInterrupt:
        say(f"What was searched is kept in {escape(str(output))}; the same command goes on.")
        raise
    out.print(result.to_markdown(), markup=False, highlight=False)
    (output / "closed_forms.md").write_text(result.to_markdown())

    def draw() -> Any:
        from energymargin.experiments.closed_forms_picture import figure_closed_forms

        return figure_closed_forms(result)

    drawn = picture(output / "closed_forms.png", draw)
    say(f"In {escape(str(output))}/: closed_forms.md, runs.jsonl, {drawn}")


@app.command()
def audit(
    *,
    rollouts: Annotated[
        int | None, typer.Option(help="Of each task, with each setting.", show_default="100")
    ] = None,
    tasks: Annotated[
        str | None, typer.Option(help="Which tasks, with commas between; all if not given.")
    ] = None,
    seed: Seed = 0,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for all files.")] = Path(
        "out/audit"
    ),
    quick: Annotated[
        bool, typer.Option("--quick", help="A first picture in seconds: 10 rollouts.")
    ] = False,
) -> None:
    """Where the energy of rollouts goes, and how much of it the simulation leaves open.

    Random disturbances on random states of each task, with two lengths of the simulation's step and
    two numbers of solver iterations; and small scenes, each with one cause of error. The folder
    gets audit.md and audit.csv. Stopped with Ctrl-C, it writes what is done.

    Example: `energymargin reproduce audit --tasks push,grasp`
    """
    from energymargin.cli.progress import progress_bar
    from energymargin.experiments import audit as experiment
    from energymargin.experiments import audit_causes

    names = experiment.TASKS if tasks is None else split(tasks)
    count = rollouts if rollouts is not None else experiment.QUICK if quick else experiment.ROLLOUTS
    output.mkdir(parents=True, exist_ok=True)
    audits = experiment.Audits()
    try:
        with progress_bar(err, "Auditing", "rollouts") as progress:
            experiment.reproduce(count, names=names, seed=seed, into=audits, progress=progress)
    finally:
        if audits.rows:
            text = f"{audits.to_markdown()}\n{audit_causes.to_markdown(experiment.SETTINGS[:3])}"
            (output / "audit.md").write_text(text)
            (output / "audit.csv").write_text(audits.to_csv())
            say(f"In {escape(str(output))}/: audit.md, audit.csv")
    out.print(text, markup=False, highlight=False, soft_wrap=True)


@app.command()
def uncertainty(
    *,
    tasks: Annotated[
        str | None, typer.Option(help="Which tasks, with commas between; all if not given.")
    ] = None,
    states: Annotated[int, typer.Option(help="How many states of each task.")] = 5,
    nodes: Annotated[
        str, typer.Option(help="Sizes of the trees, with commas between.")
    ] = "100,300",
    trees: Annotated[int, typer.Option(help="How many trees of each state.")] = 200,
    seed: Seed = 0,
    threads: Threads = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for all files.")] = Path(
        "out/uncertainty"
    ),
) -> None:
    """How often the intervals of capture and success scores hold the truth.

    Of each state many trees are grown, whose mean counts as the truth. From them, a few are drawn
    again and again, and each time it is asked whether their 95 % interval holds the mean.

    The folder gets uncertainty.md, uncertainty.csv and the scores of all trees (trees/*.json). It
    takes a quarter of an hour; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce uncertainty --tasks topple --nodes 100`
    """
    from energymargin.cli.progress import progress_bar
    from energymargin.experiments import uncertainty as experiment

    settings = experiment.Settings(
        tasks=experiment.ALL if tasks is None else tuple(split(tasks)),
        states=states,
        nodes=tuple(whole("nodes", word) for word in split(nodes)),
        trees=trees,
        seed=seed,
    )
    settings.check()
    output.mkdir(parents=True, exist_ok=True)
    try:
        with progress_bar(err, "Growing trees", "states") as progress:
            result = experiment.reproduce(settings, output, threads=threads, progress=progress)
    except KeyboardInterrupt:
        kept = f"The states that are done are kept in {escape(str(output))}"
        say(f"{kept}; the same command goes on from there.")
        raise
    out.print(result.to_markdown(), markup=False, highlight=False, soft_wrap=True)
    say(f"In {escape(str(output))}/: uncertainty.md, uncertainty.csv, trees/")


@app.command()
def fewer_steps(
    *,
    tasks: Annotated[
        str | None,
        typer.Option(help="Which tasks, with commas between.", show_default="push,balance,topple"),
    ] = None,
    trajectories: Annotated[
        int | None, typer.Option(help="How many trajectories of each task.", show_default="50")
    ] = None,
    rollouts: Annotated[
        str | None,
        typer.Option(help="Of each search, with commas between.", show_default="10,30,100,300"),
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(help="Searches of each state.", show_default="3")
    ] = None,
    threads: Threads = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Folder for all files.",
            show_default="out/fewer-steps, or out/fewer-steps-quick",
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="A first picture in a minute: 20 trajectories, 10 and 30 rollouts, 2 seeds.",
        ),
    ] = False,
) -> None:
    """What it gains to use more of each rollout: AUC and AP against computing time.

    States on the way of a rollout as nodes; the tree of the frame before; rollouts that end at the
    escape. Each is held against the plain search at as many simulation steps.

    The folder gets fewer_steps.md, fewer_steps.csv, fewer_steps.png, the trajectories (TASK.h5) and
    all scores (scores/*.json). It takes half an hour; stop it with Ctrl-C: the same command goes on
    from there.

    Example: `energymargin reproduce fewer-steps --tasks topple --rollouts 10,30`
    """
    from dataclasses import replace

    from energymargin.cli.progress import progress_bar
    from energymargin.experiments import fewer_steps as experiment

    chosen: dict[str, Any] = {
        "tasks": None if tasks is None else tuple(split(tasks)),
        "trajectories": trajectories,
        "rollouts": rollouts and tuple(whole("rollouts", word) for word in split(rollouts)),
        "seeds": seeds,
    }
    settings = replace(
        experiment.QUICK if quick else experiment.Settings(),
        **{name: value for name, value in chosen.items() if value is not None},
    )
    settings.check()
    output = folder_of(output, "fewer-steps", quick)
    output.mkdir(parents=True, exist_ok=True)
    try:
        with progress_bar(err, "Scoring", "runs") as progress:
            result = experiment.reproduce(settings, output, threads=threads, progress=progress)
    except KeyboardInterrupt:
        say(f"The runs that are done are kept in {escape(str(output))}; the same command goes on.")
        raise
    out.print(result.to_markdown(), markup=False, highlight=False, soft_wrap=True)

    def draw() -> Any:
        from energymargin.experiments.fewer_steps_picture import figure_fewer_steps

        return figure_fewer_steps(result)

    show(output, "fewer_steps", draw, "scores/")


@app.command()
def enlarged(
    *,
    recordings: Annotated[
        int | None, typer.Option(help="Of each combination.", show_default="4")
    ] = None,
    frames: Annotated[
        int | None, typer.Option(help="Of each recording.", show_default="10")
    ] = None,
    output: Folder = None,
    quick: Quick = False,
) -> None:
    """Whether pushes of centimetres and grams are as exact at true scale as in an enlarged scene.

    Rollouts from recorded states of push-real, at true scale and 10 and 16 times as large, beside
    what rounding, half the step and the solver's tolerance change.

    The folder gets enlarged.md and enlarged.csv. It takes a quarter of a minute.

    Example: `energymargin reproduce enlarged --frames 20`
    """
    from energymargin.experiments import enlarged as experiment

    settings = changed(
        experiment.QUICK if quick else experiment.Settings(), recordings=recordings, frames=frames
    )
    output = folder_of(output, "enlarged", quick)
    run(experiment.reproduce, settings, output, None, title="Simulating", unit="combinations")
    show(output, "enlarged", None)


@app.command()
def walls(
    *,
    cages: Annotated[
        int | None, typer.Option(help="Closed cages, each with two searches.", show_default="1000")
    ] = None,
    shots: Annotated[
        int | None, typer.Option(help="Projectiles at walls.", show_default="10000")
    ] = None,
    nodes: Annotated[int | None, typer.Option(help="Of each search.", show_default="400")] = None,
    seed: Annotated[
        int | None,
        typer.Option(help="Of the first cage and the first shot.", show_default="0"),
    ] = None,
    threads: Threads = None,
    output: Folder = None,
    quick: Quick = False,
) -> None:
    """Whether anything gets through a wall: searches in closed cages, and shots at walls.

    Cages of boxes, compounds, hulls and meshes, searched with AO-EST and AO-RRT: every effort is to
    be infinite. Projectiles at 1 to 20 m/s at walls of 1 to 10 mm, at walls that move, and struck
    by a paddle: none is to get beyond a wall's middle.

    The folder gets walls.md, walls.csv and runs.jsonl, one line a search or shot. It takes hours;
    stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce walls --cages 100 --shots 1000`
    """
    from energymargin.experiments import walls as experiment

    settings = changed(
        experiment.QUICK if quick else experiment.Settings(),
        cages=cages,
        shots=shots,
        nodes=nodes,
        seed=seed,
    )
    output = folder_of(output, "walls", quick)
    title, unit = "Searching and shooting", "searches and shots"
    run(experiment.reproduce, settings, output, threads, title=title, unit=unit)
    show(output, "walls", None, "runs.jsonl")


@app.command()
def foresight(
    *,
    tasks: Annotated[
        str | None, typer.Option(help="Which tasks, with commas between; all but push-real.")
    ] = None,
    trajectories: Annotated[
        int | None, typer.Option(help="Of each task.", show_default="50")
    ] = None,
    nodes: Annotated[
        int | None, typer.Option(help="Of the published scores' trees.", show_default="100")
    ] = None,
    rollouts: Annotated[
        int | None, typer.Option(help="Of each probability.", show_default="30")
    ] = None,
    fresh: Annotated[
        int | None,
        typer.Option(
            help="Others, which the probabilities are held against; 0: none.", show_default="100"
        ),
    ] = None,
    continuations: Annotated[
        int | None, typer.Option(help="Of each state for the ceiling.", show_default="100")
    ] = None,
    strength: Annotated[
        float | None,
        typer.Option(help="Of the disturbance, as a share of the bounds.", show_default="0.6"),
    ] = None,
    objects: Annotated[
        int | None,
        typer.Option(
            help="How many objects are disturbed at a time, at most those there are.",
            show_default="2",
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of all that is random.", show_default="0")] = (
        None
    ),
    threads: Threads = None,
    output: Folder = None,
    quick: Quick = False,
) -> None:
    """Will it hold for the next frames? What each score of a state foresees, on every task.

    The scores of the paper, the probability to stay captured with and without the robot's plan, the
    plan alone, a learned classifier and the ceiling, on states that are captured now; and whether
    the probabilities mean what they say.

    The folder gets foresight.md, foresight.csv, reliability.csv, foresight.png, runs.jsonl, the
    trajectories and the stores of scores. It takes an hour or two on two cores; stop it with
    Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce foresight --tasks push,balance`
    """
    from energymargin.experiments import foresight as experiment

    settings = changed(
        experiment.QUICK if quick else experiment.Settings(),
        tasks=None if tasks is None else tuple(split(tasks)),
        trajectories=trajectories,
        nodes=nodes,
        rollouts=rollouts,
        fresh=fresh,
        continuations=continuations,
        strength=strength,
        objects=objects,
        seed=seed,
    )
    output = folder_of(output, "foresight", quick)
    result = run(experiment.reproduce, settings, output, threads, title="Foreseeing", unit="states")

    def draw() -> Any:
        from energymargin.experiments.foresight_picture import figure_foresight

        return figure_foresight(result)

    show(output, "foresight", draw, "reliability.csv", "runs.jsonl")


@app.command()
def published(
    *,
    data: Annotated[
        Path, typer.Option(help="Folder of the authors' data: simulated, recordings, shapes.")
    ],
    parts: Annotated[
        str | None,
        typer.Option(help="Which, with commas between, as push,jaw-pushes-convex; all."),
    ] = None,
    nodes: Annotated[int | None, typer.Option(help="Of our trees.", show_default="100")] = None,
    rollouts: Annotated[
        int | None, typer.Option(help="Of each probability.", show_default="30")
    ] = None,
    every: Annotated[
        int | None,
        typer.Option(
            help="Frames of a recording from one scored state to the next: 1, 2, 5 or 10.",
            show_default="5",
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of all that is random.", show_default="0")] = (
        None
    ),
    threads: Threads = None,
    output: Folder = None,
    quick: Quick = False,
) -> None:
    """The authors' own data: their scores and ours on the same states, cell by cell.

    The folder gets published.md, published.csv, published.png and runs.jsonl. The half of the data
    takes half an hour on two cores; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce published --data dynamicCageForMPPI-data --parts push,balance`
    """
    from energymargin.experiments import published as experiment
    from energymargin.experiments.published_text import Published, Settings

    settings = changed(
        Settings(nodes=20, rollouts=8, every=10) if quick else Settings(),
        parts=None if parts is None else tuple(split(parts)),
        nodes=nodes,
        rollouts=rollouts,
        every=every,
        seed=seed,
    )
    output = folder_of(output, "published", quick)

    def reproduce(
        chosen: Settings, folder: Path, *, threads: int | None, progress: Any
    ) -> Published:
        return experiment.reproduce(chosen, data, folder, threads=threads, progress=progress)

    result = run(reproduce, settings, output, threads, title="Scoring", unit="states")

    def draw() -> Any:
        from energymargin.experiments.published_picture import figure_published

        return figure_published(result)

    show(output, "published", draw, "runs.jsonl")
