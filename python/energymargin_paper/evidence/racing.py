"""Whether a race chooses what a whole comparison chooses, and what it saves: fields of pushes.

A field is twelve pushes. Either one state has twelve plans, each a steady force of its own size and
direction; or twelve trajectories of the task are asked about the rest of their scripts.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from energymargin import disturbances, tasks
from energymargin._core import Cancel, Plan, Problem
from energymargin.actions import rank
from energymargin.checks import whole_number
from energymargin.table_text import csv_text, markdown_table
from energymargin.tasks.base import STEP
from energymargin.tasks.push import PushTask
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

__all__ = ["KINDS", "STUDY", "Field", "Found", "Racing", "Settings", "pushes"]

KINDS = ("plans", "starts")
FIELDS_FILE = "fields.jsonl"
CANDIDATES = 12
FRAME = 1  # of a trajectory, at which it is asked
HORIZON = 1.5  # s
SIDEWAYS = 3.0  # N, of a plan's force, to both sides
AHEAD = (6.0, 12.0)  # N


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    fields: int = setting(50, "Fields of each kind and strength.")
    strengths: tuple[float, ...] = setting((1.0, 2.0, 3.0), "Of the disturbances.")
    rollouts: int = setting(200, "Of a whole comparison, for each push.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        whole_number("fields", self.fields, 1)
        whole_number("rollouts", self.rollouts, 1)


@dataclass(frozen=True)
class Field:
    """Twelve pushes that are compared."""

    kind: str
    """Of KINDS."""
    seed: int
    strength: float
    rollouts: int


@dataclass(frozen=True)
class Found:
    """A race, and the whole comparison."""

    same: bool
    """Whether both choose the same push."""
    as_good: bool
    """Whether the race's has the best probability of the whole comparison."""
    saved: float
    """Share of the steps that the race does without."""
    seconds: float
    """Of the race [s]."""


@dataclass(frozen=True)
class Racing:
    """What came out."""

    settings: Settings
    found: dict[Field, Found]

    def to_markdown(self) -> str:
        """A line for each kind and strength."""
        keys = [(kind, s) for kind in KINDS for s in self.settings.strengths]
        rows = [self._row(kind, strength) for kind, strength in keys]
        header = ["", "strength", "fields", "same choice", "as good", "steps saved, median"]
        header += ["10 %", "at least half", "race [s], median", "most"]
        text = (
            f"Fields of {CANDIDATES} pushes over {HORIZON:g} s: a race against a comparison of "
            f"{self.settings.rollouts} rollouts each. *As good*: the race's choice has the best "
            "probability of the whole comparison, if not alone."
        )
        return f"# Races\n\n{text}\n\n{markdown_table(header, rows)}\n"

    def _row(self, kind: str, strength: float) -> list[str]:
        own = [
            f for field, f in self.found.items() if (field.kind, field.strength) == (kind, strength)
        ]
        saved, seconds = np.array([f.saved for f in own]), np.array([f.seconds for f in own])
        return [
            *(kind, f"{strength:g}", f"{len(own)}", f"{sum(f.same for f in own)}"),
            *(f"{sum(f.as_good for f in own)}", f"{np.median(saved):.0%}"),
            *(f"{np.quantile(saved, 0.1):.0%}", f"{int((saved >= 0.5).sum())}"),
            *(f"{np.median(seconds):.2f}", f"{seconds.max():.2f}"),
        ]

    def to_csv(self) -> str:
        """A line for each field."""
        rows = [
            (f.kind, f.seed, f.strength, r.same, r.as_good, r.saved, r.seconds)
            for f, r in self.found.items()
        ]
        return csv_text(("kind", "seed", "strength", "same", "as good", "saved", "seconds"), rows)


class RacingStudy(Study[Settings, Racing]):
    """Whether a race of twelve pushes chooses what a whole comparison does, and what it saves.

    The folder gets racing.md and racing.csv. It takes some five minutes; stopped, the same command
    goes on. Each race has all threads.

    Example: `energymargin reproduce racing --fields 20`
    """

    name = "racing"
    title, unit = "Racing", "fields"
    settings = Settings()
    quick = Settings(fields=5)

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Racing:
        """One field after the other."""
        fields = [
            Field(kind, seed, strength, settings.rollouts)
            for kind in KINDS
            for strength in settings.strengths
            for seed in range(settings.fields)
        ]
        found = resumed(
            folder / FIELDS_FILE,
            fields,
            lambda field, cancel: run(field, threads, cancel),
            1,
            lines=pairs(Field, Found),
            progress=progress,
        )
        return Racing(settings, found)


STUDY = RacingStudy()


def pushes(kind: str, seed: int) -> list[Problem]:
    """The candidates of a field."""
    task = tasks.make("push", friction=0.3)
    assert isinstance(task, PushTask)
    if kind == "plans":
        return _plans(task, seed)
    rollouts = [task.rollout(seed=CANDIDATES * seed + number) for number in range(CANDIDATES)]
    return [
        task.future(push.states[FRAME], push.times[FRAME], push.params, horizon=HORIZON)
        for push in rollouts
    ]


def run(field: Field, threads: int, cancel: Cancel) -> Found:
    """The race, and the whole comparison."""
    problems = pushes(field.kind, field.seed)
    ranked = partial(
        rank,
        problems,
        disturbance=disturbances.Uniform(field.strength),
        rollouts=field.rollouts,
        seed=field.seed,
        threads=threads,
        cancel=cancel,
    )
    begun = time.monotonic()
    race = ranked()
    seconds = time.monotonic() - begun
    whole = ranked(race=False)
    return Found(
        same=race.best == whole.best,
        as_good=whole[race.best].score == whole.standings[0].score,
        saved=1.0 - race.steps / whole.steps,
        seconds=seconds,
    )


def _plans(task: PushTask, seed: int) -> list[Problem]:
    """Steady forces on one state. A box at the wall is not lost, or hardly any would hold."""
    random, push = np.random.default_rng(seed), task.rollout(seed=seed)
    state, begun = push.states[FRAME], push.times[FRAME]
    future = task.future(state, begun, push.params, horizon=HORIZON)
    assert future.succeeded is not None
    kept = future.captured | future.succeeded
    problems = []
    for _ in range(CANDIDATES):
        rows = np.zeros((round(HORIZON / STEP), 6))
        rows[:, :2] = random.uniform(-SIDEWAYS, SIDEWAYS), random.uniform(*AHEAD)
        plan = Plan(STEP, wrenches={"effector": rows})
        problems.append(future.replace(plan=plan, captured=kept))
    return problems
