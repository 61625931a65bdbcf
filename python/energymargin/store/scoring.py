"""Scores a dataset into a store: what is missing there, and nothing else."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from energymargin import datasets
from energymargin._core import Cancel, Problem
from energymargin.beliefs.belief import Belief
from energymargin.beliefs.gathering import Asked, ParticleSource, Sharing
from energymargin.beliefs.uncertainty import PARTICLES, Sampling, Uncertainty
from energymargin.datasets import Dataset, Future
from energymargin.datasets.dataset import StateError, left_out_text
from energymargin.executors import Executor, Row
from energymargin.executors.pool import POLL
from energymargin.executors.session import Work
from energymargin.executors.threads import chosen_executor
from energymargin.limits import Limit
from energymargin.metrics import CLOCKLESS, TIMED, check_metrics
from energymargin.plausibility import warn
from energymargin.scoring import ScoreError, run_all
from energymargin.searches import (
    LooseSettings,
    SearchSettings,
    chosen_metrics,
    chosen_settings,
    require_objects,
)
from energymargin.store.claims import Scorer
from energymargin.store.file import Digests, ScoreStore, forget_if_changed
from energymargin.store.run import Run
from energymargin.store.schema import state_digest

if TYPE_CHECKING:
    from typing_extensions import Unpack

__all__ = ["begin_run", "dataset_metrics", "score_dataset", "score_run"]

SAMPLE = 20  # states that tell which metrics there are
WINDOW = 20000  # states that are searched at a time for missing scores
BLOCK = 16  # problems that are made before the clock is looked at
MAKE = 0.1  # s; how long problems are made before the executor gets them
AGAIN = 0.5  # s; between two passes, for others to score what they have claimed


def score_dataset(
    dataset: Dataset | str | os.PathLike[str],
    path: str | os.PathLike[str],
    metrics: Sequence[str] | None = None,
    *,
    settings: SearchSettings | None = None,
    future: Future | None = None,
    uncertainty: Uncertainty | None = None,
    particles: int = PARTICLES,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    notice: Callable[[str], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    **loose: Unpack[LooseSettings],
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
    last bit. So they are on any executor, and with several such calls at once, in one process or in
    several: they share the work. If the file is renamed meanwhile, FileNotFoundError says so, and
    the file of the new name has all that was finished. Other errors: as `em.score`, and ScoreStore.
    """
    limit = Limit(timeout, cancel)
    settings, executor = chosen_settings(settings, **loose), chosen_executor(executor)
    sampling = None if uncertainty is None else Sampling(uncertainty, particles)
    with ExitStack() as opened:
        if not isinstance(dataset, Dataset):
            dataset = opened.enter_context(datasets.open(dataset))
        # nothing is written before
        metrics = dataset_metrics(dataset, metrics, settings, future, sampling)
        store = opened.enter_context(ScoreStore(path, create=True))
        run = begin_run(store, dataset, metrics, settings, future, sampling=sampling)
        return score_run(
            *(dataset, run),
            executor=executor,
            progress=progress,
            notice=notice,
            **limit.rest(),
        )


def begin_run(
    store: ScoreStore,
    dataset: Dataset,
    metrics: Sequence[str],
    settings: SearchSettings,
    future: Future | None = None,
    *,
    sampling: Sampling | None = None,
) -> Run:
    """The run of a dataset with these metrics and settings; its states have the problems that they
    make now."""
    settings = settings.of_clock(timed=_has_clock(dataset, future))
    questions = {metric: settings.of(metric) for metric in metrics}
    named = settings.all()
    if sampling is not None:
        questions = {metric: own | sampling.of(metric) for metric, own in questions.items()}
        named |= sampling.all()
    run = store.begin(dataset, named, questions, future=future)
    forget_if_changed(store, run, _digests(dataset, run, future))
    return run


def _digests(dataset: Dataset, run: Run, future: Future | None) -> Digests:
    """How to compute the digests of a run's states, with a future."""

    def digests(numbers: Sequence[int]) -> dict[int, bytes]:
        problems, _ = dataset.possible_problems(numbers, future=future)
        return {n: _posed_state(run, n, problem, future).digest for n, problem in problems.items()}

    return digests


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
    settings, executor = SearchSettings(**run.settings), chosen_executor(executor)
    scored, states = run.counts()
    if scored == states:  # so nothing is written
        if progress is not None:
            progress(scored, states)
        return True
    with Scorer(run.store, run) as scorer:
        counted = _ScoredCount(run, scorer, progress)
        missing = _MissingScores(dataset, run, scorer, counted)
        complete = _run_missing(missing, run, executor, settings, limit)
    run.store.require_in_place()
    counted.count()
    if missing.left_out:
        _tell_left_out(missing.left_out, run, notice)
    if missing.errors:
        raise ScoreError(missing.errors, dataset.size)
    return complete


