"""The commands: energymargin tasks | generate | score | evaluate | demo | reproduce.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from typer.core import TyperGroup

if TYPE_CHECKING:
    from energymargin.datasets import Dataset
    from energymargin.store import ScoreStore

__all__ = ["main"]

# Exit codes, as shells know them.
BAD_INPUT = 2
TIMED_OUT = 124
INTERRUPTED = 130

DEMO_TASK = "push"
DEMO_FRAMES = 10
PICTURE_NODES = 100  # of the trees in the pictures of the tasks; the paper's
DEMO_SUFFIXES = {".h5", ".db", ".md", ".csv", ".png"}

out = Console()
err = Console(stderr=True)


class _Commands(TyperGroup):
    """Says what went wrong in one line, without a traceback, and stops on Ctrl-C without one."""

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            _say("[yellow]stopped[/]")
            raise typer.Exit(INTERRUPTED) from None
        except typer.Exit:  # a RuntimeError, but none of ours: --help ends so
            raise
        except (
            ValueError,
            OSError,
            ImportError,
            MemoryError,
            RuntimeError,
            sqlite3.Error,
        ) as error:
            _say(f"[red]error:[/] {escape(_one_line(error))}")
            raise typer.Exit(BAD_INPUT) from None


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="""How robust is a manipulation, right now? Scores of robustness from energy margins.

    From nothing to a table and pictures: `energymargin demo`. Or step by step:

    1. `energymargin generate push -o push.h5`
    2. `energymargin score push.h5 -o push-scores.db`
    3. `energymargin evaluate push-scores.db`

    The paper's tables again: `energymargin reproduce --help`.
    """,
)
experiments = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="""The paper's tables and figures, made again, and what its definitions say on paper.

    Example: `energymargin reproduce table1 --quick`
    """,
)
app.add_typer(experiments, name="reproduce")

Seed = Annotated[int, typer.Option(help="The same seed gives the same numbers, to the last bit.")]
Nodes = Annotated[
    int, typer.Option(help="Nodes of each search tree: more take longer and say more.")
]
Threads = Annotated[
    int | None, typer.Option(help="Threads; all cores if not given. Scores do not depend on it.")
]


Timeout = Annotated[
    float | None, typer.Option(help="Seconds after which it ends with what is done; exit code 124.")
]


@app.command()
def tasks() -> None:
    """The tasks that there are, with their parameters.

    Example: `energymargin tasks`
    """
    from rich.table import Table
    from rich.text import Text

    from energymargin import tasks as registry

    table = Table(box=None, padding=(0, 2, 0, 0))
    for title in ("task", "what it is", "parameters"):
        table.add_column(title, overflow="fold")
    for entry in registry.overview():
        note = Text(entry.note, "red" if entry.broken else "dim")
        what = Text("\n").join(text for text in (Text(entry.summary), note) if text)
        table.add_row(entry.name, what, escape(_parameters_text(entry.parameters)))
    out.print(table)


@app.command()
def generate(
    *,
    task: Annotated[str, typer.Argument(help="Name of a task, see `energymargin tasks`.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The dataset; TASK.h5 if not given.")
    ] = None,
    trajectories: Annotated[int, typer.Option(help="How many trajectories.")] = 50,
    frames: Annotated[int, typer.Option(help="How many frames of each are recorded.")] = 10,
    seed: Seed = 0,
    parameter: Annotated[
        list[str] | None,
        typer.Option("--parameter", "-p", help="A parameter of the task: NAME=VALUE."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the file if it exists.")
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(help="Draw a failed and a successful trajectory with their search trees."),
    ] = None,
    timeout: Timeout = None,
) -> None:
    """Generate random trajectories of a task, with their labels.

    Example: `energymargin generate push -o push.h5 --trajectories 50 -p friction=0.3`
    """
    from energymargin import tasks as registry

    if picture is not None and find_spec("matplotlib") is None:  # said now, not at the end
        raise ImportError("--picture draws with matplotlib: pip install energymargin[plots]")
    output = output or Path(f"{task}.h5")
    made = registry.make(task, **_parsed(parameter or []))
    if output.exists() and not overwrite:
        raise ValueError(f"{output} exists: choose another -o, or give --overwrite")
    dataset = _generate(
        made, output, trajectories=trajectories, frames=frames, seed=seed, timeout=timeout
    )
    if picture is not None:
        from energymargin.experiments import pictures

        pictures.figure_trees(dataset, PICTURE_NODES, seed).savefig(picture)
    written = escape(str(output))
    _say(f"Wrote {_counts(dataset)} to {written}. Next: [bold]energymargin score {written}[/]")
    if len(dataset.trajectories) < trajectories:
        _say(f"[yellow]the time was over[/] before there were {trajectories} trajectories")
        raise typer.Exit(TIMED_OUT)


@app.command()
def score(
    *,
    data: Annotated[Path, typer.Argument(help="A dataset, from `energymargin generate`.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The scores; DATA-scores.db if not given.")
    ] = None,
    metrics: Annotated[
        str | None,
        typer.Option(help="Which scores, with commas between; all that there are if not given."),
    ] = None,
    nodes: Nodes = 1000,
    seed: Seed = 0,
    threads: Threads = None,
    timeout: Timeout = None,
) -> None:
    """Score every state of a dataset. Stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin score push.h5 -o push-scores.db --nodes 100`
    """
    from energymargin import datasets

    dataset = datasets.load(data)
    output = output or data.with_name(f"{data.stem}-scores.db")
    chosen = None if metrics is None else _split(metrics)
    with _score(
        dataset,
        output,
        metrics=chosen,
        nodes=nodes,
        seed=seed,
        threads=threads,
        timeout=timeout,
    ) as store:
        scored, total = store.counts()
        written = escape(str(output))
        if scored < total:
            _say(f"[yellow]the time was over:[/] {_kept(scored, total, output)}")
            raise typer.Exit(TIMED_OUT)
        _say(
            f"{scored} states are scored in {written}, {1e3 * store.seconds():.0f} ms a state. "
            f"Next: [bold]energymargin evaluate {written}[/]"
        )


@app.command()
def evaluate(
    scores: Annotated[Path, typer.Argument(help="A file of scores, from `energymargin score`.")],
    markdown: Annotated[
        Path | None, typer.Option(help="Write the table to this file as well.")
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(help="Write every number to this file as well.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the bootstrap intervals.")] = 0,
) -> None:
    """Compare scores with what happened: AUC and AP by horizon, beside the paper's if it has them.

    Example: `energymargin evaluate push-scores.db --markdown table.md`
    """
    from energymargin.store import ScoreStore

    with ScoreStore(scores) as store:
        _evaluate(store, markdown, csv, seed)


@app.command()
def demo(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for all files.")] = Path(
        "out"
    ),
    trajectories: Annotated[int, typer.Option(help="How many trajectories.")] = 50,
    nodes: Nodes = 100,
    seed: Seed = 0,
    threads: Threads = None,
) -> None:
    """The whole way on planar pushing: scores, table, pictures. Stopped, it goes on from there.

    Example: `energymargin demo -o out`
    """
    if find_spec("matplotlib") is None:  # said now, not after the scores
        raise ImportError("the demo draws pictures: pip install energymargin[plots]")
    output.mkdir(parents=True, exist_ok=True)
    dataset = _demo_dataset(output / f"{DEMO_TASK}.h5", trajectories, seed)
    database = output / f"{DEMO_TASK}-scores.db"
    with _score(dataset, database, nodes=nodes, seed=seed, threads=threads) as store:
        _evaluate(store, output / "table.md", output / "table.csv", seed)
        labelled = store.labelled_scores()
    from energymargin.experiments import pictures  # slow to load, which Ctrl-C would wait for

    pictures.figure_trees(dataset, nodes, seed).savefig(output / "qualitative.png")
    pictures.figure_along(dataset, labelled).savefig(output / "scores.png")
    written = sorted(path.name for path in output.iterdir() if path.suffix in DEMO_SUFFIXES)
    _say(f"In {escape(str(output))}/: {', '.join(written)}")


@experiments.command()
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
            "--out", help="Folder for all files.", show_default="out/table1, or out/table1-quick"
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

    from energymargin.experiments import table1 as experiment
    from energymargin.progress import share_bar

    chosen: dict[str, Any] = {
        "tasks": experiment.paper_tasks() if tasks is None else _split(tasks),
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
    output = output or Path("out/table1-quick" if quick else "out/table1")
    output.mkdir(parents=True, exist_ok=True)
    command = settings.command(output)
    try:
        with share_bar(err) as progress:
            table = experiment.reproduce(settings, output, threads=threads, progress=progress)
    except KeyboardInterrupt:
        kept = f"All that was finished is kept in {escape(str(output))}; go on with:"
        _say(f"{kept} [bold]{escape(command)}[/]")
        raise
    out.print(table.render())
    (output / "table1.md").write_text(table.to_markdown())
    (output / "table1.csv").write_text(table.to_csv())
    drawn = _draw_tasks(settings.tasks, output, seed)
    files = f"table1.md, table1.csv, trajectories (.h5), scores (.db), {drawn}"
    _say(f"In {escape(str(output))}/: {files}")


@experiments.command()
def bowl(
    *,
    samples: Annotated[int, typer.Option(help="Poses of the ball that each search draws.")] = 2000,
    seeds: Annotated[int, typer.Option(help="How many searches with each planner.")] = 10,
    output: Annotated[Path, typer.Option("--out", help="Folder for all files.")] = Path("out/bowl"),
) -> None:
    """The escape energy of a ball in a bowl (Definition 2), beside its closed form.

    The bowl is a mesh that is taken apart into convex parts. The folder gets bowl.md, bowl.csv,
    bowl.png, the mesh and the problem file. It takes half a minute.

    Example: `energymargin reproduce bowl --seeds 3`
    """
    from energymargin.experiments import bowl as experiment
    from energymargin.progress import progress_bar
    from energymargin.tasks.base import whole_number

    whole_number("samples", samples, 1)
    whole_number("seeds", seeds, 1)
    output.mkdir(parents=True, exist_ok=True)
    with progress_bar(err, "Searching ways out of the bowl", "searches") as progress:
        result = experiment.reproduce(output, samples, seeds, progress=progress)
    out.print(result.to_markdown(), highlight=False)
    drawn = "and no picture: it needs pip install energymargin[plots]"
    if find_spec("matplotlib") is not None:
        from energymargin.experiments.bowl_picture import figure_bowl

        figure_bowl(result).savefig(output / "bowl.png")
        drawn = "bowl.png"
    _say(f"In {escape(str(output))}/: bowl.md, bowl.csv, bowl.obj, problem.json, {drawn}")


@experiments.command()
def closed_forms(
    *,
    problems: Annotated[
        str | None, typer.Option(help="Which, with ; between them; all if not given.")
    ] = None,
    nodes: Annotated[int, typer.Option(help="Nodes of each search.")] = 5000,
    seeds: Annotated[int, typer.Option(help="Searches of each planner.")] = 20,
    gain_seeds: Annotated[
        int, typer.Option(help="Of each planner without one or all of our changes.")
    ] = 8,
    threads: Threads = None,
    output: Annotated[Path, typer.Option("--out", help="Folder for all files.")] = Path(
        "out/closed-forms"
    ),
) -> None:
    """The effort of escape against answers known on paper, by nodes; what each change gains.

    The folder gets closed_forms.md, closed_forms.png and runs.jsonl, one line a search. It takes a
    quarter of an hour on two cores. Stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce closed-forms --problems "push;edge" --seeds 5`
    """
    from energymargin.experiments import closed_forms as experiment
    from energymargin.progress import progress_bar
    from energymargin.tasks.base import whole_number

    for name, value in (("nodes", nodes), ("seeds", seeds), ("gain-seeds", gain_seeds)):
        whole_number(name, value, 1)
    output.mkdir(parents=True, exist_ok=True)
    try:
        with progress_bar(err, "Searching ways out", "searches") as progress:
            result = experiment.reproduce(
                output,
                problems=None if problems is None else _split(problems, ";"),
                nodes=nodes,
                seeds=seeds,
                gain_seeds=gain_seeds,
                threads=threads,
                progress=progress,
            )
    except KeyboardInterrupt:
        _say(f"What was searched is kept in {escape(str(output))}; the same command goes on.")
        raise
    out.print(result.to_markdown(), highlight=False)
    (output / "closed_forms.md").write_text(result.to_markdown())
    drawn = "and no picture: it needs pip install energymargin[plots]"
    if find_spec("matplotlib") is not None:
        from energymargin.experiments.closed_forms_picture import figure_closed_forms

        figure_closed_forms(result).savefig(output / "closed_forms.png")
        drawn = "closed_forms.png"
    _say(f"In {escape(str(output))}/: closed_forms.md, runs.jsonl, {drawn}")


@experiments.command()
def audit(
    *,
    rollouts: Annotated[
        int | None, typer.Option(help="Of each task, with each setting.", show_default="100")
    ] = None,
    tasks: Annotated[
        str | None, typer.Option(help="Which tasks, with commas between; all if not given.")
    ] = None,
    seed: Seed = 0,
    output: Annotated[Path, typer.Option("--out", help="Folder for all files.")] = Path(
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
    from energymargin.experiments import audit as experiment
    from energymargin.experiments import audit_causes
    from energymargin.progress import progress_bar

    names = experiment.TASKS if tasks is None else _split(tasks)
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
            _say(f"In {escape(str(output))}/: audit.md, audit.csv")
    out.print(text, highlight=False, soft_wrap=True)


@experiments.command()
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
    output: Annotated[Path, typer.Option("--out", help="Folder for all files.")] = Path(
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
    from energymargin.experiments import uncertainty as experiment
    from energymargin.progress import progress_bar

    settings = experiment.Settings(
        tasks=experiment.ALL if tasks is None else tuple(_split(tasks)),
        states=states,
        nodes=tuple(_whole("nodes", word) for word in _split(nodes)),
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
        _say(f"{kept}; the same command goes on from there.")
        raise
    out.print(result.to_markdown(), highlight=False, soft_wrap=True)
    _say(f"In {escape(str(output))}/: uncertainty.md, uncertainty.csv, trees/")


def main() -> None:
    """Entry point of the command `energymargin`."""
    app()


def _generate(
    task: Any, output: Path, *, trajectories: int, frames: int, seed: int, timeout: float | None
) -> Dataset:
    from energymargin import datasets
    from energymargin.progress import progress_bar

    with progress_bar(err, f"Generating {task.name}", "trajectories") as progress:
        dataset = datasets.generate(task, trajectories, frames, seed, progress, timeout=timeout)
    dataset.save(output)
    return dataset


def _score(
    dataset: Dataset,
    output: Path,
    *,
    metrics: Sequence[str] | None = None,
    nodes: int,
    seed: int,
    threads: int | None,
    timeout: float | None = None,
) -> ScoreStore:
    """Scores what is missing and opens the file of all scores. Ctrl-C says what was kept."""
    from energymargin.progress import progress_bar
    from energymargin.store import ScoreStore, score_dataset

    try:
        with progress_bar(err, f"Scoring, {nodes} nodes", "states") as progress:
            score_dataset(
                dataset,
                output,
                metrics,
                nodes,
                seed,
                threads=threads,
                progress=progress,
                timeout=timeout,
            )
    except KeyboardInterrupt:
        if output.exists():
            with ScoreStore(output) as store:
                scored, total = store.counts()
            _say(_kept(scored, total, output))
        raise
    return ScoreStore(output)


def _kept(scored: int, total: int, path: Path) -> str:
    kept = f"{scored} of {total} states are scored and kept in {escape(str(path))}"
    return f"{kept}; the same command goes on from there."


def _evaluate(store: ScoreStore, markdown: Path | None, csv: Path | None, seed: int) -> None:
    from energymargin import evaluation

    result = evaluation.evaluate(store.labelled_scores(), seed=seed)
    out.print(result.render())
    if markdown is not None:
        markdown.write_text(result.to_markdown())
    if csv is not None:
        csv.write_text(result.to_csv())


def _demo_dataset(path: Path, trajectories: int, seed: int) -> Dataset:
    """The demo's dataset: the one that is there, if it is the same."""
    from energymargin import datasets
    from energymargin import tasks as registry
    from energymargin.progress import progress_bar

    task = registry.make(DEMO_TASK)
    with progress_bar(err, f"Generating {task.name}", "trajectories") as progress:
        return datasets.load_or_generate(
            path, task, trajectories, DEMO_FRAMES, seed, progress=progress
        )


