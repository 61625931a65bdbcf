"""Trials of candidates as one batch: on threads, in processes, or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np

from energymargin._core import Cancel, Cancelled
from energymargin.act.draws import Draw, Draws, Question, Trial
from energymargin.act.kept_draws import KeptDraws
from energymargin.base.closing import Closing
from energymargin.base.limits import Limit
from energymargin.evaluate.divergence import ANY
from energymargin.evaluate.executors import Executor
from energymargin.evaluate.executors.choice import chosen_executor
from energymargin.evaluate.parallel import run
from energymargin.evaluate.searches import metric_search

PIECE = 1000  # draws that are made at a time


class Trials(Closing):
    """The workers of an executor, for one batch of trials after the other."""

    def __init__(
        self,
        executor: Executor | None = None,
        threads: int | None = None,
        on_draws: Callable[[Draws], None] = lambda _: None,
        kept: KeptDraws | None = None,
    ) -> None:
        """Starts them.

        `threads`: in place of an executor; None takes all cores. `on_draws`: called with draws as
        they come in, or are read. `kept`: trials that are whole go there, and are not run again.
        Raises ValueError if executor and threads are given.
        """
        self._workers = chosen_executor(executor, threads).workers()
        self._on_draws, self._kept = on_draws, kept

    def run(self, question: Question, trials: Sequence[Trial], limit: Limit) -> list[Draws | None]:
        """What came of each; None of those that the limit left unfinished.

        Raises KeyboardInterrupt after Ctrl-C, within 0.2 s, and what a trial raised.
        """
        gathered = {trial.candidate: Gathered(trial) for trial in trials}
        digests = {t.candidate: self._kept.digest(question, t) for t in trials if self._kept}
        for candidate, digest in digests.items():
            if self._kept and (draws := self._kept.draws(digest)) is not None:
                gathered[candidate].whole = draws
                self._on_draws(draws)
        new = [trial for trial in trials if gathered[trial.candidate].whole is None]
        pieces = (trial[k : k + PIECE] for trial in new for k in range(0, len(trial), PIECE))

        def deliver(results: Sequence[tuple[Draw, Draws]]) -> None:
            for first, draws in results:
                self._on_draws(draws)
                whole = gathered[first.candidate].add(first.number, draws)
                if whole is not None and self._kept:
                    self._kept.keep_draws(digests[first.candidate], whole)

        run(self._workers, partial(draw_chunk, question), pieces, deliver, limit)
        return [one.whole for one in gathered.values()]

    def close(self) -> None:
        """Ends the workers."""
        self._workers.close()


@dataclass(eq=False)
class Gathered:
    """What came of a trial so far."""

    trial: Trial
    parts: dict[int, Draws] = field(default_factory=dict)
    """By the number of their first draw."""
    count: int = 0
    whole: Draws | None = None

    def add(self, first: int, draws: Draws) -> Draws | None:
        """All of them once it is whole."""
        self.parts[first] = draws
        self.count += len(draws.values)
        if self.count == len(self.trial):
            self.whole = Draws.joined([self.parts[number] for number in sorted(self.parts)])
        return self.whole


def draw_chunk(
    question: Question, draws: Sequence[Draw], cancel: Cancel
) -> list[tuple[Draw, Draws]]:
    """On a worker: what came of draws, those of one problem together, and the first of them."""

    def together(draw: Draw) -> tuple[int, int]:
        return draw.candidate, draw.number if question.is_effort else id(draw.problem)

    groups = [list(group) for _, group in groupby(draws, together)]
    return [(group[0], _draws_of(question, group[0], len(group), cancel)) for group in groups]


def _draws_of(question: Question, first: Draw, count: int, cancel: Cancel) -> Draws:
    """So many rollouts of a problem, or one search; raises Cancelled if they are not finished."""
    effort = question.is_effort
    of_rollouts: dict[str, Any] = {"first": first.number, "undisturbed": False}
    of_rollouts["most_diverged"] = ANY  # they are counted where draws are gathered
    found = metric_search(
        first.problem,
        question.metric,
        replace(question.settings, rollouts=count),
        first.number if effort else None,
        disturbance=question.disturbance,
        cancel=cancel,
        **({} if effort else of_rollouts),
    )
    if not found.complete:
        raise Cancelled("cancelled within a trial")
    if effort:
        steps = round(float(np.sum(found.tree.durations)) / first.problem.scene.step)
        return Draws(np.array([found.effort]), np.array([float(np.isinf(found.effort))]), steps)
    shares = np.minimum(found.exit_times, found.times[-1]) / found.times[-1]
    success = question.metric == "probability/success"
    values = found.successes if success else np.isinf(found.exit_times)
    return Draws(np.where(np.isnan(shares), np.nan, values.astype(float)), shares, found.steps)
