"""Grasps in MuJoCo too: held or lost alike, and success rates under noise of the pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel
from energymargin.base.table_text import markdown_table
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

STEPS = (1 / 240, 1 / 960)  # s, of ours
ENGINES = tuple(Engine(step, *soft) for step in (5e-4, 2.5e-4) for soft in SOFTNESSES)
DRAWN_THERE = ENGINES[:: len(SOFTNESSES)]
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
    """Whether it was held, trial by trial; empty of what was not asked."""

    here: tuple[bool, ...] = ()
    """Without noise and disturbance, at each of our STEPS."""
    there: tuple[bool, ...] = ()
    """The same in each of ENGINES."""
    gripped: bool = False
    """Whether the hand gripped in any of these."""
    drawn: tuple[tuple[bool, ...], ...] = ()
    """With noise here, at each of our STEPS."""
    drawn_there: tuple[tuple[bool, ...], ...] = ()
    """With noise in each of DRAWN_THERE."""


def run_engines(folder: Path, job: Job, cancel: Cancel) -> Ends:
    """A grasp in all engines, and the same draws of noise and disturbance in both."""
    grasps, trials = trials_of(folder, job.posed(LITTLE))
    grasp = sampled(grasps, trials, job.number)
    steps = [replace(trials, step=step) for step in STEPS]
    here = [Trial(each, grasp, -1).here(cancel) for each in steps]
    there = [Trial(trials, grasp, -1).there(how, cancel) for how in ENGINES]
    draws = range(job.draws)
    drawn = [[Trial(e, grasp, k, STRENGTH).here(cancel).held for k in draws] for e in steps]
    noisy = [Trial(trials, grasp, k, STRENGTH) for k in draws]
    drawn_there = [[trial.there(how, cancel).held for trial in noisy] for how in DRAWN_THERE]
    return Ends(
        tuple(end.held for end in here),
        tuple(end.held for end in there),
        any(end.gripped for end in (*here, *there)),
        tuple(map(tuple, drawn)),
        tuple(map(tuple, drawn_there)),
    )


def run_noise(folder: Path, job: Job, cancel: Cancel) -> Ends:
    """A grasp under other draws of the same noise in both engines."""
    grasps, trials = trials_of(folder, job.posed(MUCH))
    grasp = sampled(grasps, trials, job.number)
    ours, theirs = range(job.draws), range(THERE, THERE + job.trials)
    steps = [replace(trials, step=step) for step in STEPS]
    drawn = tuple(tuple(Trial(e, grasp, k).here(cancel).held for k in ours) for e in steps)
    there = tuple(Trial(trials, grasp, k).there(OF_NOISE, cancel).held for k in theirs)
    return Ends(drawn=drawn, drawn_there=(there,))


def engines_text(found: dict[Job, Ends]) -> str:
    """Agreement by object, and difference of probabilities."""
    groups = {job.object: [e for j, e in found.items() if j.object == job.object] for job in found}
    groups["**all**"] = list(found.values())
    ours = [f"{1e3 * step:.2g} ms" for step in STEPS]
    head = ["object", "grasps", "gripped", "of one mind", "held there"]
    head += [text for step in ours for text in (f"alike at {step}", "kappa")]
    first = markdown_table(
        [*head, f"of the gripped at {ours[-1]}"],
        [_alike(name, ends) for name, ends in groups.items()],
        ["left", *["right"] * len(head)],
    )
    head = ["object", "trials", "held there"]
    head += [text for step in ours for text in (f"held at {step}", "difference", "alike")]
    head += ["MuJoCo at half the step", "difference", "alike"]
    second = markdown_table(
        head,
        [_drawn(name, ends) for name, ends in groups.items()],
        ["left", *["right"] * (len(head) - 1)],
    )
    return f"{first}\n\n{second}"


def noise_text(found: dict[Job, Ends]) -> str:
    """How well the belief's probabilities foresee MuJoCo's rates, at each of our STEPS."""
    outcomes = np.array([end.drawn_there[0] for end in found.values()], dtype=float)
    trials, there = outcomes.shape[1], outcomes.mean(axis=1)
    # The rate of n trials is off by itself: their own variance is too small by 1/n.
    oracle = float(np.mean(there * (1 - there))) * trials / max(1, trials - 1)
    share, rows = float(there.mean()), []
    for k, step in enumerate(STEPS):
        here = np.array([np.mean(end.drawn[k]) for end in found.values()])
        spread = np.repeat(here, trials)
        row = [f"{1e3 * step:.2g} ms", str(len(found)), str(outcomes.size), f"{share:.3f}"]
        row += [f"{here.mean():.3f}", f"{brier(spread, outcomes.ravel()):.4f}", f"{oracle:.4f}"]
        row += [f"{share * (1 - share):.4f}"]
        row += [f"{calibration_error(spread, outcomes.ravel()):.3f}"]
        rows.append([*row, f"{np.abs(here - there).mean():.3f}"])
    head = ["our step", "grasps", "trials there", "held there", "held here", "Brier"]
    head += ["of the oracle", "of the share", "calibration error", "difference of rates"]
    return markdown_table(head, rows, ["right"] * len(head))


def _alike(name: str, ends: Sequence[Ends]) -> list[str]:
    here, there = (np.array([getattr(e, which) for e in ends]) for which in ("here", "there"))
    gripped = np.array([end.gripped for end in ends])
    one_mind = there.all(axis=1) | ~there.any(axis=1)
    held, ours = there[one_mind, 0], here[one_mind].T
    row = [name, str(len(ends)), str(gripped.sum()), str(one_mind.sum()), _share(held)]
    for each in ours:
        row += [_share(each == held), f"{kappa(each, held):.2f}" if held.size else "-"]
    return [*row, _share((ours[-1] == held)[gripped[one_mind]])]


def _drawn(name: str, ends: Sequence[Ends]) -> list[str]:
    ours = np.array([end.drawn for end in ends])
    first, *others = np.array([end.drawn_there for end in ends]).swapaxes(0, 1)
    row = [name, str(first.size), f"{first.mean():.3f}"]
    for each in (*ours.swapaxes(0, 1), *others):
        off = np.abs(each.mean(axis=1) - first.mean(axis=1)).mean()
        row += [f"{each.mean():.3f}", f"{off:.3f}", _share(each == first)]
    return row


def _share(values: NDArray[np.bool_]) -> str:
    return f"{values.mean():.1%}" if values.size else "-"
