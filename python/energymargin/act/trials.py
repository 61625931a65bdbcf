"""Trials of candidates as one batch: on threads, in processes, or on a cluster; and in a store.

There draws are known by the digests of their questions: of all that they depend on. So what was run
once is read, any ranking or search may go on with the file, and one that has become another by a
changed plan, constraint or seed runs its own. A function looks like any other in a file, so none is
kept there: not as disturbance, not as set.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Cancel, Cancelled, Problem
from energymargin.act.draws import Draw, Draws, Question, Trial, check_uncertainty
from energymargin.base.checks import check_type, shown
from energymargin.base.limits import Limit
from energymargin.disturbances import Disturbance, text_of
from energymargin.evaluate.asking import Kept, Pairs, ask
from energymargin.evaluate.divergence import ANY
from energymargin.evaluate.executors.choice import Executor, chosen_executor
from energymargin.evaluate.searches import metric_search
from energymargin.evaluate.store.answer_file import AnswerFile
from energymargin.model.beliefs.uncertainty import Uncertainty

# They count where they are gathered if they diverge.
OF_ROLLOUTS: dict[str, Any] = {"undisturbed": False, "most_diverged": ANY}


class Trials(ExitStack):
    """The workers of an executor and a store, for one batch of trials after the other."""

    def __init__(
        self,
        question: Question,
        uncertainty: Uncertainty | None = None,
        *,
        store: str | Path | None = None,
        executor: Executor | None = None,
        threads: int | None = None,
        on_draws: Callable[[Draws], None] = lambda _: None,
    ) -> None:
        """Opens them.

        `store`: trials that are whole go there, and are not run again. `threads`: in place of an
        executor; None takes all cores. `on_draws`: called with draws as they come in, or are read.
        Raises ValueError on another thing than an Uncertainty, if executor and threads are given,
        and on a disturbance that a file cannot tell from another; else as AnswerFile.
        """
        super().__init__()
        check_uncertainty(uncertainty)
        self._on_draws, on = on_draws, chosen_executor(executor, threads)
        self._uncertainty = uncertainty
        check_type("store", store, str | Path | None, "the name of a file, or None")
        self._file: AnswerFile | None = None
        with ExitStack() as opened:
            if store is not None:
                _disturbance_text(question.disturbance)
                self._file = opened.enter_context(AnswerFile(store, create=True))
            self._workers = opened.enter_context(on.workers())
            self.push(opened.pop_all())

    def run(self, question: Question, trials: Sequence[Trial], limit: Limit) -> list[Draws | None]:
        """What came of each; None of those that the limit left unfinished.

        Raises KeyboardInterrupt after Ctrl-C, within 0.2 s, and what a trial raised.
        """
        found: dict[int, Draws] = {}

        def note(answers: Pairs[Trial, Draws]) -> None:
            for trial, draws in answers:
                found[trial.candidate] = draws
                self._on_draws(draws)

        ask(
            *([trials], partial(draw_chunk, question), note),
            split=Trial.draws,
            join=lambda _, parts: Draws.joined(parts),
            kept=self._kept(question),
            executor=self._workers,
            **limit.rest(),
        )
        return [found.get(trial.candidate) for trial in trials]

    def _kept(self, question: Question) -> Kept[Trial, Draws] | None:
        """The trials of a question in the store. Raises ValueError on what a file cannot tell from
        another."""
        if self._file is None:
            return None
        file = self._file
        asked = (question.metric, question.seed, question.nodes)
        known = None if self._uncertainty is None else self._uncertainty.to_json()
        asked_of = (known, *asked, _disturbance_text(question.disturbance))

        def digest(trial: Trial) -> bytes:
            """The particles of a candidate follow from the first one and their numbers."""
            first = trial.draw(trial.numbers[0])
            own = [] if trial.particles is None else [trial.particles[k] for k in trial.numbers]
            particles = tuple(one.number for one in own)
            text = _problem_text(first.problem)
            return file.key(*asked_of, first.number, len(trial), particles, text)

        return Kept(file, digest, _read, _written)


def draw_chunk(question: Question, draws: Sequence[Draw], cancel: Cancel) -> list[Draws | None]:
    """On a worker: what came of draws; those of one problem together, at the first of them."""

    def together(draw: Draw) -> tuple[int, int]:
        return draw.candidate, draw.number if question.is_effort else id(draw.problem)

    results: list[Draws | None] = []
    for _, group in groupby(draws, together):
        first, *others = group
        settings = replace(question.settings, rollouts=1 + len(others))
        number = first.number if question.is_effort else None
        which: Any = {} if question.is_effort else OF_ROLLOUTS | {"first": first.number}
        which |= {"disturbance": _disturbance_of(question, first.problem), "cancel": cancel}
        found = metric_search(first.problem, question.metric, settings, number, **which)
        if not found.complete:
            raise Cancelled("cancelled within a trial")
        results += [_draws_of(question, found, first.problem), *(None for _ in others)]
    return results


def _disturbance_of(question: Question, problem: Problem) -> Any:
    """That of a problem, for a disturbance that depends on its masses."""
    of_problem = getattr(question.disturbance, "of_problem", None)
    return question.disturbance if of_problem is None else of_problem(problem)


def _draws_of(question: Question, found: Any, problem: Problem) -> Draws:
    """What came of so many rollouts of a problem, or of one search."""
    if question.is_effort:
        steps = round(float(np.sum(found.tree.durations)) / problem.scene.step)
        return Draws(np.array([found.effort]), np.array([float(np.isinf(found.effort))]), steps)
    shares = np.minimum(found.exit_times, found.times[-1]) / found.times[-1]
    success = question.metric == "probability/success"
    values = found.successes if success else np.isinf(found.exit_times)
    return Draws(np.where(np.isnan(shares), np.nan, values.astype(float)), shares, found.steps)


def _read(_: Trial, content: bytes) -> Draws:
    values, times, steps = json.loads(content)
    return Draws(np.array(values), np.array(times), steps)


def _written(draws: Draws) -> bytes:
    return json.dumps([draws.values.tolist(), draws.times.tolist(), draws.steps]).encode()


def _disturbance_text(disturbance: Any) -> str | None:
    if disturbance is None:
        return None
    if not isinstance(disturbance, Disturbance):
        why = "which a store cannot tell from another function"
        way = "use a model of em.disturbances, or leave store out"
        raise ValueError(f"disturbance is {shown(disturbance)}, {why}: {way}")
    return text_of(disturbance)


def _problem_text(problem: Problem) -> str:
    try:
        return problem.to_json()
    except ValueError as error:
        why = "store keeps draws by the text of their problems"
        raise ValueError(f"{why}: {error}, or leave store out") from error