def _tell_left_out(
    reasons: Mapping[int, str], run: Run, notice: Callable[[str], None] | None
) -> None:
    text = left_out_text(reasons, run.states)
    if notice is None:
        warn([("left out", text)], run.digest)
    else:
        notice(text)


def _run_missing(
    missing: _MissingScores, run: Run, executor: Executor, settings: SearchSettings, limit: Limit
) -> bool:
    """Scores what is missing, of a run with a belief particle by particle."""
    if run.sampling is None:
        return run_all(missing, executor, settings, missing.deliver, limit)
    sharing = Sharing(run.sampling.particles, settings)
    source = ParticleSource(_MissingBeliefs(missing, run.sampling.uncertainty), sharing, keep=False)

    def deliver(rows: Sequence[Row]) -> None:
        missing.deliver(source.gathered(rows))

    return run_all(source, executor, sharing.settings, deliver, limit)


def dataset_metrics(
    dataset: Dataset,
    metrics: Sequence[str] | None,
    settings: SearchSettings,
    future: Future | None = None,
    sampling: Sampling | None = None,
) -> Sequence[str]:
    """The metrics to score: those that are asked for, or all that a sample of the states has.

    Raises ValueError on metrics that the states do not have, or not with these settings.
    """
    numbers = np.unique(np.linspace(0, dataset.size - 1, SAMPLE).astype(int)).tolist()
    problems, errors = dataset.possible_problems(numbers, future=future)
    if not problems:
        problems, errors = dataset.possible_problems(future=future)
    if not problems:
        raise StateError(errors[min(errors)])
    _require_clock(metrics or (), problems.values())
    chosen = chosen_metrics(list(problems.values()), metrics)
    check_metrics(chosen)
    require_objects(problems.values(), chosen, settings)
    if sampling is not None:
        Sharing(sampling.particles, settings).require(chosen)
        for problem in problems.values():
            Belief(problem, uncertainty=sampling.uncertainty)
    return chosen


def _has_clock(dataset: Dataset, future: Future | None) -> bool:
    """Whether its problems have a horizon; those of one dataset are alike in that."""
    if future is not None:
        return True
    for number in range(dataset.size):
        problems, _ = dataset.possible_problems([number])
        if problems:
            return problems[number].horizon is not None
    return False


def _require_clock(metrics: Sequence[str], problems: Iterable[Problem]) -> None:
    """Raises ValueError on a metric with a clock where the problems have none, and the reverse."""
    clocks = {problem.horizon is not None for problem in problems}
    for metric in metrics:
        if metric in TIMED and False in clocks:
            raise ValueError(
                f"metrics has {metric!r}, which asks about a while: give its horizon, "
                "--horizon FRAMES, or in Python future=em.datasets.Future(FRAMES)"
            )
        if metric in CLOCKLESS and True in clocks:
            raise ValueError(
                f"metrics has {metric!r}, which asks about states as they are: score it without a "
                "horizon"
            )


@dataclass(frozen=True)
class _PosedState:
    """A state's problem, and its digest."""

    problem: Problem
    written: str | None
    """As JSON; None if it has a region of a Python predicate."""
    digest: bytes


def _posed_state(run: Run, number: int, problem: Problem, future: Future | None) -> _PosedState:
    """A state's problem with its digest: that of its JSON or, if it has none, of the state's place
    in the dataset and its future."""
    try:
        written = problem.to_json()
    except ValueError:
        place = (
            run.digest if future is None else f"{run.digest}, with the future {future.to_json()}"
        )
        return _PosedState(problem, None, state_digest(place, number))
    return _PosedState(problem, written, hashlib.sha256(written.encode()).digest())


class _Pass:
    """One pass through the states of a run, in their order, for those that lack a score.

    It looks through the states up to the last, and hands out those that it has found; then it is
    over. Another pass is due if this one began behind the first state, or met states that others
    compute.
    """

    def __init__(self, run: Run, start: int) -> None:
        self.another_is_due = start > 0
        self._run = run
        self._next = start  # the first state that was not looked at
        self._lacking: list[int] = []  # states before it that were not handed out
        self._rests_until = 0.0

    @property
    def over(self) -> bool:
        """Whether every state was looked at, and all that lack a score were handed out."""
        return self._next >= self._run.states and not self._lacking

    @property
    def rested(self) -> bool:
        """Whether others have had some time for the states that they have claimed."""
        return time.monotonic() >= self._rests_until

    def look(self, most: int, but: Callable[[int], bool]) -> None:
        """Looks for states that lack a score until it has `most`; it skips those of `but`."""
        while len(self._lacking) < most and self._next < self._run.states:
            last = self._next + WINDOW
            found = self._run.missing(self._next, last)
            self._lacking += [number for number in found if not but(number)]
            self._next = last
        if self._next >= self._run.states:
            self._rests_until = time.monotonic() + AGAIN

    def hand_out(self, most: int) -> list[int]:
        """The next states that lack a score, at most so many; none if none are known."""
        some, self._lacking = self._lacking[:most], self._lacking[most:]
        return some


