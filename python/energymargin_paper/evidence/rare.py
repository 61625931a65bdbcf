"""Rare losses: splitting where the probability is known, and the effort of escape behind it.

Blocks on springs in a random force (`known_losses`) are lost once in a thousand to once in a
million times. The answer of each run is compared with that of the backward equation, its steps with
those of counting rollouts. And the weaker the force, the nearer is -T log p to the effort.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, capture_probability
from energymargin.base.checks import whole_number
from energymargin_paper.evidence.known_losses import (
    HORIZON,
    STEP,
    STIFFNESS,
    STRONG,
    WAY,
    WEAK,
    Well,
)
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["STUDY", "Rare", "RareStudy", "Run", "Settings"]

RUNS_FILE = "runs.jsonl"
DAMPINGS = {"Kramers": WEAK, "Ornstein-Uhlenbeck": STRONG}
TEMPERATURES = (0.0430, 0.0270, 0.0225)  # J: of losses of about 1e-3, 1e-5 and 1e-6
WEAKER = (0.1, 0.07, 0.05, 0.035, 0.025, 0.02, 0.016)  # J: of the picture


@dataclass(frozen=True)
class Settings:
    """Settings of the study; raises ValueError on numbers out of range."""

    replicas: int = setting(1000, "Replicas of each run.")
    runs: int = setting(100, "Runs of each case.")

    def __post_init__(self) -> None:
        """Checks them."""
        whole_number("replicas", self.replicas, 40)
        whole_number("runs", self.runs, 1)


@dataclass(frozen=True)
class Run:
    """A job: one answer of splitting."""

    damping: float
    temperature: float
    replicas: int
    seed: int


@dataclass(frozen=True)
class Loss:
    """What one run says."""

    lost: float
    low: float
    high: float
    """Upper end of the 95 % interval."""
    steps: int


@dataclass(frozen=True, eq=False)
class Case:
    """All runs of one well."""

    name: str
    well: Well
    known: float
    losses: list[Loss]

    @property
    def held(self) -> int:
        """Intervals that hold the known probability."""
        return sum(loss.low <= self.known <= loss.high for loss in self.losses)

    @property
    def ratios(self) -> NDArray[np.float64]:
        """Probabilities over the known one."""
        return np.array([loss.lost for loss in self.losses]) / self.known

    @property
    def error(self) -> float:
        """Root mean square of the relative error."""
        return float(np.sqrt(np.mean((self.ratios - 1.0) ** 2)))

    @property
    def steps(self) -> float:
        """Mean simulation steps of a run."""
        return float(np.mean([loss.steps for loss in self.losses]))

    @property
    def gain(self) -> float:
        """Steps that counting takes for the same relative error, over those of a run."""
        rollouts = (1.0 - self.known) / (self.known * self.error**2)
        return rollouts * round(HORIZON / STEP) / self.steps


@dataclass(frozen=True, eq=False)
class Rare:
    """What came out."""

    cases: list[Case]
    weaker: list[Case]
    """One run each, for the picture."""

    def to_csv(self) -> str:
        """One line a run."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(
            ("case", "temperature", "effort", "known", "seed", "lost", "low", "high", "steps")
        )
        for case in (*self.cases, *self.weaker):
            start = (case.name, case.well.temperature, case.well.effort, case.known)
            for seed, loss in enumerate(case.losses):
                writer.writerow((*start, seed, loss.lost, loss.low, loss.high, loss.steps))
        return text.getvalue()

    def to_markdown(self) -> str:
        """The runs by case, and the exponent by temperature."""
        return "\n".join([*self._cases(), "", *self._exponents()]) + "\n"

    def _cases(self) -> Iterator[str]:
        yield (
            "| case | known | mean / known | intervals that hold | relative error | "
            "steps of a run | steps of counting / those |"
        )
        yield "| --- | --- | --- | --- | --- | --- | --- |"
        for case in self.cases:
            error = case.ratios.std() / np.sqrt(len(case.ratios))
            yield (
                f"| {case.name} | {case.known:.2e} | {case.ratios.mean():.3f} ± {error:.3f} | "
                f"{case.held} of {len(case.losses)} | {case.error:.2f} | {case.steps:.2e} | "
                f"{case.gain:.3g} |"
            )

    def _exponents(self) -> Iterator[str]:
        yield "| case | effort / T | known p | p of splitting | 95 % interval | -T log p / effort |"
        yield "| --- | --- | --- | --- | --- | --- |"
        for case in self.weaker:
            loss, well = case.losses[0], case.well
            share = -well.temperature * np.log(loss.lost) / well.effort if loss.lost else np.inf
            yield (
                f"| {case.name} | {well.effort / well.temperature:.1f} | {case.known:.2e} | "
                f"{loss.lost:.2e} | {loss.low:.1e} to {loss.high:.1e} | {share:.2f} |"
            )


def exponent(case: Case) -> float:
    """-log of the known probability."""
    return -math.log(case.known)


def run(job: Run, cancel: Cancel) -> Loss:
    """One answer of splitting."""
    well = Well(job.damping, job.temperature)
    p = capture_probability(
        well.problem,
        rare=True,
        disturbance=well.disturbance,
        rollouts=job.replicas,
        seed=job.seed,
        cancel=cancel,
    )
    return Loss(p.lost, *p.interval(which="lost"), p.steps)


class RareStudy(Study[Settings, Rare]):
    """Rare losses by splitting, beside known probabilities, and the effort of escape behind them.

    A block on a spring in a random force is lost once in a thousand to once in a million times. The
    folder gets rare.md, rare.csv and rare.png; it goes on with the runs that it has.

    Example: `energymargin reproduce rare --runs 10`
    """

    name = "rare"
    title, unit = "Splitting", "runs"
    settings = Settings()
    quick = Settings(replicas=200, runs=2)

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Rare:
        """Runs splitting on each well."""
        runs = [(TEMPERATURES, seed) for seed in range(settings.runs)] + [(WEAKER, 0)]
        jobs = [
            Run(damping, temperature, settings.replicas, seed)
            for temperatures, seed in runs
            for damping in DAMPINGS.values()
            for temperature in temperatures
        ]
        found = resumed(
            folder / RUNS_FILE, jobs, run, threads, lines=pairs(Run, Loss), progress=progress
        )

        def cases(temperatures: tuple[float, ...]) -> list[Case]:
            return [
                _case(name, Well(damping, temperature), found)
                for name, damping in DAMPINGS.items()
                for temperature in temperatures
            ]

        return Rare(cases(TEMPERATURES), cases(WEAKER))

    def figures(self, result: Rare) -> Iterator[tuple[str, Figure]]:
        """The exponent against the effort of escape, and the steps."""
        yield "rare.png", figure_rare(result)


STUDY = RareStudy()


def _case(name: str, well: Well, found: dict[Run, Loss]) -> Case:
    of_well = [
        loss
        for job, loss in found.items()
        if (job.damping, job.temperature) == (well.damping, well.temperature)
    ]
    return Case(name, well, well.loss(), of_well)


COLORS = {"Kramers": "#0072B2", "Ornstein-Uhlenbeck": "#D55E00"}
WORDS = {"Kramers": "weakly damped", "Ornstein-Uhlenbeck": "strongly damped"}


def figure_rare(result: Rare) -> Figure:
    """The well; -log p against the effort in units of the noise; steps for an error of 10 %."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 3.8), dpi=200, layout="constrained")
    well, exponent, steps = figure.subplots(1, 3)
    _draw_well(well, result.weaker[0].well)
    _draw_exponent(exponent, result.weaker)
    _draw_steps(steps, result.cases)
    return figure


def _draw_well(ax: Axes, well: Well) -> None:
    x = np.linspace(-WAY, 1.3 * WAY, 200)
    inside = x <= WAY
    ax.plot(x[inside], 0.5 * STIFFNESS * x[inside] ** 2, color="black")
    ax.plot(x[~inside], 0.5 * STIFFNESS * x[~inside] ** 2, color="black", linestyle=":")
    ax.axvline(WAY, color="#CC79A7", label="edge of the capture set")
    for share in (0.25, 0.5, 0.7, 0.85):
        ax.axvline(share * WAY, color="gray", linewidth=0.6, linestyle="--")
    ax.plot([0], [0], "o", color="#E69F00", markersize=12)
    ax.annotate(
        "",
        xy=(WAY, well.effort),
        xytext=(WAY, 0.0),
        arrowprops={"arrowstyle": "<->", "color": "#CC79A7"},
    )
    ax.text(1.03 * WAY, 0.3 * well.effort, "effort\nof escape", color="#CC79A7")
    ax.set_title("rollouts split at levels on their way to the edge", fontsize=10)
    ax.set_xlabel("displacement [m]")
    ax.set_ylabel("energy of the spring [J]")
    ax.legend(fontsize=8, loc="upper left")


def _draw_exponent(ax: Axes, weaker: list[Case]) -> None:
    for name, color in COLORS.items():
        cases = [case for case in weaker if case.name == name]
        ratios = np.array([case.well.effort / case.well.temperature for case in cases])
        known = [exponent(case) for case in cases]
        ax.plot(ratios, known, color=color, label=f"{WORDS[name]}: known")
        found = [
            (ratio, case.losses[0])
            for ratio, case in zip(ratios, cases, strict=True)
            if case.losses[0].low > 0.0
        ]
        at = [ratio for ratio, _ in found]
        middle = -np.log([loss.lost for _, loss in found])
        ends = -np.log([(loss.high, loss.low) for _, loss in found])
        error = np.abs(ends - middle[:, None]).T
        label = "splitting, 95 % interval"
        ax.errorbar(at, middle, error, fmt="o", color=color, markersize=4, capsize=2, label=label)
    longest = max(case.well.effort / case.well.temperature for case in weaker)
    ax.plot([0.0, longest], [0.0, longest], "--", color="black", linewidth=1, label="slope 1")
    ax.set_ylim(0.0, 1.4 * longest)  # an interval that goes down to 0 has no end here
    ax.set_title("an energy margin is the exponent", fontsize=10)
    ax.set_xlabel("effort of escape / T")
    ax.set_ylabel("-log(probability of loss)")
    ax.legend(fontsize=7)


def _draw_steps(ax: Axes, cases: list[Case]) -> None:
    accuracy = 0.1
    for name, color in COLORS.items():
        own = [case for case in cases if case.name == name]
        known = [case.known for case in own]
        splitting = [case.steps * (case.error / accuracy) ** 2 for case in own]
        counting = [case.gain * steps for case, steps in zip(own, splitting, strict=True)]
        ax.plot(known, splitting, "o-", color=color, label=f"splitting, {WORDS[name]}")
        ax.plot(known, counting, "s:", color=color, label="counting")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_title("simulation steps for a relative error of 10 %", fontsize=10)
    ax.set_xlabel("probability of loss")
    ax.set_ylabel("steps")
    ax.legend(fontsize=7)
