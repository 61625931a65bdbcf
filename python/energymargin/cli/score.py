"""The command `energymargin score`, and the scoring that others share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.markup import escape

from energymargin.bars import bar
from energymargin.cli.fields import changed, options_of, split
from energymargin.cli.options import (
    PlanWord,
    chosen_executor,
    chosen_future,
    chosen_sampling,
    require_beside,
)
from energymargin.cli.terminal import TIMED_OUT, say, warn
from energymargin.searches import SearchSettings
from energymargin.settings import flag_of

if TYPE_CHECKING:
    from energymargin.beliefs.uncertainty import Sampling
    from energymargin.datasets import Dataset, Future
    from energymargin.executors import Executor
    from energymargin.store import Run

SEARCH = SearchSettings()
PROBABILITY = ("rollouts", "strength", "objects", "common_random_numbers")


@options_of(SEARCH, "nodes", "seed")
@options_of(
    *(SEARCH, "search", "stop_at_escape", "nodes_per_edge", "least_likelihood"),
    panel="How trees are grown",
)
@options_of(SEARCH, *PROBABILITY, panel="Over a horizon")
def score(
    data: Path,
    *,
    output: Path | None = None,
    metrics: str | None = None,
    frames: int | None = None,
    plan: PlanWord | None = None,
    check: float | None = None,
    dwell: float | None = None,
    belief: str | None = None,
    particles: int | None = None,
    threads: int | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
    timeout: float | None = None,
    **given: Any,
) -> None:
    """Score every state of a dataset that is not scored yet. Stopped in any way, the same command
    goes on from there; started twice at once, the second one is refused.

    Example: `energymargin score push.h5 -o push-scores.db --nodes 100`

    Is the pose known to a centimetre alone? `energymargin score push.h5 --belief '{"pose": [0.01,
    0.01, 0, 0, 0, 0.05]}'`

    Will it hold for the next five frames? `energymargin score push.h5 --frames 5 --plan script`

    On a cluster: `energymargin score push.h5 --scheduler tcp://10.0.0.1:8786`

    Args:
        data: A dataset, from `energymargin generate`.
        output: The scores; DATA-scores.db if not given.
        metrics: Which scores, with commas between; all that there are if not given.
        frames: Ask about the next so many frames of a trajectory, the horizon, instead of the state
            as it is: probability and efforts. A frame behind the last one counts the mean time
            between frames, so all states are asked the same.
    Over a horizon:
        plan: With --frames, what the robot does meanwhile. script: the mean of the task's script
            from the frame on, and behind its end what the task says (the default). hold: it goes on
            as it moves, as for recordings. none: it coasts.
        check: With --frames, the time between two looks at the capture set [s]; about 1/60 if not
            given.
        dwell: With --frames, how long the objects have to be outside to be lost [s]; 0 if not
            given: one look is enough.
    Models known with an error:
        belief: How well the models are known, as JSON or a file of it: friction, mass, pose,
            velocity. Scores are then means over a belief, at as many steps.
        particles: With --belief, draws of it for each state; 16 if not given.
    """
    from energymargin import datasets
    from energymargin.limits import Limit
    from energymargin.scoring import ScoreError
    from energymargin.store.scoring import dataset_metrics

    settings = changed(SEARCH, given)
    flags = {each.name: flag_of(each).removeprefix("--") for each in fields(SEARCH)}
    require_beside("frames", frames, **{flags[name]: given[name] for name in PROBABILITY})
    future = chosen_future(frames, plan, check=check, dwell=dwell)
    sampling = chosen_sampling(belief, particles)
    executor = chosen_executor(threads, processes, scheduler)
    output = output or data.with_name(f"{data.stem}-scores.db")
    limit, failed = Limit(timeout), None
    with datasets.open(data) as dataset:
        runs = [  # all are checked before any is scored
            (dataset_metrics(dataset, names, settings, ahead, sampling), ahead)
            for names, ahead in _asked_runs(None if metrics is None else split(metrics), future)
        ]
        for names, ahead in runs:
            try:
                with scored_run(
                    *(dataset, output, settings, names, executor),
                    future=ahead,
                    sampling=sampling,
                    timeout=limit.rest()["timeout"],
                ) as (run, complete):
                    if not complete:
                        say(f"[yellow]the time was over:[/] {_progress_text(run)}")
                        raise typer.Exit(TIMED_OUT)
                    _say_scored(run, several=len(runs) > 1, horizon=future is not None)
            except ScoreError as error:  # of some states alone: raised after all runs
                failed = failed or error
    if failed is not None:
        raise failed


def _asked_runs(
    metrics: Sequence[str] | None, future: Future | None
) -> list[tuple[Sequence[str] | None, Future | None]]:
    """The metrics and the future of each run: metrics without a clock have a run of their own."""
    from energymargin.metrics import CLOCKLESS

    if metrics is None or future is None:
        return [(metrics, future)]
    clockless = [metric for metric in metrics if metric in CLOCKLESS]
    timed = [metric for metric in metrics if metric not in CLOCKLESS]
    return [run for run in ((timed, future), (clockless, None)) if run[0]]


def _say_scored(run: Run, *, several: bool, horizon: bool) -> None:
    """How many states are scored, and the command that comes next.

    `several`: the command has other runs too; `horizon`: one was given.
    """
    scored, _ = run.counts()
    written = escape(str(run.store.path))
    which = f" --run {run.number}" if several or not run.is_only else ""
    how = "" if run.future is None else f" ({run.future})"
    if horizon and run.future is None:
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
    metrics: Sequence[str],
    executor: Executor,
    *,
    future: Future | None = None,
    sampling: Sampling | None = None,
    timeout: float | None = None,
) -> Iterator[tuple[Run, bool]]:
    """Scores what is missing; gives the run of all scores, and whether the time was enough. States
    that cannot be simulated are counted. Ctrl-C says how far it came."""
    from energymargin.store import ScoreStore
    from energymargin.store.scoring import begin_run, score_run

    with ScoreStore(output, create=True) as store:
        run = begin_run(store, dataset, metrics, settings, future, sampling=sampling)
        title = f"Scoring, {settings.nodes} nodes" if future is None else f"Scoring, {future}"
        try:
            with bar(title, "states") as progress:
                options: dict[str, Any] = {"progress": progress, "notice": warn, "timeout": timeout}
                complete = score_run(dataset, run, executor=executor, **options)
        except KeyboardInterrupt:
            say(_progress_text(run))
            raise
        yield run, complete


def _progress_text(run: Run) -> str:
    scored, states = run.counts()
    stored = f"{scored} of {states} states are scored and kept in {escape(str(run.store.path))}"
    return f"{stored}; the same command goes on from there."
