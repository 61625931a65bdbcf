"""Part `fewer`: what rollouts that are evenly spread, a sequential test, and rollouts with a long
step say beside others."""

from __future__ import annotations

from dataclasses import dataclass, field
from statistics import fmean
from typing import Any

import numpy as np

import energymargin as em
from measurements import FRAMES, Settings, Tell
from speed_frame import SOON, captured_states, future_of
from tables import markdown

__all__ = ["Fewer", "measure_fewer"]

UNSURE = (0.1, 0.9)  # probabilities of states that are asked
TRUTH, REPLICATES = 16000, 100  # of a state; replicates of a round
LITTLE = 10  # times fewer
ROLLOUTS = 128
WITH_LONG_STEP = 1024
THRESHOLDS, MOST = (0.7, 0.9), 100


@dataclass(frozen=True)
class Spread:
    """Of one state, with design="sobol" beside independent rollouts."""

    variance: float
    """Mean squared error, as a share of the variance of as many independent rollouts."""
    holds: float
    """Share of the replicates whose interval holds."""
    width: float
    """Of the interval, as a share of that of as many independent rollouts."""


@dataclass(frozen=True)
class Levels:
    """Of one state, with step="auto" beside independent rollouts."""

    steps: float
    """Simulation at an equal mean squared error, as a share; with its trial."""
    alone: float
    """The same without the trial."""
    holds: float
    """Share of the replicates whose interval holds."""
    longer: float
    """Steps of the scene that the long one takes, in the mean of the replicates."""


@dataclass
class Decisions:
    """With a threshold beside as many rollouts as it may take."""

    steps: int = 0
    all_steps: int = 0
    told: list[bool] = field(default_factory=list)
    """Whether what was told is right."""
    asked: int = 0


@dataclass
class Fewer:
    """What there is so far."""

    settings: Settings
    spread: dict[str, list[Spread]] = field(default_factory=dict)
    levels: dict[str, list[Levels]] = field(default_factory=dict)
    decisions: dict[str, Decisions] = field(default_factory=dict)

    def tables(self) -> str:
        """In Markdown."""
        rows = [
            [
                task,
                str(len(of)),
                *(f"{fmean(getattr(s, name) for s in of):.2f}" if of else ""
                  for name in ("variance", "holds", "width")),
                f"{done.steps / done.all_steps:.2f}" if done.all_steps else "",
                str(done.asked),
                str(len(done.told)),
                str(done.told.count(False)),
            ]
            for task, of in self.spread.items()
            for done in [self.decisions[task]]
        ]  # fmt: skip
        heads = ["task", "states", "variance", "interval holds", "width"]
        if not rows:
            return ""
        spread = markdown([*heads, "steps with `above=`", "asked", "told", "wrong"], rows)
        names = ("steps", "alone", "holds", "longer")
        rows = [
            [task, str(len(of)), *(f"{fmean(getattr(s, name) for s in of):.2f}" for name in names)]
            for task, of in self.levels.items()
            if of
        ]
        heads = ["task", "states", "steps", "without the trial", "interval holds", "long step"]
        return f"{spread}\n\n{markdown(heads, rows)}" if rows else spread


def measure_fewer(fewer: Fewer, tell: Tell) -> None:
    """Fills it task by task, from states of a probability within UNSURE, and some others."""
    count, few = fewer.settings.states, 1 if fewer.settings.full else LITTLE
    replicates = fewer.settings.rounds * REPLICATES // few
    for task in fewer.settings.tasks:
        dataset = em.datasets.generate(task, trajectories=4 * count, frames=FRAMES, seed=2)
        spread = fewer.spread.setdefault(task, [])
        decisions = fewer.decisions.setdefault(task, Decisions())
        for number, (t, k) in enumerate(captured_states(dataset, 8 * count)):
            tell(f"{task}: state {number + 1} of {8 * count}")
            problem = future_of(dataset, t, k, SOON)
            if number < count:
                decide(problem, decisions, few)
            near = asked(problem, 60).captured
            if len(spread) < count and UNSURE[0] < near < UNSURE[1]:
                spread.append(spread_of(problem, TRUTH // few, replicates))
                levels = fewer.levels.setdefault(task, [])
                levels.append(levels_of(problem, TRUTH // few, replicates))


def asked(problem: em.Problem, rollouts: int, **options: Any) -> em.CaptureProbability:
    """A probability without what is not asked here."""
    return em.capture_probability(
        problem, rollouts=rollouts, undisturbed=False, warn=False, **options
    )


def spread_of(problem: em.Problem, rollouts: int, replicates: int) -> Spread:
    """One state's, beside a probability of so many rollouts."""
    truth = asked(problem, rollouts, seed=1).captured
    found = [asked(problem, ROLLOUTS, seed=2 + i, design="sobol") for i in range(replicates)]
    alone = [asked(problem, ROLLOUTS, seed=2 + i) for i in range(max(10, replicates // 10))]
    intervals = [p.interval() for p in found]
    error = float(np.mean([(p.captured - truth) ** 2 for p in found]))
    return Spread(
        error / (truth * (1 - truth) / ROLLOUTS),
        float(np.mean([low <= truth <= high for low, high in intervals])),
        float(np.mean(np.ptp(intervals, axis=1)) / np.mean([np.ptp(p.interval()) for p in alone])),
    )


def levels_of(problem: em.Problem, rollouts: int, replicates: int) -> Levels:
    """One state's, beside a probability of so many rollouts."""
    whole = asked(problem, rollouts, seed=1)
    truth, size = whole.captured, problem.scene.step
    found = [asked(problem, WITH_LONG_STEP, seed=2 + i, step="auto") for i in range(replicates)]
    # As independent ones: a replicate's squared error times its steps.
    equal = truth * (1 - truth) * whole.steps / rollouts
    error = float(np.mean([(p.captured - truth) ** 2 for p in found]))
    error -= truth * (1 - truth) / rollouts  # that of the truth itself
    trial = float(np.mean([trial_steps(problem, p, whole.steps / rollouts) for p in found]))
    steps = float(np.mean([p.steps for p in found]))
    return Levels(
        error * steps / equal,
        error * (steps - trial) / equal,
        float(np.mean([low <= truth <= high for low, high in (p.interval() for p in found)])),
        float(np.mean([(p.long_step or size) / size for p in found])),
    )


def trial_steps(problem: em.Problem, found: em.CaptureProbability, each: float) -> float:
    """Simulation steps of a trial: what is more than the rollouts take that count."""
    longer = (found.long_step or problem.scene.step) / problem.scene.step
    again = found.repeated if found.long_step else 0
    return found.steps - each * (found.rollouts / longer + again)


def decide(problem: em.Problem, decisions: Decisions, few: int) -> None:
    """One state's."""
    truth = asked(problem, TRUTH // few, seed=1).captured
    for threshold in THRESHOLDS:
        one = asked(problem, MOST, seed=2, above=threshold)
        decisions.steps += one.steps
        decisions.all_steps += asked(problem, MOST, seed=2).steps
        decisions.asked += 1
        if one.above is not None:
            decisions.told.append(one.above == (truth > threshold))
