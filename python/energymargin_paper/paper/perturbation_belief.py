"""What a belief regains of the AP that errors of the model cost, at equal simulation steps.

The states are those of the perturbation study at half of the largest error. Who scores them knows
how large the errors may be, and not what they are: a score is the mean over particles of that
belief. Of velocities it is also known how other pushes move at that time. A reference with many
more steps says what can be regained at all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Cancel
from energymargin.base.limits import Limit
from energymargin.base.table_text import markdown_table
from energymargin.beliefs import Belief, Uncertainty
from energymargin.datasets import Dataset
from energymargin.evaluate.belief_scoring import score_beliefs
from energymargin.evaluate.scoring import score
from energymargin.evaluate.searches import SearchSettings
from energymargin.executors import Threads
from energymargin.records.datasets.generation import generate
from energymargin.tasks.push import FRICTION_MIDDLE, scene
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.paper.perturbation_errors import BODIES, LARGEST, Perturbed
from energymargin_paper.paper.prior import ContradictionError, informed, velocities
from energymargin_paper.paper.quality import FRAMES, TASK, interval

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "INFORMED",
    "KNOWN",
    "LEVEL",
    "Regained",
    "believed_scores",
    "figure_belief",
    "priors",
    "regained_markdown",
    "uncertainty",
]

KNOWN = ("position", "velocity")
"""The errors whose size is known."""
LEVEL = 0.5  # scaled largest error
TOLD_SHARE = 0.5  # of what the reference regains, that a belief is to regain
INFORMED = ("velocity",)
"""Those of which other pushes tell."""
OTHERS_SEED = 20_000  # far from the seeds of the pushes that are scored

Prior = dict[str, NDArray[np.float64]]
"""Velocities of other pushes, (N, 6), by body."""


@dataclass(frozen=True)
class Job:
    """The states of one trajectory, with one draw of the errors."""

    kind: str
    draw: int
    trajectory: int
    particles: int
    """0: the mean of the belief alone, in one tree."""
    nodes: int
    """Nodes of all particles of a state together."""
    seed: int
    others: int
    """Pushes that are known beforehand."""


@dataclass(frozen=True, eq=False)
class Scored:
    """Its scores."""

    scores: list[float]
    """Score of each state: the mean over the particles."""
    separated: int
    """Particles of all states whose bodies were moved apart."""
    redrawn: int
    """Draws that had no place."""


@dataclass(frozen=True, eq=False)
class Regained:
    """The AP of one kind of error, by draw of the errors, each of shape (draws,)."""

    kind: str
    exact: float
    """Average precision of the true states."""
    wrong: NDArray[np.float64]
    """Average precisions of the states with errors."""
    estimate: NDArray[np.float64]
    """Those of one state in place of a belief: its mean."""
    even: NDArray[np.float64]
    """Those of beliefs that know of no other pushes, at equal steps."""
    belief: NDArray[np.float64]
    """Those of beliefs about them, at equal steps."""
    reference: NDArray[np.float64]
    """Those of beliefs about them, at many more."""
    separated: float
    """Share of the reference's particles whose bodies were moved apart."""
    redrawn: float
    """Draws that had no place, for each of its particles."""

    @property
    def share(self) -> float:
        """Share of the mean gain of the reference that the belief regains at equal steps."""
        lost = float(self.wrong.mean())
        return (float(self.belief.mean()) - lost) / (float(self.reference.mean()) - lost)


def uncertainty(kind: str, scaled: float) -> Uncertainty:
    """What is known of errors of a kind: how large they may be, and that they are uniform."""
    from scipy.stats import uniform

    errors = [uniform(-scaled * one.value, 2 * scaled * one.value) for one in LARGEST[kind]]
    if kind == "position":
        return Uncertainty(pose={body: [*errors * 2, 0, 0, 0, 0] for body in BODIES})
    along, about = errors
    return Uncertainty(velocity={body: [along, along, 0, 0, 0, about] for body in BODIES})


def priors(others: int) -> list[Prior]:
    """Velocities of so many other pushes in each frame."""
    dataset = generate(TASK, trajectories=others, frames=FRAMES, seed=OTHERS_SEED)
    states = np.array([trajectory.states for trajectory in dataset.trajectories])
    return [velocities(scene(FRICTION_MIDDLE), states[:, frame]) for frame in range(FRAMES)]


def believed_scores(
    folder: Path,
    wrong: dict[tuple[str, int], Perturbed],
    particles: int,
    *,
    prior: list[Prior] | None,
    settings: SearchSettings,
    threads: int,
    progress: Callable[[int, int], None],
) -> dict[tuple[str, int], tuple[NDArray[np.float64], float, float]]:
    """By kind and draw of the errors: the scores of all states (N,), the share of particles that
    were separated, and the draws without a place for each particle. What the folder has is kept.

    `particles`: 0 scores the mean of each belief. `prior`: of each frame.
    """
    first = next(iter(wrong.values())).dataset
    others = 0 if prior is None else len(prior[0][BODIES[0]])
    jobs = [
        Job(kind, draw, number, particles, settings.nodes, settings.seed, others)
        for (kind, draw), number in product(wrong, range(len(first.trajectories)))
    ]
    done = resumed(
        folder / "beliefs.jsonl",
        jobs,
        partial(_scored, wrong, settings, prior),
        threads,
        lines=pairs(Job, Scored),
        progress=progress,
    )
    found = {}
    for kind, draw in wrong:
        own = [done[job] for job in jobs if (job.kind, job.draw) == (kind, draw)]
        count = first.size * max(particles, 1)
        found[kind, draw] = (
            np.concatenate([scored.scores for scored in own]),
            sum(scored.separated for scored in own) / count,
            sum(scored.redrawn for scored in own) / count,
        )
    return found


