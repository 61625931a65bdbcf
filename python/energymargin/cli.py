"""The commands: energymargin tasks | generate | import | score | evaluate | export | report |
view | demo | reproduce.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from typer.core import TyperGroup

from energymargin.experiments.commands import app as reproduce
from energymargin.import_command import import_recordings
from energymargin.report_command import report
from energymargin.terminal import (
    PICTURE_NODES,
    Nodes,
    Seed,
    Threads,
    Timeout,
    err,
    out,
    parsed,
    say,
    split,
)
from energymargin.view_command import view_command

if TYPE_CHECKING:
    from energymargin.datasets import Dataset
    from energymargin.evaluation import LabelledScores
    from energymargin.executors import Dask, Executor
    from energymargin.settings import SearchSettings
    from energymargin.store import Run

__all__ = ["main"]

RunNumber = Annotated[
    int | None,
    typer.Option(
        "--run", help="Which run, if there are several; `energymargin export` lists them."
    ),
]

Scheduler = Annotated[
    str | None,
    typer.Option(help="The workers of a Dask cluster instead: its scheduler, tcp://HOST:PORT."),
]

# Exit codes, as shells know them.
BAD_INPUT = 2
TIMED_OUT = 124
INTERRUPTED = 130

DEMO_TASK = "push"
DEMO_FRAMES = 10
DEMO_SUFFIXES = {".h5", ".db", ".md", ".csv", ".png"}


class _Commands(TyperGroup):
    """Says what went wrong in one line, without a traceback, and stops on Ctrl-C without one."""

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            say("[yellow]stopped[/]")
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
            say(f"[red]error:[/] {escape(_one_line(error))}")
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
    4. `energymargin report push-scores.db -o report.html`
    5. `energymargin view push.h5 --scores push-scores.db`

    The paper's tables again: `energymargin reproduce --help`.
    """,
)
app.add_typer(reproduce, name="reproduce")
app.command("import")(import_recordings)
app.command()(report)
app.command("view")(view_command)


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
        raise ImportError("--picture draws with matplotlib: pip install energymargin[plots]")
    _require_one(processes=processes, scheduler=scheduler)
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
            from energymargin.experiments import pictures

            pictures.figure_trees(dataset, PICTURE_NODES, seed).savefig(picture)
        say(f"Wrote {_counts(dataset)} to {written}. Next: [bold]energymargin score {written}[/]")
    if count < trajectories:
        say(
            f"[yellow]the time was over[/] before there were {trajectories} trajectories; "
            "with --overwrite the same command goes on from there."
        )
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
    nodes_per_edge: Annotated[
        int,
        typer.Option(
            help="Of capture and success: up to so many states of a rollout are nodes, and there "
            "are so many fewer rollouts."
        ),
    ] = 1,
    least_likelihood: Annotated[
        float,
        typer.Option(
            help="Of capture and success: a rollout ends where its likelihood falls to that share "
            "of the start's."
        ),
    ] = 0.0,
    stop_at_escape: Annotated[
        bool,
        typer.Option(
            "--stop-at-escape",
            help="Of the efforts: a rollout ends where it is seen outside of the capture set.",
        ),
    ] = False,
    seed: Seed = 0,
    threads: Threads = None,
    processes: Annotated[
        int | None,
        typer.Option(help="So many processes instead of threads: a crash costs little."),
    ] = None,
    scheduler: Scheduler = None,
    timeout: Timeout = None,
) -> None:
    """Score every state of a dataset that is not scored yet. Stopped in any way, the same command
    goes on from there; started twice at once, the two share the work.

    Example: `energymargin score push.h5 -o push-scores.db --nodes 100`

    On a cluster: `energymargin score push.h5 --scheduler tcp://10.0.0.1:8786`
    """
    from energymargin import datasets
    from energymargin.settings import SearchSettings

    settings = SearchSettings(nodes, seed, nodes_per_edge, least_likelihood, stop_at_escape)
    executor = _executor(threads, processes, scheduler)
    output = output or data.with_name(f"{data.stem}-scores.db")
    chosen = None if metrics is None else split(metrics)
    with (
        datasets.open(data) as dataset,
        _score(
            dataset, output, settings, metrics=chosen, executor=executor, timeout=timeout
        ) as run,
    ):
        scored, states = run.counts()
        if scored < states:
            say(f"[yellow]the time was over:[/] {_kept(run)}")
            raise typer.Exit(TIMED_OUT)
        written = escape(str(output))
        which = f" --run {run.number}" if len(run.store.runs()) > 1 else ""
        say(
            f"{scored} states are scored in {written}, {1e3 * run.seconds():.3g} ms a state. "
            f"Next: [bold]energymargin evaluate {written}{which}[/]"
        )


@app.command()
def evaluate(
    scores: Annotated[Path, typer.Argument(help="A file of scores, from `energymargin score`.")],
    *,
    markdown: Annotated[
        Path | None, typer.Option(help="Write the table to this file as well.")
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(help="Write every number to this file as well.")
    ] = None,
    run: RunNumber = None,
    last: Annotated[
        int, typer.Option(help="Frames of a trajectory whose success scores count: k-bar.")
    ] = 5,
    seed: Annotated[int, typer.Option(help="Of the bootstrap intervals.")] = 0,
) -> None:
    """Compare scores with what happened: AUC and AP by horizon, beside the paper's if it has them.

    Example: `energymargin evaluate push-scores.db --markdown table.md`
    """
    from energymargin.store import ScoreStore
    from energymargin.tasks.base import whole_number

    whole_number("last", last, 1)
    with ScoreStore(scores) as store:
        _evaluate(store.run(run).labelled_scores(), markdown, csv, seed, last)


