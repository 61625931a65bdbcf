"""The command `energymargin score`, and the scoring that others share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any

from rich.markup import escape

import energymargin as em
from energymargin.base.bars import bar
from energymargin.base.limits import Limit
from energymargin.base.metrics import CLOCKLESS, LEAST_EFFORT, TIMED, USUAL
from energymargin.base.settings import flag_of
from energymargin.cli import options
from energymargin.cli.evaluate import print_evaluation
from energymargin.cli.terminal import TIMED_OUT, say, warn

SEARCH = em.SearchSettings()
GROWTH, AHEAD = options.panel("How trees are grown"), options.panel("Over a horizon")
BELIEF = options.panel("Models known with an error")
COMPARED = 20000  # states; the intervals of more take longer than one would wait after scoring
PROBABILITY = ("rollouts", "strength", "objects", "common_random_numbers")


@options.options_of(SEARCH, "nodes", "seed")
@options.options_of(*(SEARCH, "stop_at_escape", "nodes_per_edge", "least_likelihood"), panel=GROWTH)
@options.options_of(SEARCH, *PROBABILITY, panel=AHEAD)
def score(
    data: Path,
    /,
    *,
    output: options.Output = None,
    paper: bool = False,
    metrics: str | None = None,
    engine: str | None = None,
    frames: Annotated[int | None, AHEAD] = None,
    plan: Annotated[options.PlanWord | None, AHEAD] = None,
    check: Annotated[float | None, AHEAD] = None,
    dwell: Annotated[float | None, AHEAD] = None,
    belief: Annotated[str | None, BELIEF] = None,
    particles: Annotated[int | None, BELIEF] = None,
    where: options.Where = options.Where(),
    **given: Any,
) -> None:
    """Does it stay captured over the next frames? Scores every state of a dataset that is not
    scored yet: its probability and the effort of an escape over a horizon, and beside them the
    paper's scores of the state as it is. Stopped in any way, the same command goes on from there.

    Example: `energymargin score push.h5 -o push-scores.db --nodes 100`

    The paper's scores alone, in two thirds of the time (half of it with 100 nodes): `energymargin
    score push.h5 --paper`

    Is the pose known to a centimetre alone? `energymargin score push.h5 --belief '{"pose": [0.01,
    0.01, 0, 0, 0, 0.05]}'`

    On a cluster: `energymargin score push.h5 --scheduler tcp://10.0.0.1:8786`

    Args:
        data: A dataset, from `energymargin generate`.
        output: The scores; DATA-scores.db if not given.
        paper: The paper's scores alone, without a horizon, as in its tables.
        metrics: These scores alone, with commas between. One without a clock, such as capture, is
            of the state as it is. Efforts have the horizon if a probability or --frames is given.
        engine: What steps the simulation, native or bullet; that of the dataset if not given.
        frames: The horizon in frames of a trajectory. If not given 5, or as many as half a second
            has, but no more than there are. A frame behind the last one counts the mean time
            between frames, so all states are asked the same.
        plan: What the robot does meanwhile. script: the mean of the task's script from the frame
            on, and behind its end what the task says. hold: it goes on as it moves, as for
            recordings. none: it coasts. If not given, the first of these that the data have.
        check: The time between two looks at the capture set [s]; about 1/60 if not given.
        dwell: How long the objects have to be outside to be lost [s], at least --check; 0 if not
            given: one look is enough.
        belief: How well the models are known, as JSON or a file of it: friction, mass, pose,
            velocity. Scores are then means over a belief, at as many steps.
        particles: With --belief, draws of it for each state; 16 if not given.
    """
    settings = replace(SEARCH, **given)
    flags = {each.name: flag_of(each).removeprefix("--") for each in fields(SEARCH)}
    times = {"check": check, "dwell": dwell}
    clock = {"frames": frames, "plan": plan, **times}
    clock |= {flags[name]: given.get(name) for name in PROBABILITY}
    for name, value in {"metrics": metrics, **clock}.items():
        options.require_one(paper=paper or None, **{name: value})
    named = None if metrics is None else options.split(metrics)
    timed = named is None or bool(set(named) & set(TIMED))
    if not timed:
        others = {name: value for name, value in clock.items() if name != "frames"}
        options.require_beside("frames", frames, **others)
    sampling = options.chosen_sampling(belief, particles)
    executor = where.executor()
    output = output or data.with_name(f"{data.stem}-scores.db")
    limit, failed, numbers = Limit(where.timeout), None, []
    with em.datasets.open(data) as recorded:
        dataset = recorded if engine is None else recorded.in_engine(engine)
        future = None
        if not paper and (timed or frames is not None):
            future = _asked_future(dataset, frames, plan, **times)
            _say_of_older(output, future)
        scoring = Scoring(dataset, output, settings, executor, sampling)
        for names, ahead in scoring.runs(named, future):  # all are checked before any is scored
            try:
                with scoring.run(names, ahead, timeout=limit.rest()["timeout"]) as (run, complete):
                    numbers.append(run.number)
                    if not complete:
                        say(f"[yellow]the time was over:[/] {_progress_text(run)}")
                        raise SystemExit(TIMED_OUT)
                    _say_scored(run, horizon=future is not None)
            except em.ScoreError as error:  # of some states alone: raised after all runs
                failed = failed or error
    if numbers:
        _show_question(output, numbers[0])
    if failed is not None:
        raise failed


def _asked_future(
    dataset: em.datasets.Dataset,
    frames: int | None,
    plan: options.PlanWord | None,
    **times: float | None,
) -> em.datasets.Future | None:
    """The question about the next frames, as far as it is given the usual one; None if the data
    have none. What is unusual is printed."""
    given = any(value is not None for value in (frames, plan, *times.values()))
    if not given and dataset.has_clock:
        return None
    try:
        if frames is None or plan is None:
            usual = em.datasets.usual_future(dataset, frames)
            frames = usual.frames
        if plan is None:
            plan = usual.plan or "none"
            if plan != "script":
                how = "it goes on as it moves" if plan == "hold" else "it coasts"
                warn(f"no script says what the robot is about to do: {how}, --plan {plan}")
    except ValueError as error:
        if given:
            raise
        warn(f"nothing is asked about the next frames, only the paper's scores: {error}")
        return None
    return options.chosen_future(frames, plan, **times)


def _say_of_older(path: Path, future: em.datasets.Future | None) -> None:
    """Says that a file of scores without a horizon, as --paper makes it, gets those with one."""
    if future is None or not path.exists():
        return
    with em.store.ScoreStore(path) as store:
        runs = store.runs()
    if runs and all(run.future is None for run in runs):
        say(
            f"{escape(str(path))} has scores of the states as they are. They stay, and those ahead "
            f"({future}) become a run of their own; --paper leaves these out."
        )


def _say_scored(run: em.store.Run, *, horizon: bool) -> None:
    """How many states are scored. `horizon`: the command asks about one, in this run or another."""
    scored, _ = run.counts()
    how = "" if run.future is None else f" ({run.future})"
    if horizon and run.future is None:
        how = f" (without the horizon: {', '.join(run.metrics)})"
    written = escape(str(run.store.path))
    say(f"{scored} states are scored in {written}{how}, {1e3 * run.seconds():.3g} ms a state.")


def _show_question(path: Path, number: int) -> None:
    """Of a run with a horizon what it foresaw; and the command that comes next."""
    with em.store.ScoreStore(path) as store:
        run, runs = store.run(number), len(store.runs())
        which = "" if runs == 1 or (runs == 2 and store.beside(run)) else f" --run {number}"
        if run.future is not None and run.states <= COMPARED:
            print_evaluation(em.evaluation.tables_of(*store.labelled_scores(run))[:1])
    say(f"Next: [bold]energymargin evaluate {escape(str(path))}{which}[/]")


@dataclass(frozen=True)
class Scoring:
    """What a command scores, where to and how."""

    dataset: em.datasets.Dataset
    output: Path
    settings: em.SearchSettings
    executor: em.executors.Executor
    sampling: em.beliefs.Sampling | None = None

    def metrics(
        self, names: Sequence[str] | None = None, future: em.datasets.Future | None = None
    ) -> Sequence[str]:
        """The metrics to score, as of `em.store.dataset_metrics`."""
        return em.store.dataset_metrics(self.dataset, names, self.settings, future, self.sampling)

    def runs(
        self, metrics: Sequence[str] | None, future: em.datasets.Future | None
    ) -> list[tuple[Sequence[str], em.datasets.Future | None]]:
        """The metrics and the future of each run: metrics without a clock have a run of their own.

        Without `metrics` those of USUAL have the horizon, and beside them are the paper's, which
        have none.
        """
        if metrics is None:
            found = self.metrics()
            clock = set(found) & set(TIMED)
            usual = [metric for metric in found if clock or metric not in LEAST_EFFORT]
            if future is None:
                return [(usual, None)]
            timed = [metric for metric in self.metrics(None, future) if metric in USUAL]
            return [(timed, future), (usual, None)]
        if future is None:
            return [(self.metrics(metrics), None)]
        clockless = [metric for metric in metrics if metric in CLOCKLESS]
        timed = [metric for metric in metrics if metric not in CLOCKLESS]
        runs = [(timed, future), (clockless, None)]
        return [(self.metrics(names, ahead), ahead) for names, ahead in runs if names]

    @contextmanager
    def run(
        self, metrics: Sequence[str], future: em.datasets.Future | None = None, **limit: Any
    ) -> Iterator[tuple[em.store.Run, bool]]:
        """Scores what is missing; gives the run of all scores, and whether the time was enough.
        States that cannot be simulated are counted. Ctrl-C says how far it came."""
        asked = metrics, self.settings, future
        what = future or f"{self.settings.nodes} nodes"
        workers = {"executor": self.executor, "notice": warn, **limit}
        with em.store.ScoreStore(self.output, create=True) as store:
            run = em.store.begin_run(store, self.dataset, *asked, sampling=self.sampling)
            try:
                with bar(f"Scoring, {what}", "states") as progress:
                    complete = em.store.score_run(self.dataset, run, progress=progress, **workers)
            except KeyboardInterrupt:
                say(_progress_text(run))
                raise
            yield run, complete


def _progress_text(run: em.store.Run) -> str:
    scored, states = run.counts()
    stored = f"{scored} of {states} states are scored and kept in {escape(str(run.store.path))}"
    return f"{stored}; the same command goes on from there."
