"""The command `energymargin score`, and the scoring that others share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from energymargin.commands.workers import Scheduler, chosen_executor
from energymargin.terminal import TIMED_OUT, Nodes, Seed, Threads, Timeout, err, say, split

if TYPE_CHECKING:
    from energymargin.datasets import Dataset
    from energymargin.executors import Executor
    from energymargin.settings import SearchSettings
    from energymargin.store import Run

__all__ = ["score", "scored_run"]


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
    executor = chosen_executor(threads, processes, scheduler)
    output = output or data.with_name(f"{data.stem}-scores.db")
    chosen = None if metrics is None else split(metrics)
    with (
        datasets.open(data) as dataset,
        scored_run(
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


@contextmanager
def scored_run(
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
