"""`em.longest_step`: how long a step of the simulation may be, by what shorter ones answer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np

from energymargin._core import Cancel, CaptureProbability, Problem, stream
from energymargin.base.aliases import Floats, Ints
from energymargin.base.checks import function_or_none, share, whole_number
from energymargin.base.errors import DivergedError
from energymargin.base.limits import Limit
from energymargin.base.reprs import Record
from energymargin.base.table_text import DASH, markdown_table
from energymargin.disturbances import Disturbance
from energymargin.evaluate.divergence import ANY, is_unknown
from energymargin.evaluate.scores import capture_probability

LADDER = (8.0, 4.0, 2.0, 1.0, 0.5)  # steps of the scene, and a half
FINEST = 0.25


@dataclass(frozen=True, eq=False, repr=False)
class TriedStep(Record):
    """One step, beside the finest one under the same disturbances."""

    step: float
    """[s]"""
    captured: Floats
    """Probability of each problem, shape (P,); empty where the step does not fit."""
    better: Ints
    """Rollouts of each problem that stay captured with this step and not with the finest one."""
    worse: Ints
    """Those that stay captured with the finest one alone."""
    pairs: Ints
    """Rollouts of each problem that count, as they diverge with neither step, shape (P,)."""
    refused: str = ""
    """Why it does not fit the problems, as their rollouts diverge with it; empty: it does."""

    @property
    def differences(self) -> Floats:
        """Probability of each problem less that of the finest step, shape (P,)."""
        return (self.better - self.worse) / self.pairs

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """(low, high) of the mean difference, of pairs (Agresti and Min 2005)."""
        return _interval(self.better.sum(), self.worse.sum(), self.pairs.sum(), confidence)

    def holds(self, error: float) -> bool:
        """Whether the mean is off by no more, and no problem is by its own interval."""
        if self.refused:
            return False
        counts = zip(self.better, self.worse, self.pairs, strict=True)
        single = (_interval(*of_problem) for of_problem in counts)
        near = all(low <= error and high >= -error for low, high in single)
        low, high = self.interval()
        return near and -error <= low and high <= error


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
    disturbance: Disturbance | None = None,
    rollouts: int = 400,
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> StepChoice:
    """The longest of 8, 4, 2, 1 and 1/2 steps of the scene whose probabilities are those of a
    quarter of it.

    `problems`: states that are typical of what will be asked, of one scene or of several with the
    same step. Each is asked with each step under the same disturbances, `rollouts` times; so a
    difference is one of steps. Those of the first problem have the `seed`, those of problem i
    em.stream(seed, i). A step holds if the 95 % interval of its mean difference lies
    within `error`, and that of no problem lies beyond. Then
    `problem.with_step(choice.step)` asks with it. A step with which more than one rollout of a
    problem, and more than 1 % of them, diverge is too long. Raises ValueError on no problems,
    different steps, and a problem without a horizon; DivergedError where the finest step diverges;
    TimeoutError or Cancelled if the limit comes before the answer. `progress(done, total)` counts
    probabilities; it may need less than the total.
    """
    limit = Limit(timeout, cancel)
    function_or_none("progress", progress, "done", "total")
    asked = [problems] if isinstance(problems, Problem) else list(problems)
    steps = {problem.scene.step for problem in asked}
    if len(steps) != 1:
        raise ValueError(f"problems have {len(steps)} steps, expected problems of one step")
    if any(problem.horizon is None for problem in asked):
        raise ValueError("a problem has no horizon, expected seconds: problem.replace(horizon=1.0)")
    share("error", error)
    whole_number("rollouts", rollouts, 1)

    drawn_step = None if callable(disturbance) else next(iter(steps))
    asks: dict[str, Any] = {"rollouts": rollouts, "threads": threads}
    asks |= {"disturbance": disturbance, "drawn_step": drawn_step, "most_diverged": ANY}
    asks |= {"warn": False, "undisturbed": False}
    nothing = np.zeros(len(asked), int)
    done, total = 0, len(asked) * (len(LADDER) + 1)

    def exits(step: float) -> Floats:
        """When each rollout of each problem leaves [s], as `exit_times`, shape (P, rollouts)."""
        nonlocal done
        found: list[CaptureProbability] = []
        for number, each in enumerate(asked):
            own = seed if number == 0 else stream(seed, number)
            one = capture_probability(each.with_step(step), seed=own, **asks, **limit.rest())
            if not one.complete:
                limit.require("the steps were compared")
            done, found = done + 1, [*found, one]
            if progress is not None:
                progress(done, total)
            if is_unknown(one):
                subject = f"problem {number} with a step of {step:.6g} s"
                raise DivergedError(subject, one.diverged, rollouts)
        return np.array([one.exit_times for one in found])

    def compared(step: float, found: Floats) -> TriedStep:
        counts = ~np.isnan(found) & ~np.isnan(finest)
        kept, finer = counts & np.isinf(found), counts & np.isinf(finest)
        captured = np.isinf(found).sum(1) / (~np.isnan(found)).sum(1)
        worse = (finer & ~kept).sum(1)
        return TriedStep(step, captured, (kept & ~finer).sum(1), worse, counts.sum(1))

    def tried(step: float) -> TriedStep:
        try:
            return compared(step, exits(step))
        except (ValueError, DivergedError) as refusal:
            return TriedStep(step, np.zeros(0), nothing, nothing, nothing, str(refusal))

    step = steps.pop()
    finest = exits(FINEST * step)
    found: list[TriedStep] = []
    for part in LADDER:
        found.append(tried(part * step))
        if found[-1].holds(error):
            break
    settled = found[-1].holds(error)
    chosen = found[-1].step if settled else FINEST * step
    return StepChoice(chosen, error, settled, (*found, compared(FINEST * step, finest)))


def _interval(better: int, worse: int, pairs: int, confidence: float = 0.95) -> tuple[float, float]:
    normal = NormalDist().inv_cdf((1 + confidence) / 2)
    middle = (better - worse) / (pairs + 2)
    half = normal * np.sqrt(better + worse + 1 - (better - worse) ** 2 / (pairs + 2)) / (pairs + 2)
    return float(middle - half), float(middle + half)


def _row(tried: TriedStep) -> tuple[str, str, str]:
    if tried.refused:
        return f"{tried.step:.6g}", tried.refused, DASH
    low, high = tried.interval()
    return f"{tried.step:.6g}", f"{tried.captured.mean():.3f}", f"{low:+.3f} to {high:+.3f}"
