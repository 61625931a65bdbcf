"""Grasps in MuJoCo too: held or lost alike, and success rates under noise of the pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel
from energymargin.table_text import markdown_table
from energymargin_paper.evidence.calibration import brier, calibration_error
from energymargin_paper.evidence.grasps_data import (
    LITTLE,
    MUCH,
    Noise,
    Posed,
    sampled,
    trials_of,
)
from energymargin_paper.evidence.grasps_mujoco import SOFTNESSES, Engine, Trial
from energymargin_paper.evidence.grasps_numbers import kappa

__all__ = ["Ends", "Job", "engines_text", "noise_text", "run_engines", "run_noise"]

STEPS = (5e-4, 2.5e-4)  # s, of MuJoCo
ENGINES = tuple(Engine(step, *soft) for step in STEPS for soft in SOFTNESSES)
STRENGTH = 1.0  # of the disturbances, as a share of the protocol's bounds
OF_NOISE = Engine(1e-3, *SOFTNESSES[0])  # of many trials
THERE = 1_000_000  # draws of MuJoCo's trials under noise begin here, so that they are others


@dataclass(frozen=True)
class Job:
    """One grasp."""

    version: str
    object: str
    number: int
    friction: float
    protocol: str
    draws: int
    """Trials with noise here."""
    trials: int
    """Trials with noise in MuJoCo."""
    seed: int

    def posed(self, noise: Noise) -> Posed:
        """Its trials."""
        return Posed(self.object, self.friction, self.protocol, noise, self.seed)


@dataclass(frozen=True)
class Ends:
    """Whether it was held, trial by trial; an empty list of what was not asked."""

    here: bool = False
    """Without noise and disturbance."""
    there: tuple[bool, ...] = ()
    """The same in each of ENGINES."""
    gripped: bool = False
    """Whether the hand gripped in any of these."""
    drawn: tuple[bool, ...] = ()
    """With noise here."""
    drawn_there: tuple[bool, ...] = ()
    """With noise in MuJoCo."""


def run_engines(folder: Path, job: Job, cancel: Cancel) -> Ends:
    """A grasp in all engines, and the same draws of noise and disturbance in two."""
    grasps, trials = trials_of(folder, job.posed(LITTLE))
    grasp = sampled(grasps, trials, job.number)
    likely = Trial(trials, grasp, -1)
    here, there = likely.here(cancel), [likely.there(how, cancel) for how in ENGINES]
    noisy = [Trial(trials, grasp, k, STRENGTH) for k in range(job.draws)]
    drawn = [trial.here(cancel).held for trial in noisy]
    drawn_there = [trial.there(ENGINES[0], cancel).held for trial in noisy]
    gripped = any(end.gripped for end in (here, *there))
    held = tuple(end.held for end in there)
    return Ends(here.held, held, gripped, tuple(drawn), tuple(drawn_there))


def run_noise(folder: Path, job: Job, cancel: Cancel) -> Ends:
    """A grasp under other draws of the same noise in both engines."""
    grasps, trials = trials_of(folder, job.posed(MUCH))
    grasp = sampled(grasps, trials, job.number)
    ours, theirs = range(job.draws), range(THERE, THERE + job.trials)
    drawn = [Trial(trials, grasp, k).here(cancel).held for k in ours]
    there = [Trial(trials, grasp, k).there(OF_NOISE, cancel).held for k in theirs]
    return Ends(drawn=tuple(drawn), drawn_there=tuple(there))


def engines_text(found: dict[Job, Ends]) -> str:
    """Agreement by object, and difference of probabilities."""
    names = list(dict.fromkeys(job.object for job in found))
    head = ["object", "grasps", "gripped", "MuJoCo of one mind", "held there", "alike", "kappa"]
    head += ["of the gripped", "mean here", "mean there", "difference", "trials alike"]
    parts = [[end for job, end in found.items() if job.object == name] for name in names]
    rows = [_engines_row(name, ends) for name, ends in zip(names, parts, strict=True)]
    rows.append(_engines_row("**all**", list(found.values())))
    return markdown_table(head, rows, ["left", *["right"] * (len(head) - 1)])


def noise_text(found: dict[Job, Ends]) -> str:
    """How well the belief's probabilities foresee MuJoCo's rates."""
    here = np.array([np.mean(end.drawn) for end in found.values()])
    there = np.array([np.mean(end.drawn_there) for end in found.values()])
    trials = len(next(iter(found.values())).drawn_there)
    outcomes = np.array([end.drawn_there for end in found.values()], dtype=float)
    spread = np.repeat(here, trials)
    # The rate of n trials is off by itself: their own variance is too small by 1/n.
    oracle = float(np.mean(there * (1 - there))) * trials / max(1, trials - 1)
    share = float(there.mean())
    head = ["grasps", "trials", "held there", "held here", "Brier", "of the oracle", "of the share"]
    head += ["calibration error", "difference of rates"]
    row = [str(len(found)), str(outcomes.size), f"{share:.3f}", f"{here.mean():.3f}"]
    row += [f"{brier(spread, outcomes.ravel()):.4f}", f"{oracle:.4f}", f"{share * (1 - share):.4f}"]
    row += [
        f"{calibration_error(spread, outcomes.ravel()):.3f}",
        f"{np.abs(here - there).mean():.3f}",
    ]
    return markdown_table(head, [row], ["right"] * len(head))


def _engines_row(name: str, ends: Sequence[Ends]) -> list[str]:
    here, there = np.array([end.here for end in ends]), np.array([end.there for end in ends])
    gripped = np.array([end.gripped for end in ends])
    one_mind = there.all(axis=1) | ~there.any(axis=1)
    held = there[:, 0]
    chosen, closer = one_mind, one_mind & gripped
    row = [name, str(len(ends)), str(gripped.sum()), str(one_mind.sum())]
    row += [_share(held[chosen]), _share(here[chosen] == held[chosen])]
    row += [f"{kappa(here[chosen], held[chosen]):.2f}" if chosen.any() else "-"]
    row += [_share(here[closer] == held[closer])]
    if not ends[0].drawn:
        return [*row, *["-"] * 4]
    drawn, drawn_there = (
        np.array([getattr(end, which) for end in ends]) for which in ("drawn", "drawn_there")
    )
    off = np.abs(drawn.mean(axis=1) - drawn_there.mean(axis=1)).mean()
    row += [f"{drawn.mean():.3f}", f"{drawn_there.mean():.3f}", f"{off:.3f}"]
    return [*row, _share(drawn == drawn_there)]


def _share(values: NDArray[np.bool_]) -> str:
    return f"{values.mean():.1%}" if values.size else "-"
