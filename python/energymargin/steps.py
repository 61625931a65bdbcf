"""`em.longest_step`: how long a step of the simulation may be, by what shorter ones answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Problem
from energymargin.checks import share, whole_number
from energymargin.disturbances import Disturbance, Uniform
from energymargin.reprs import Record
from energymargin.scores import capture_probability
from energymargin.table_text import DASH, markdown_table

LADDER = (8.0, 4.0, 2.0, 1.0, 0.5)  # steps of the scene, and a half
FINEST = 0.25
NORMAL = 1.96  # of a 95 % interval
UNIFORM = Uniform()


@dataclass(frozen=True, eq=False, repr=False)
class TriedStep(Record):
    """One step, beside the finest one under the same disturbances."""

    step: float
    """[s]"""
    captured: NDArray[np.float64]
    """Probability of each problem, shape (P,); empty where the step does not fit."""
    better: NDArray[np.int64]
    """Rollouts of each problem that stay captured with this step and not with the finest one."""
    worse: NDArray[np.int64]
    """Those that stay captured with the finest one alone."""
    rollouts: int
    """Of each problem."""
    refused: str = ""
    """Why it does not fit the problems; empty: it does."""

    @property
    def differences(self) -> NDArray[np.float64]:
        """Probability of each problem less that of the finest step, shape (P,)."""
        return (self.better - self.worse) / self.rollouts

    def interval(self) -> tuple[float, float]:
        """95 % interval of the mean difference, of pairs (Agresti and Min 2005)."""
        return _interval(self.better.sum(), self.worse.sum(), self.rollouts * len(self.better))

    def holds(self, error: float) -> bool:
        """Whether the mean is off by no more, and no problem is by its own interval."""
        if self.refused:
            return False
        single = map(self._interval_of, range(len(self.better)))
        near = all(low <= error and high >= -error for low, high in single)
        low, high = self.interval()
        return near and -error <= low and high <= error

    def _interval_of(self, problem: int) -> tuple[float, float]:
        return _interval(self.better[problem], self.worse[problem], self.rollouts)


@dataclass(frozen=True, eq=False, repr=False)
class StepChoice(Record):
    """The longest step whose error is small, and all that were tried."""

    step: float
    """[s]: for `problem.with_step`."""
    error: float
    """That was allowed."""
    settled: bool
    """False where no step held, and `step` is the finest one: its own error is not known."""
    tried: tuple[TriedStep, ...]
    """From the longest on; the last is the finest."""

    def to_markdown(self) -> str:
        """All steps that were tried, in a table."""
        head = f"No step is within {self.error:g} of the finest, of {self.step:.6g} s"
        if self.settled:
            head = f"The longest step within {self.error:g} of the finest is {self.step:.6g} s"
        rows = [_row(each) for each in self.tried]
        return f"{head}\n\n{markdown_table(('step [s]', 'captured', 'difference'), rows)}"

    __str__ = to_markdown


def longest_step(
    problems: Problem | Sequence[Problem],
    *,
    error: float = 0.02,
    disturbance: Disturbance = UNIFORM,
    rollouts: int = 400,
    seed: int = 0,
    threads: int | None = None,
    cancel: Cancel | None = None,
) -> StepChoice:
    """The longest of 8, 4, 2, 1 and 1/2 steps of the scene whose probabilities are those of a
    quarter of it.

    `problems`: states that are typical of what will be asked, of one scene or of several with the
    same step. Each is asked with each step under the same disturbances (`seed`), `rollouts` times;
    so a difference is one of steps. A step holds if the 95 % interval of its mean difference lies
    within `error`, and that of no problem lies beyond. Then
    `problem.with_step(choice.step)` asks with it. Raises ValueError on no problems, different
    steps, and a problem without a horizon, and Cancelled.
    """
    asked = [problems] if isinstance(problems, Problem) else list(problems)
    steps = {problem.scene.step for problem in asked}
    if len(steps) != 1:
        raise ValueError(f"problems have {len(steps)} steps, expected problems of one step")
    if any(problem.horizon is None for problem in asked):
        raise ValueError("a problem has no horizon, expected seconds: problem.replace(horizon=1.0)")
    share("error", error)
    whole_number("rollouts", rollouts, 1)

    ask = partial(
        capture_probability,
        disturbance=disturbance,
        rollouts=rollouts,
        seed=seed,
        threads=threads,
        cancel=cancel,
        warn=False,
    )
    nothing = np.zeros(len(asked), int)

    def captured(step: float) -> NDArray[np.bool_]:
        """Whether each rollout of each problem stays captured, shape (P, rollouts)."""
        return np.array([np.isinf(ask(each.with_step(step)).exit_times) for each in asked])

    def tried(step: float) -> TriedStep:
        try:
            kept = captured(step)
        except ValueError as refusal:
            return TriedStep(step, np.zeros(0), nothing, nothing, rollouts, str(refusal))
        better, worse = (kept & ~finest).sum(1), (finest & ~kept).sum(1)
        return TriedStep(step, kept.mean(1), better, worse, rollouts)

    step = steps.pop()
    finest = captured(FINEST * step)
    found: list[TriedStep] = []
    for part in LADDER:
        found.append(tried(part * step))
        if found[-1].holds(error):
            break
    settled = found[-1].holds(error)
    chosen = found[-1].step if settled else FINEST * step
    last = TriedStep(FINEST * step, finest.mean(1), nothing, nothing, rollouts)
    return StepChoice(chosen, error, settled, (*found, last))


def _interval(better: int, worse: int, pairs: int) -> tuple[float, float]:
    middle = (better - worse) / (pairs + 2)
    half = NORMAL * np.sqrt(better + worse + 1 - (better - worse) ** 2 / (pairs + 2)) / (pairs + 2)
    return float(middle - half), float(middle + half)


def _row(tried: TriedStep) -> tuple[str, str, str]:
    if tried.refused:
        return f"{tried.step:.6g}", tried.refused, DASH
    low, high = tried.interval()
    return f"{tried.step:.6g}", f"{tried.captured.mean():.3f}", f"{low:+.3f} to {high:+.3f}"
