"""The command `energymargin score`, and the scoring that others share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer
from rich.markup import escape

from energymargin.cli.options import (
    Nodes,
    Scheduler,
    Seed,
    Threads,
    Timeout,
    chosen_executor,
    chosen_future,
    given_settings,
    split,
)
from energymargin.cli.terminal import TIMED_OUT, err, say

if TYPE_CHECKING:
    from energymargin.datasets import Dataset, Future
    from energymargin.executors import Executor
    from energymargin.settings import Search, SearchSettings
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
    search: Annotated[
        str,
        typer.Option(
            help="Of the efforts: improved finds cheaper escapes, published is the paper's search.",
            metavar="improved|published",
        ),
    ] = "improved",
    stop_at_escape: Annotated[
        bool,
        typer.Option(
            "--stop-at-escape",
            help="Of the efforts: a rollout ends where it is seen outside of the capture set.",
        ),
    ] = False,
    horizon: Annotated[
        int | None,
        typer.Option(
            help="Ask about the next so many frames of a trajectory, instead of the state as it "
            "is: probability and efforts. A frame behind the last one counts the mean time "
            "between frames, so all states are asked the same.",
            metavar="FRAMES",
        ),
    ] = None,
    plan: Annotated[
        str | None,
        typer.Option(
            help="With --horizon, what the robot does meanwhile. script: the mean of the task's "
            "script from the frame on, and behind its end what the task says (the default). hold: "
            "it goes on as it moves, as for recordings. none: it coasts.",
            metavar="script|hold|none",
        ),
    ] = None,
    check: Annotated[
        float | None,
        typer.Option(
            help="With --horizon, the time between two looks at the capture set [s].",
            show_default="about 1/60",
        ),
    ] = None,
    dwell: Annotated[
        float | None,
        typer.Option(
            help="With --horizon, how long the objects have to be outside to be lost [s].",
            show_default="0: one look is enough",
        ),
    ] = None,
    rollouts: Annotated[
        int | None,
        typer.Option(
            help="Of each probability: more make its interval narrower.", show_default="30"
        ),
    ] = None,
    strength: Annotated[
        float | None,
        typer.Option(
            help="Of the disturbance of the probabilities: a share of the task's bounds.",
            show_default="1",
        ),
    ] = None,
    objects: Annotated[
        int | None,
        typer.Option(help="Objects that are disturbed at a time; all if not given."),
    ] = None,
    common: Annotated[
        bool,
        typer.Option(
            "--common",
            help="All states meet the same disturbances (common random numbers), to be compared.",
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

    Will it hold for the next five frames? `energymargin score push.h5 --horizon 5 --plan script`

    On a cluster: `energymargin score push.h5 --scheduler tcp://10.0.0.1:8786`
    """
    from energymargin import datasets
    from energymargin.limits import Limit
    from energymargin.scoring import ScoreError
    from energymargin.settings import SearchSettings
    from energymargin.store.scoring import dataset_metrics

    settings = SearchSettings(
        *(nodes, seed, nodes_per_edge, least_likelihood, stop_at_escape),
        search=cast("Search", search),  # which is checked there
        **given_settings(horizon, rollouts, strength, objects, common),
    )
    future = chosen_future(horizon, plan, check, dwell)
    asked = _asked(None if metrics is None else split(metrics), future)
    executor = chosen_executor(threads, processes, scheduler)
    output = output or data.with_name(f"{data.stem}-scores.db")
    limit = Limit(timeout, None)
    with datasets.open(data) as dataset:
        for chosen, future in asked:  # before any is scored
            dataset_metrics(dataset, chosen, settings, future)
        failed = None
        for chosen, future in asked:
            try:
                with scored_run(
                    *(dataset, output, settings),
                    metrics=chosen,
                    future=future,
                    executor=executor,
                    timeout=limit.rest()["timeout"],
                ) as run:
                    _say_scored(run, one_of_many=len(asked) > 1, clock=horizon is not None)
            except ScoreError as error:  # of some states alone
                failed = failed or error
        if failed is not None:
            raise failed


def _asked(
    metrics: Sequence[str] | None, future: Future | None
) -> list[tuple[Sequence[str] | None, Future | None]]:
    """The runs that are asked for: metrics without a clock have one of their own."""
    from energymargin.metrics import CLOCKLESS

    if metrics is None or future is None:
        return [(metrics, future)]
    clockless = [metric for metric in metrics if metric in CLOCKLESS]
    timed = [metric for metric in metrics if metric not in CLOCKLESS]
    return [one for one in ((timed, future), (clockless, None)) if one[0]]


def _say_scored(run: Run, *, one_of_many: bool, clock: bool) -> None:
    """What was done, and what comes next; `one_of_many`: whether the command has other runs,
    `clock`: whether a horizon was asked for."""
    scored, states = run.counts()
    if scored < states:
        say(f"[yellow]the time was over:[/] {_kept(run)}")
        raise typer.Exit(TIMED_OUT)
    written = escape(str(run.store.path))
    which = f" --run {run.number}" if one_of_many or not run.is_only else ""
    how = "" if run.future is None else f" ({run.future})"
    if clock and run.future is None:
        how = f" (without the horizon: {', '.join(run.metrics)})"
    say(
        f"{scored} states are scored in {written}{how}, {1e3 * run.seconds():.3g} ms a state. "
        f"Next: [bold]energymargin evaluate {written}{which}[/]"
    )


@contextmanager
def scored_run(
    dataset: Dataset,
    output: Path,
    settings: SearchSettings,
    *,
    metrics: Sequence[str] | None = None,
    future: Future | None = None,
    executor: Executor,
    timeout: float | None = None,
) -> Iterator[Run]:
    """Scores what is missing, and has the run of all scores. Ctrl-C says what was kept."""
    from energymargin.cli.progress import progress_bar
    from energymargin.store import ScoreStore
    from energymargin.store.scoring import begin_run, dataset_metrics, score_run

    metrics = dataset_metrics(dataset, metrics, settings, future)  # nothing is written before
    with ScoreStore(output, create=True) as store:
        run = begin_run(store, dataset, metrics, settings, future)
        title = f"Scoring, {settings.nodes} nodes" if future is None else f"Scoring, {future}"
        try:
            with progress_bar(err, title, "states") as progress:
                score_run(dataset, run, executor=executor, progress=progress, timeout=timeout)
        except KeyboardInterrupt:
            say(_kept(run))
            raise
        yield run


def _kept(run: Run) -> str:
    scored, states = run.counts()
    kept = f"{scored} of {states} states are scored and kept in {escape(str(run.store.path))}"
    return f"{kept}; the same command goes on from there."
