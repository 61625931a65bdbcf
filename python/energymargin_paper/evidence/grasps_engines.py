"""Grasps in MuJoCo too: held or lost alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel
from energymargin.base.table_text import markdown_table
from energymargin_paper.evidence.grasps_data import (
    LITTLE,
    Posed,
    sampled,
    trials_of,
)
from energymargin_paper.evidence.grasps_mujoco import SOFTNESSES, Engine, Trial
from energymargin_paper.evidence.grasps_numbers import kappa

__all__ = ["Ends", "Job", "engines_text", "run_engines"]

STEPS = (1 / 240, 1 / 960)  # s, of ours
ENGINES = tuple(Engine(step, *soft) for step in (5e-4, 2.5e-4) for soft in SOFTNESSES)
DRAWN_THERE = ENGINES[:: len(SOFTNESSES)]
STRENGTH = 1.0  # of the disturbances, as a share of the protocol's bounds


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
    seed: int


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
    grasps, trials = trials_of(
        folder, Posed(job.object, job.friction, job.protocol, LITTLE, job.seed)
    )
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