@app.command()
def export(
    scores: Annotated[Path, typer.Argument(help="A file of scores, from `energymargin score`.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="A .csv or .parquet file; without it, what there is."),
    ] = None,
    run: RunNumber = None,
) -> None:
    """Write scores and labels as a table, a row a state; or list the runs of a file of scores.

    Example: `energymargin export push-scores.db -o push-scores.csv`
    """
    from energymargin import store

    if output is None:
        with store.ScoreStore(scores) as opened:
            for one in opened.runs():
                out.print(str(one), soft_wrap=True, highlight=False)
        return
    rows = store.export(scores, output, run)
    say(f"Wrote {rows} states to {escape(str(output))}")


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
    from energymargin.executors import Threads
    from energymargin.settings import SearchSettings

    if find_spec("matplotlib") is None:  # said now, not after the scores
        raise ImportError("the demo draws pictures: pip install energymargin[plots]")
    output.mkdir(parents=True, exist_ok=True)
    dataset = _demo_dataset(output / f"{DEMO_TASK}.h5", trajectories, seed)
    database = output / f"{DEMO_TASK}-scores.db"
    settings, executor = SearchSettings(nodes, seed), Threads(threads)
    with _score(dataset, database, settings, executor=executor) as run:
        labelled = run.labelled_scores()
    _evaluate(labelled, output / "table.md", output / "table.csv", seed)
    from energymargin.experiments import pictures  # slow to load, which Ctrl-C would wait for

    pictures.figure_trees(dataset, nodes, seed).savefig(output / "qualitative.png")
    pictures.figure_along(dataset, labelled).savefig(output / "scores.png")
    written = sorted(path.name for path in output.iterdir() if path.suffix in DEMO_SUFFIXES)
    say(f"In {escape(str(output))}/: {', '.join(written)}")


def main() -> None:
    """Entry point of the command `energymargin`."""
    app()


def _generate(
    task: Any, output: Path, *, trajectories: int, scheduler: str | None, **options: Any
) -> int:
    """Makes the file; returns how many trajectories it has. What ends it says what was kept."""
    from energymargin import datasets
    from energymargin.progress import progress_bar

    try:
        with (
            nullcontext() if scheduler is None else _cluster(scheduler).pool() as pool,
            progress_bar(err, f"Generating {task.name}", "trajectories") as progress,
        ):
            return datasets.generate_file(
                output, task, trajectories, pool=pool, progress=progress, **options
            )
    except (KeyboardInterrupt, OSError, RuntimeError):
        kept = datasets.trajectories_kept(output)
        if kept:
            beside = f"{kept} of {trajectories} trajectories are kept beside {escape(str(output))}"
            say(f"{beside}; the same command goes on from there.")
        raise


def _executor(threads: int | None, processes: int | None, scheduler: str | None) -> Executor:
    """The one that was asked for."""
    from energymargin.executors import Processes, Threads

    _require_one(threads=threads, processes=processes, scheduler=scheduler)
    if scheduler is not None:
        return _cluster(scheduler)
    return Threads(threads) if processes is None else Processes(processes)


def _cluster(scheduler: str) -> Dask:
    from energymargin.executors import Dask

    return Dask(scheduler, notice=lambda text: say(f"[yellow]{escape(text)}[/]"))


def _require_one(**options: Any) -> None:
    """Raises ValueError if more than one of these options is given."""
    given = [name for name, value in options.items() if value is not None]
    if len(given) > 1:
        raise ValueError(f"--{given[0]} and --{given[1]} are given, expected one of them")


@contextmanager
def _score(
    dataset: Dataset,
    output: Path,
    settings: SearchSettings,
    *,
    metrics: Sequence[str] | None = None,
    executor: Executor,
    timeout: float | None = None,
) -> Iterator[Run]:
    """Scores what is missing, and has the run of all scores. Ctrl-C says what was kept."""
    from energymargin.progress import progress_bar
    from energymargin.store import ScoreStore, begin_run, dataset_metrics, score_run

    metrics = dataset_metrics(dataset, metrics)  # nothing is written if they cannot be
    with ScoreStore(output, create=True) as store:
        run = begin_run(store, dataset, metrics, settings)
        try:
            with progress_bar(err, f"Scoring, {settings.nodes} nodes", "states") as progress:
                score_run(dataset, run, executor=executor, progress=progress, timeout=timeout)
        except KeyboardInterrupt:
            say(_kept(run))
            raise
        yield run


def _kept(run: Run) -> str:
    scored, states = run.counts()
    kept = f"{scored} of {states} states are scored and kept in {escape(str(run.store.path))}"
    return f"{kept}; the same command goes on from there."


def _evaluate(
    labelled: LabelledScores, markdown: Path | None, csv: Path | None, seed: int, last: int = 5
) -> None:
    from energymargin import evaluation

    result = evaluation.evaluate(labelled, seed=seed, last=last)
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


def _parameters_text(parameters: dict[str, Any]) -> str:
    return ", ".join(f"{name}={json.dumps(value)}" for name, value in parameters.items())


def _counts(dataset: Dataset) -> str:
    trajectories = (
        f"{len(dataset.trajectories)} trajectories ({dataset.successes.sum()} successful)"
    )
    return f"{trajectories}, {dataset.size} states"


def _one_line(error: BaseException) -> str:
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split())