def _draw_tasks(names: Sequence[str], folder: Path, seed: int) -> str:
    """A picture of each task beside its dataset, and what there is to say of them."""
    if find_spec("matplotlib") is None:
        return "and no pictures: they need pip install energymargin[plots]"
    from energymargin import datasets
    from energymargin.experiments import pictures

    for name in names:
        dataset = datasets.load(folder / f"{name}.h5")
        pictures.figure_trees(dataset, PICTURE_NODES, seed).savefig(folder / f"{name}.png")
    return "a picture of each task (.png)"


def _split(words: str, between: str = ",") -> list[str]:
    return [word.strip() for word in words.split(between)]


def _whole(name: str, word: str) -> int:
    try:
        return int(word)
    except ValueError:
        raise ValueError(f"{name} has {word!r}, expected whole numbers") from None


def _parsed(parameters: list[str]) -> dict[str, Any]:
    """NAME=VALUE, where a value is JSON, or else a word."""
    parsed = {}
    for text in parameters:
        name, equals, value = text.partition("=")
        if not (equals and name.isidentifier()):
            raise ValueError(f"--parameter is {text!r}, expected NAME=VALUE")
        try:
            parsed[name] = json.loads(value)
        except json.JSONDecodeError:
            parsed[name] = value
    return parsed


def _parameters_text(parameters: dict[str, Any]) -> str:
    return ", ".join(f"{name}={json.dumps(value)}" for name, value in parameters.items())


def _counts(dataset: Dataset) -> str:
    succeeded = sum(trajectory.success for trajectory in dataset.trajectories)
    trajectories = f"{len(dataset.trajectories)} trajectories ({succeeded} successful)"
    return f"{trajectories}, {len(dataset.frames())} states"


def _one_line(error: BaseException) -> str:
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split())


def _say(text: str) -> None:
    """A line to whoever sits at the terminal; what a command computes goes to stdout instead."""
    err.print(text, soft_wrap=True, highlight=False)
