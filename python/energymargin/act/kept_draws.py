"""Draws in a store, by the digests of their questions: what was run once is read.

The digest is of all that the draws depend on. So any ranking or search may go on with the file, and
one that has become another by a changed plan, constraint or seed runs its own. A function looks
like any other in a file, so none is kept there: not as disturbance, not as set.
"""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Problem
from energymargin.act.draws import Draws, Question, Trial
from energymargin.base.checks import check_type, shown
from energymargin.disturbances import Disturbance, text_of
from energymargin.evaluate.asking import Kept
from energymargin.evaluate.store.answer_file import AnswerFile
from energymargin.model.beliefs.uncertainty import Uncertainty


class KeptDraws(AnswerFile):
    """A store, and what the draws in it depend on beside question and trial."""

    def __init__(
        self, store: str | Path, uncertainty: Uncertainty | None, question: Question
    ) -> None:
        """Raises ValueError on a disturbance that a file cannot tell from another; else as
        AnswerFile."""
        check_type("store", store, str | Path, "the name of a file, or None")
        _text(question.disturbance)
        super().__init__(store, create=True)
        self._uncertainty = uncertainty and uncertainty.to_json()

    def of(self, question: Question) -> Kept[Trial, Draws]:
        """The trials of a question in it."""
        return Kept(self, partial(self._digest, question), _read, _written)

    def _digest(self, question: Question, trial: Trial) -> bytes:
        """Of a trial. The particles of a candidate follow from the first one and their numbers.

        Raises ValueError on what a file cannot tell from another.
        """
        first = trial.draw(trial.numbers[0])
        asked = (question.metric, question.seed, question.nodes, _text(question.disturbance))
        own = [] if trial.particles is None else [trial.particles[k] for k in trial.numbers]
        particles = tuple(one.number for one in own)
        draws = (first.number, len(trial), particles, _problem_text(first.problem))
        return self.key(self._uncertainty, *asked, *draws)


def _read(_: Trial, content: bytes) -> Draws:
    values, times, steps = json.loads(content)
    return Draws(np.array(values), np.array(times), steps)


def _written(draws: Draws) -> bytes:
    return json.dumps([draws.values.tolist(), draws.times.tolist(), draws.steps]).encode()


def _text(disturbance: Any) -> str | None:
    if disturbance is None:
        return None
    if not isinstance(disturbance, Disturbance):
        raise ValueError(
            f"disturbance is {shown(disturbance)}, which a store cannot tell from another "
            "function: use a model of em.disturbances, or leave store out"
        )
    return text_of(disturbance)


def _problem_text(problem: Problem) -> str:
    try:
        return problem.to_json()
    except ValueError as error:
        raise ValueError(
            f"store keeps draws by the text of their problems: {error}, or leave store out"
        ) from error
