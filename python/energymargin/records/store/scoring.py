"""Scores a dataset into a store: what is missing there, and nothing else."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin._core import Cancel, Problem
from energymargin.base.aliases import AnyPath
from energymargin.base.bars import Update
from energymargin.base.limits import Limit
from energymargin.base.metrics import CLOCKLESS, TIMED
from energymargin.base.plausibility import warn
from energymargin.evaluate import searches
from energymargin.evaluate.asking import ask
from energymargin.evaluate.belief_scoring import BeliefWork, Sharing, particle_chunk
from energymargin.evaluate.executors.choice import Executor, chosen_executor
from energymargin.evaluate.executors.rows import Row, Work, score_chunk
from energymargin.evaluate.scoring import ScoreError
from energymargin.evaluate.store.schema import state_digest
from energymargin.model.beliefs.belief import Belief
from energymargin.model.beliefs.sampling import PARTICLES, Sampling
from energymargin.model.beliefs.uncertainty import Uncertainty
from energymargin.records import datasets
from energymargin.records.datasets import Dataset, Future
from energymargin.records.datasets.dataset import SAMPLE, StateError, left_out_text, spread
from energymargin.records.store.file import ScoreStore
from energymargin.records.store.run import Run

if TYPE_CHECKING:
    from typing_extensions import Unpack

COMPARED = 100  # states whose problems are compared with those of before
WINDOW = 20000  # states that are searched at a time for missing scores
BLOCK = 16  # problems that are made at a time


def score_dataset(
    dataset: Dataset | AnyPath,
    path: AnyPath,
    metrics: Sequence[str] | None = None,
    *,
    settings: searches.SearchSettings | None = None,
    future: Future | None = None,
    uncertainty: Uncertainty | None = None,
    particles: int = PARTICLES,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    notice: Callable[[str], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    **loose: Unpack[searches.LooseSettings],
) -> bool:
    """Scores the states of a dataset that lack a score in the store at `path`, which gets each
    score as soon as it is computed. Returns whether all states that can be simulated are scored
    now.

    Args:
        dataset: a Dataset, or its file, which is read in blocks.
        path: the store, which is made if there is none.
        metrics: None takes all that there are.
        settings: of the searches and probabilities; None is SearchSettings().
        future: the scores ask about the frames to come, in a run of its own; those without a
            clock, as "capture", are for a call without a future.
        uncertainty: how well the model of each state is known; None: exactly. The scores are then
            means over a belief, at as many steps, in a run of its own.
        particles: of each belief, as of `em.score_belief`.
        executor: of `em.executors`; None is Threads().
        progress: progress(done, total) counts all states.
        notice: called with a line of text that counts the states that cannot be simulated, which
            are left out. None: it is a PlausibilityWarning.
        timeout: False is returned if so many seconds were over before all are scored.
        cancel: the same if it was set before.
        loose: the fields of SearchSettings by name, as nodes=100, in place of `settings`.

    After a timeout, a cancel, KeyboardInterrupt or any other error, all that was finished is in the
    store, and the same call goes on from it: the scores are those of an undisturbed run, to the
    last bit. So they are on any executor. If the file is renamed meanwhile, FileNotFoundError says
    so, and the file of the new name has all that was finished. Other errors: as `em.score`, and
    ScoreStore: a second call for the same file is refused while one is at work.
    """
    limit = Limit(timeout, cancel)
    settings, executor = searches.chosen_settings(settings, **loose), chosen_executor(executor)
    sampling = None if uncertainty is None else Sampling(uncertainty, particles)
    with ExitStack() as opened:
        if not isinstance(dataset, Dataset):
            dataset = opened.enter_context(datasets.open(dataset))
        # nothing is written before
        metrics = dataset_metrics(dataset, metrics, settings, future, sampling)
        store = opened.enter_context(ScoreStore(path, create=True))
        run = begin_run(store, dataset, metrics, settings, future, sampling=sampling)
        told: Any = {"progress": progress, "notice": notice}
        return score_run(dataset, run, executor=executor, **told, **limit.rest())


def begin_run(
    store: ScoreStore,
    dataset: Dataset,
    metrics: Sequence[str],
    settings: searches.SearchSettings,
    future: Future | None = None,
    *,
    sampling: Sampling | None = None,
) -> Run:
    """The run of a dataset with these metrics and settings; its states have the problems that they
    make now.

    After a change of the task's code, states make other problems. A change of only a few states of
    a large dataset may be missed.
    """
    questions = {metric: settings.of(metric) for metric in metrics}
    named = settings.all()
    if sampling is not None:
        questions = {metric: own | sampling.of(metric) for metric, own in questions.items()}
        named |= sampling.all()
    run = store.begin(dataset, named, questions, future=future)
    known = run.known_problems(spread(run.states, COMPARED))
    problems, _ = dataset.possible_problems(list(known), future=future)
    if known != {number: _digest(run, number, one) for number, one in problems.items()}:
        run.forget_problems()
    return run


def score_run(
    dataset: Dataset,
    run: Run,
    *,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    notice: Callable[[str], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> bool:
    """Scores what a run lacks, of its dataset. Arguments and errors: as `score_dataset`."""
    limit = Limit(timeout, cancel)
    settings = searches.SearchSettings(**run.settings)
    scored, states = run.counts()
    advance = (lambda _done, _total: None) if progress is None else progress
    advance(scored, states)
    if scored == states:  # so nothing is written
        return True
    missing = _MissingScores(dataset, run, scored, advance)
    workers: Any = {"executor": executor, **limit.rest()}
    if (sampling := run.sampling) is None:
        complete = ask(missing, partial(score_chunk, settings), missing.deliver, **workers)
    else:
        sharing = Sharing(sampling.particles, settings)
        belief = partial(dataset.belief, uncertainty=sampling.uncertainty, future=run.future)
        complete = ask(
            ([BeliefWork(work, belief, sharing) for work in batch] for batch in missing),
            partial(particle_chunk, sharing.settings),
            missing.deliver,
            split=BeliefWork.particles,
            join=BeliefWork.row,
            **workers,
        )
    run.store.require_in_place()
    advance(*run.counts())
    if missing.left_out:
        notice = notice or (lambda text: warn([("left out", text)], run.digest))
        notice(left_out_text(missing.left_out, states))
    if missing.errors:
        raise ScoreError(missing.errors, dataset.size)
    return complete


def dataset_metrics(
    dataset: Dataset,
    metrics: Sequence[str] | None,
    settings: searches.SearchSettings,
    future: Future | None = None,
    sampling: Sampling | None = None,
) -> Sequence[str]:
    """The metrics to score: those that are asked for, or all that a sample of the states has.

    Raises ValueError on metrics that the states do not have, or not with these settings.
    """
    problems, errors = dataset.possible_problems(spread(dataset.size, SAMPLE), future=future)
    if not problems:
        problems, errors = dataset.possible_problems(future=future)
    if not problems:
        raise StateError(errors[min(errors)])
    _require_clock(metrics or (), problems.values())
    chosen = searches.chosen_metrics(list(problems.values()), metrics, settings)
    if sampling is not None:
        Sharing(sampling.particles, settings).require(chosen)
        for problem in problems.values():
            Belief(problem, uncertainty=sampling.uncertainty)
    return chosen


def _require_clock(metrics: Sequence[str], problems: Iterable[Problem]) -> None:
    """Raises ValueError on a metric with a clock where the problems have none, and the reverse."""
    clocks = {problem.horizon is not None for problem in problems}
    for metric in metrics:
        if metric in TIMED and False in clocks:
            text = f"metrics has {metric!r}, which asks about a while: give its horizon, --frames N"
            raise ValueError(f"{text}, or in Python future=em.datasets.Future(FRAMES)")
        if metric in CLOCKLESS and True in clocks:
            text = f"metrics has {metric!r}, which asks about states as they are"
            raise ValueError(f"{text}: score it without a horizon")


def _digest(run: Run, number: int, problem: Problem) -> bytes:
    """The digest of a state's problem: of its JSON. A problem without one, as with a region of a
    Python predicate, is known by the state's place in the dataset, its future and its policy.

    Raises ValueError on a policy without a name, which nothing tells from another.
    """
    policy = ""
    if problem.plan is not None and problem.plan.policy is not None:
        policy = f", with the plan {problem.plan.to_json()}"
    try:
        return hashlib.sha256(problem.to_json().encode()).digest()
    except ValueError:
        ahead = "" if run.future is None else f", with the future {run.future.to_json()}"
        return state_digest(f"{run.digest}{ahead}{policy}", number)


class _MissingScores:
    """All that a run lacks, in the order of the states; where its scores go."""

    def __init__(self, dataset: Dataset, run: Run, scored: int, progress: Update) -> None:
        self.errors: dict[int, str] = {}
        """By the number of the state, what went wrong."""
        self.left_out: dict[int, str] = {}
        """Why a state cannot be simulated, by its number."""
        self._dataset, self._run = dataset, run
        self._scored, self._progress = scored, progress
        self._scoring: dict[int, tuple[str, ...]] = {}  # metrics of the states being scored

    def __iter__(self) -> Iterator[list[Work]]:
        """Batches of states and what each of them lacks; an empty one if other runs have it all."""
        for first in range(0, self._run.states, WINDOW):
            lacking = self._run.missing(first, first + WINDOW)
            for start in range(0, len(lacking), BLOCK):
                batch = self._posed(lacking[start : start + BLOCK])
                self._scoring |= {work.index: work.metrics for work in batch}
                yield batch

    def deliver(self, answers: Sequence[tuple[object, Row]]) -> None:
        """Puts scores into the store, and notes errors."""
        rows = [row for _, row in answers]
        self._run.add_rows([row for row in rows if not row.error])
        for row in rows:
            there = {metric for metric, value in row.scores.items() if not np.isnan(value)}
            lacking = ", ".join(sorted(set(self._scoring.pop(row.index)) - there))
            if row.error or lacking:
                why = "it lacks the set which that needs, or its numbers are too large"
                self.errors[row.index] = row.error or f"no score of {lacking}: {why}"
        self._advance(len(rows))

    def _posed(self, numbers: Sequence[int]) -> list[Work]:
        """What is missing of states, which the store may have of another dataset's."""
        problems, reasons = self._dataset.possible_problems(numbers, future=self._run.future)
        self.left_out |= reasons
        lacking = self._run.pose({n: _digest(self._run, n, one) for n, one in problems.items()})
        self._advance(sum(not metrics for metrics in lacking.values()))
        return [Work(n, problems[n], metrics) for n, metrics in lacking.items() if metrics]

    def _advance(self, states: int) -> None:
        if states:
            self._scored += states
            self._progress(self._scored, self._run.states)