class _MissingScores:
    """A ProblemSource of all that a run lacks and nobody else computes, in the order of the states.

    It goes through the states pass after pass, first from the scorer's start.
    """

    def __init__(self, dataset: Dataset, run: Run, scorer: Scorer, counted: _ScoredCount) -> None:
        self.errors: dict[int, str] = {}
        """By the number of the state, what went wrong."""
        self.left_out: dict[int, str] = {}
        """Why a state cannot be simulated, by its number."""
        self._dataset, self._run, self._scorer, self._counted = dataset, run, scorer, counted
        self._scoring: dict[int, tuple[str, ...]] = {}  # metrics of the states being scored
        self._pass = _Pass(run, scorer.start)

    @property
    def empty(self) -> bool:
        """As ProblemSource.empty."""
        return self._pass.over and not self._pass.another_is_due

    def take(self, most: int) -> Sequence[Work]:
        """As ProblemSource.take."""
        self._scorer.beat()
        if self._pass.over:
            if not self._pass.rested:
                time.sleep(POLL)
                return []
            self._pass = _Pass(self._run, 0)
        known = (self._scoring, self.errors, self.left_out)
        self._pass.look(most, lambda number: any(number in some for some in known))
        start, taken = time.monotonic(), list[Work]()
        while len(taken) < most and time.monotonic() < start + MAKE:
            numbers = self._pass.hand_out(min(BLOCK, most - len(taken)))
            if not numbers:
                break
            taken += self._claimed(numbers)
        self._scoring |= {work.index: work.metrics for work in taken}
        return taken

    def belief(self, number: int, uncertainty: Uncertainty) -> Belief:
        """Of a state."""
        return self._dataset.belief(number, uncertainty, self._run.future)

    def deliver(self, rows: Sequence[Row]) -> None:
        """Puts scores into the store, and notes errors."""
        if not rows:
            self._scorer.beat()
            return
        good = [row for row in rows if not row.error]
        bad = [row.index for row in rows if row.error]
        self._scorer.add(good)
        if bad:
            self._scorer.give_up(bad)
        for row in rows:
            there = {metric for metric, value in row.scores.items() if not np.isnan(value)}
            lacking = ", ".join(sorted(set(self._scoring.pop(row.index)) - there))
            if row.error or lacking:
                why = "it lacks the set which that needs, or its numbers are too large"
                self.errors[row.index] = row.error or f"no score of {lacking}: {why}"
        self._counted.add(len(rows))

    def _claimed(self, numbers: Sequence[int]) -> list[Work]:
        future = self._run.future
        problems, reasons = self._dataset.possible_problems(numbers, future=future)
        self.left_out |= reasons
        known = {n: _posed_state(self._run, n, problem, future) for n, problem in problems.items()}
        claims = self._scorer.claim({number: one.digest for number, one in known.items()})
        self._pass.another_is_due |= any(claim.taken for claim in claims.values())
        self._counted.add(sum(not (claim.metrics or claim.taken) for claim in claims.values()))
        return [
            Work(number, known[number].problem, claim.metrics, known[number].written)
            for number, claim in claims.items()
            if claim.metrics
        ]


class _MissingBeliefs:
    """A BeliefSource: the missing states of a run, each with what is not known of its model."""

    def __init__(self, missing: _MissingScores, uncertainty: Uncertainty) -> None:
        self._missing, self._uncertainty = missing, uncertainty

    def take(self, most: int) -> Sequence[Asked]:
        """As BeliefSource.take."""
        belief, known = self._missing.belief, self._uncertainty
        return [
            Asked(work.index, partial(belief, work.index, known), work.metrics)
            for work in self._missing.take(most)
        ]

    @property
    def empty(self) -> bool:
        """As BeliefSource.empty."""
        return self._missing.empty


class _ScoredCount:
    """How many states are scored, by this scorer and others, for a progress bar."""

    SHARE = 0.05  # of the time, at most, for counting in the store

    def __init__(
        self, run: Run, scorer: Scorer, progress: Callable[[int, int], None] | None
    ) -> None:
        self._run, self._scorer = run, scorer
        self._progress = (lambda _done, _total: None) if progress is None else progress
        self.count()

    def add(self, states: int) -> None:
        """Counts so many more, and now and then those that others have scored."""
        self._done += states
        if time.monotonic() > self._next and not self._scorer.alone():
            self.count()
        elif states:
            self._progress(min(self._done, self._run.states), self._run.states)

    def count(self) -> None:
        """Counts all scored states in the store, and reports them."""
        start = time.monotonic()
        self._done, total = self._run.counts()
        now = time.monotonic()
        self._next = now + max(1.0, (now - start) / self.SHARE)
        self._progress(self._done, total)
