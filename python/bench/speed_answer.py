"""Part `answer`: seconds to a probability within 0.05, and how far it is from the truth."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from statistics import fmean, median
from typing import Any, Literal

import energymargin as em
from measurements import FRAMES, Settings, Tell, digits, in_turns
from speed_frame import PAIRS, SOON, captured_states, disturbance_of, future_of
from tables import markdown

__all__ = ["Answers", "measure_answers"]

TOLERANCE = 0.05  # half of the 95 % interval
TRUTH, FINER = 2000, 4  # rollouts, and steps in one of the scene
OTHER = 1  # seed of the truth: none of the draws of what is held against it
Design = Literal["independent", "sobol"]
DESIGNS: tuple[Design, ...] = ("independent", "sobol")


@dataclass(frozen=True)
class Answer:
    """Of one state, one way."""

    seconds: float
    rollouts: int
    error: float
    """Absolute, against rollouts with a quarter of the usual step."""


@dataclass
class Answers:
    """What there is so far."""

    settings: Settings
    found: dict[tuple[str, str, Design], list[Answer]] = field(default_factory=dict)
    """By task, step and design."""

    def tables(self) -> str:
        """In Markdown."""
        if not self.found:
            return ""
        head = (
            f"`em.capture_probability(tolerance={TOLERANCE:g})` over {SOON:g} s on one thread, of"
            f" {self.settings.states} states of a task. The error is the absolute difference from"
            f" {TRUTH} other rollouts with a quarter of the usual step: its mean, and the largest"
            " (the truth's own standard error is at most 0.011).\n"
        )
        heads = ("task, step, design", "time, median [ms]", "longest", "rollouts")
        return f"{head}\n{markdown([*heads, 'error', 'worst'], list(self._rows()))}"

    def _rows(self) -> Iterator[list[str]]:
        for (task, step, design), answers in self.found.items():
            times = [answer.seconds for answer in answers]
            errors = [answer.error for answer in answers]
            shown = [digits(1e3 * each) for each in (median(times), max(times))]
            rollouts = f"{median(answer.rollouts for answer in answers):.0f}"
            found = [rollouts, f"{fmean(errors):.3f}", f"{max(errors):.3f}"]
            yield [f"{task}, {step} s, {design}", *shown, *found]


def measure_answers(answers: Answers, tell: Tell) -> None:
    """Fills it task by task."""
    states = answers.settings.states
    for task in answers.settings.tasks:
        tell(f"{task}: its longest step")
        dataset = em.datasets.generate(task, trajectories=2 * states, frames=FRAMES, seed=0)
        problems = [future_of(dataset, t, k, SOON) for t, k in captured_states(dataset, states)]
        rollouts = PAIRS * answers.settings.rollouts
        disturbance = disturbance_of(problems[0])
        choice = em.longest_step(problems, disturbance=disturbance, rollouts=rollouts)
        for number, problem in enumerate(problems, 1):
            tell(f"{task}: state {number} of {states}")
            ask_all(answers, task, problem, choice.step)


def ask_all(answers: Answers, task: str, problem: em.Problem, longest: float) -> None:
    """One state, with both steps and both designs in turns."""
    usual = problem.scene.step
    ask: dict[str, Any] = {"disturbance": disturbance_of(problem), "threads": 1}
    fine = problem.with_step(usual / FINER)
    truth = em.capture_probability(fine, rollouts=TRUTH, seed=OTHER, **ask | {"threads": None})
    ways = [(step, design) for step in dict.fromkeys((usual, longest)) for design in DESIGNS]
    asks = [
        partial(
            em.capture_probability,
            problem.with_step(step),
            tolerance=TOLERANCE,
            design=design,
            **ask,
        )
        for step, design in ways
    ]
    clocks = in_turns(asks, answers.settings.rounds, time.process_time)
    for (step, design), asked, seconds in zip(ways, asks, clocks, strict=True):
        result = asked()
        found = answers.found.setdefault((task, f"1/{1 / step:.0f}", design), [])
        error = abs(result.captured - truth.captured)
        found.append(Answer(median(seconds), result.rollouts, error))