def _scored(
    wrong: dict[tuple[str, int], Perturbed],
    settings: SearchSettings,
    prior: list[Prior] | None,
    job: Job,
    cancel: Cancel,
) -> Scored:
    dataset = wrong[job.kind, job.draw].dataset
    first = int(dataset.lengths[: job.trajectory].sum())
    beliefs = _beliefs(dataset, job.trajectory, uncertainty(job.kind, LEVEL), prior)
    indices, limit = range(first, first + len(beliefs)), Limit(cancel=cancel)
    if not job.particles:
        table = score(
            [belief.estimate for belief in beliefs],
            ["capture"],
            settings=settings,
            indices=indices,
            threads=1,
            cancel=cancel,
        )
        return Scored(table["capture"].tolist(), 0, 0)
    by_index = dict(zip(indices, beliefs, strict=True))
    found = score_beliefs(
        by_index, ["capture"], job.particles, settings, executor=Threads(1), limit=limit
    )
    scores = [of_state["capture"] for of_state in found.values()]
    return Scored(
        [score.mean for score in scores],
        sum(score.particles.separated for score in scores),
        sum(score.particles.redrawn for score in scores),
    )


def _beliefs(
    dataset: Dataset, number: int, known: Uncertainty, prior: list[Prior] | None
) -> list[Belief]:
    """Beliefs about the states of a trajectory; the capture set is that of each particle."""
    task, trajectory = tasks.make(dataset.task, **dataset.parameters), dataset.trajectories[number]
    question = partial(task.problem, params=trajectory.params)
    made = []
    for frame, state in enumerate(trajectory.states):
        belief = Belief(question(state), uncertainty=known, question=question)
        if prior is not None:  # where no other push is like it, what was measured is all there is
            with suppress(ContradictionError):
                belief = informed(belief, prior[frame])
        made.append(belief)
    return made


def regained_markdown(
    found: Sequence[Regained], nodes: int, particles: int, times: int, others: int
) -> list[str]:
    """The table, and what it says."""
    lines = [
        "## With a belief of the errors",
        "",
        f"The same states with errors of the scaled size {LEVEL:g}, and AP of the capture score. "
        f"Belief: the mean over {particles} particles with trees of {nodes // particles} nodes, as "
        f"many steps as one tree of {nodes}. Reference: {times} times the steps, "
        f"{times * particles} particles with trees of {nodes // particles} nodes. Both know how "
        f"{others} other pushes move at that time, which tells of velocities; the belief without "
        f"a prior does not. Best state: the mean of the belief, in one tree of {nodes} nodes. Mean "
        "over the draws of the errors, and Student's 95 % interval of that mean.",
        "",
    ]
    rows = [
        [
            one.kind,
            f"{one.exact:.3f}",
            *map(_cell, (one.wrong, one.estimate, one.even, one.belief, one.reference)),
            f"{100 * one.share:.0f} %",
        ]
        for one in found
    ]
    header = (
        *("errors", "true states", "states with errors", "best state", "belief without a prior"),
        *("belief, equal steps", "reference", "of what the reference regains"),
    )
    lines.append(markdown_table(header, rows, ["left"] + ["right"] * (len(header) - 1)))
    low = [one.kind for one in found if not one.share >= TOLD_SHARE]
    says = f"not with errors of {', '.join(low)}" if low else "with each error"
    lines += [
        "",
        f"- At equal steps a belief regains at least half of what the reference does {says}.",
        *(
            f"- Of the reference's particles with errors of {one.kind}, "
            f"{100 * one.separated:.0f} % had bodies that were moved apart; "
            f"{100 * one.redrawn:.0f} draws for 100 particles had no place and were made again."
            for one in found
            if one.separated or one.redrawn
        ),
        "",
    ]
    return lines


def _cell(aps: NDArray[np.float64]) -> str:
    low, high = interval(aps)
    return f"{aps.mean():.3f}" + (f" ({low:.3f} to {high:.3f})" if high > low else "")


def figure_belief(found: Sequence[Regained]) -> Figure:
    """AP of true states, of those with errors, and of beliefs; a dot is a draw of the errors."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.6), dpi=200, layout="constrained")
    ax = figure.subplots()
    names = (
        *("states with errors", "best state", "belief without a prior"),
        *("belief, equal steps", "belief, reference"),
    )
    colors = ("#D55E00", "#E69F00", "#56B4E9", "#0072B2", "0.6")
    width = 0.16
    for row, one in enumerate(found):
        draws = (one.wrong, one.estimate, one.even, one.belief, one.reference)
        for k, (name, ap, color) in enumerate(zip(names, draws, colors, strict=True)):
            x = row + (k - 2) * width
            label = name if row == 0 else None
            ax.bar(x, ap.mean(), 0.9 * width, color=color, label=label, zorder=2)
            ax.plot(np.full(len(ap), x), ap, "k.", markersize=3, zorder=3)
        ax.plot([row - 0.4, row + 0.4], [one.exact] * 2, "k--", linewidth=1, zorder=4)
        ax.annotate("true states", (row + 0.4, one.exact), fontsize=7, va="bottom", ha="right")
    lowest = min(float(min(one.wrong.min(), one.even.min())) for one in found)
    ax.set_ylim(max(0.0, lowest - 0.05), 1.01)
    ax.set_xticks(range(len(found)), [f"{one.kind} errors of {LEVEL:g}" for one in found])
    ax.set_ylabel("AP of the prediction of capture")
    ax.grid(axis="y", alpha=0.25, linewidth=0.5, zorder=0)
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure
