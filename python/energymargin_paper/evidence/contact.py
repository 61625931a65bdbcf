"""Are the contacts right? Grips, towers, free motion and walls against what is known on paper.

Every scene of every seed is one line of runs.jsonl in the folder, written as soon as it is
finished: stopped and started again, the study goes on with what is missing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np

from energymargin._core import Cancel
from energymargin.base.checks import whole_number
from energymargin.base.table_text import csv_text, markdown_table
from energymargin_paper.evidence import contact_mug
from energymargin_paper.evidence.contact_checks import CHECKS, Bar, Check
from energymargin_paper.evidence.grasps_numbers import kappa
from energymargin_paper.jobs import Lines, resumed
from energymargin_paper.study import Progress, Study, setting

__all__ = ["STUDY", "Contact", "Job", "MugGrasp", "Settings", "run"]

RUNS_FILE = "runs.jsonl"
GRASPS = 300  # of the mug
GRASP = "mug"  # a job's check, beside CHECKS
AGREEMENT = 0.95  # asked, of the grasps of which MuJoCo is sure
LOST = 0.25  # of the grasps, at least: where all are held, to agree is easy
MUG_FRICTION = 0.3  # of mug and hand
STALLED = 5  # steps that stand still
FASTER, SPARE = 1.5, 0.2  # times MuJoCo's fastest speed and m/s beyond it: the mug is thrown


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    percent: int = setting(100, "Percentage of each check's seeds; at least one is run.")
    grasps: int = setting(
        GRASPS, f"Grasps of a mug, from the folder that {contact_mug.FOLDER} names."
    )
    seed: int = setting(0, "The first seed; the others follow.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        whole_number("percent", self.percent, 1)
        whole_number("grasps", self.grasps, 0)
        whole_number("seed", self.seed, 0, 2**31 - 1)


@dataclass(frozen=True)
class Job:
    """One scene."""

    version: str
    check: str
    """One of CHECKS, or GRASP."""
    seed: int
    """Seed of the check; of a grasp its number in the file."""


@dataclass(frozen=True, eq=False)
class Contact:
    """What was measured, by job; of a grasp nothing if it overlaps at the start."""

    found: dict[Job, tuple[float, ...]]

    def of(self, check: str) -> list[tuple[float, ...]]:
        """All that was measured of a check."""
        return [values for job, values in self.found.items() if job.check == check]

    def to_csv(self) -> str:
        """A line for each quantity of each scene."""
        header = ("check", "seed", "quantity", "low", "high", "value")
        rows = [
            (job.check, job.seed, bar.quantity, bar.low, bar.high, value)
            for job, values in self.found.items()
            for bar, value in zip(_bars(job.check), values, strict=False)
        ]
        return csv_text(header, rows)

    def to_markdown(self) -> str:
        """What is asked, what was measured, and how often it held; each failure by its seed."""
        lines = ["# Contacts", "", "At the default settings of a scene.", ""]
        header = ["", "quantity", "asked", "median", "worst", "held"]
        rows = [row for check in CHECKS.values() for row in _rows(check, self.of(check.name))]
        align = ["left", "left", *["right"] * 4]
        lines += [markdown_table(header, rows, align), *self._mug(), "", "## What did not hold", ""]
        lines += [*self._failures()] or ["Nothing."]
        return "\n".join(lines) + "\n"

    def _grasps(self) -> list[MugGrasp]:
        return [MugGrasp(*values) for values in self.of(GRASP) if values]

    def _mug(self) -> Iterator[str]:
        grasps = self._grasps()
        if not grasps:
            yield from ("", f"Grasps of a mug are left out: they need {contact_mug.FOLDER}.")
            return
        pairs = [(bool(g.held), bool(g.held_there)) for g in grasps if g.is_sure]
        yield from ("", "## Grasps of a mug", "")
        yield (
            f"{len(grasps)} grasps that begin free of overlap, friction {MUG_FRICTION:g}; MuJoCo "
            f"says the same at both steps and softnesses of {len(pairs)}. Cohen's kappa there is "
            f"{kappa(*np.array(pairs).T) if pairs else math.nan:.2f}."
        )
        yield ""
        rows = [(bar.name, bar.asked, bar.measured) for bar in self._mug_bars()]
        yield markdown_table(("", "asked", "measured"), rows, ["left", "right", "right"])

    def _mug_bars(self) -> Iterator[_MugBar]:
        grasps = self._grasps()
        sure = [g for g in grasps if g.is_sure]
        alike = tuple(g.held == g.held_there for g in sure)
        yield _MugBar("held or lost as in MuJoCo", alike, AGREEMENT)
        alike = tuple(g.held_hard == g.held_there for g in sure)
        yield _MugBar("the same in MuJoCo, nearly rigid", alike)
        yield _MugBar("lost in MuJoCo", tuple(not g.held_there for g in sure), LOST)
        yield _MugBar("time lost", tuple(g.still > STALLED for g in grasps), none=True)
        yield _MugBar("thrown by the closing hand", tuple(g.is_thrown for g in grasps), none=True)

    def _failures(self) -> Iterator[str]:
        for check in CHECKS.values():
            seeds = [
                str(job.seed)
                for job, values in self.found.items()
                if job.check == check.name and not check.holds(values)
            ]
            if seeds:
                yield f"- {check.name}: seeds {', '.join(seeds)}"
        for bar in self._mug_bars():
            if not bar.holds:
                yield f"- grasps of a mug, {bar.name}: {bar.measured}, asked {bar.asked}"


class MugGrasp(NamedTuple):
    """What is measured of a grasp of the mug."""

    held: float
    held_there: float
    """In MuJoCo; nan where that depends on its step or softness."""
    held_hard: float
    """In MuJoCo, nearly rigid."""
    still: float
    """Steps that stand still."""
    fastest: float
    """Largest speed of the mug here [m/s]."""
    fastest_there: float

    @property
    def is_sure(self) -> bool:
        """Whether MuJoCo says the same at both steps and softnesses."""
        return not math.isnan(self.held_there)

    @property
    def is_thrown(self) -> bool:
        """Whether the hand throws it much faster than in MuJoCo, where some are squeezed out."""
        return self.fastest > FASTER * self.fastest_there + SPARE


@dataclass(frozen=True)
class _MugBar:
    """Of which grasps something is true, and of which share it should be."""

    name: str
    true: tuple[bool, ...]
    least: float = 0.0
    none: bool = False

    @property
    def asked(self) -> str:
        return "none" if self.none else f"at least {self.least:.0%}" if self.least else ""

    @property
    def measured(self) -> str:
        return f"{sum(self.true)} of {len(self.true)}"

    @property
    def holds(self) -> bool:
        return not any(self.true) if self.none else sum(self.true) >= self.least * len(self.true)


def _bars(check: str) -> tuple[Bar, ...]:
    if check in CHECKS:
        return CHECKS[check].bars
    held = "held here", "held in MuJoCo", "held in MuJoCo, nearly rigid"
    rest = "steps that stand still", "fastest here [m/s]", "fastest in MuJoCo [m/s]"
    return tuple(Bar(name) for name in (*held, *rest))


def _rows(check: Check, values: Sequence[tuple[float, ...]]) -> Iterator[list[str]]:
    """A line for each quantity; the first one says how often all of them held."""
    held = f"{sum(check.holds(found) for found in values)} of {len(values)}"
    for number, bar in enumerate(check.bars):
        column = [found[number] for found in values]
        if column:
            numbers = [f"{median(column):.3g}", f"{bar.worst(column):.3g}"]
            first = number == 0
            yield [check.name if first else "", bar.quantity, str(bar), *numbers, held * first]


class ContactStudy(Study[Settings, Contact]):
    """Whether contacts are right: grips, towers, free motion and walls against paper.

    Grips hold below the limit of friction and slip above it, off their centre and under loads
    across as well; towers, an arch and a house of cards stand; what flies keeps its momentum, what
    spins and slides is braked as by Coulomb; nothing gets through walls. With the folder of
    ACRONYM's mug in the environment variable ENERGYMARGIN_GRASPS also 300 grasps, against MuJoCo.

    The folder gets contact.md, contact.csv and runs.jsonl, one line a scene. Stop it with Ctrl-C:
    the same command goes on from there.

    Example: `energymargin reproduce contact --percent 10`
    """

    name = "contact"
    title, unit = "Touching", "scenes"
    settings = Settings()
    quick = Settings(percent=4, grasps=4)
    packages = ("mujoco",)
    folders = (contact_mug.FOLDER,)
    improved = True

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Contact:
        """Runs every scene that is not in the folder yet."""
        path, jobs = folder / RUNS_FILE, list(_jobs(settings))
        lines = Lines(_from_json, _to_json)
        return Contact(resumed(path, jobs, run, threads, lines=lines, progress=progress))


STUDY = ContactStudy()


def _jobs(settings: Settings) -> Iterator[Job]:
    program = version("energymargin")
    for check in CHECKS.values():
        for number in range(max(1, check.count * settings.percent // 100)):
            yield Job(program, check.name, settings.seed + number)
    if settings.grasps and (grasps := contact_mug.given()):
        for number in grasps.chosen(settings.grasps, settings.seed):
            yield Job(program, GRASP, number)


def run(job: Job, cancel: Cancel | None = None) -> tuple[float, ...]:
    """What one scene measures."""
    if job.check != GRASP:
        return tuple(map(float, CHECKS[job.check].measure(job.seed)))
    grasps = contact_mug.given()
    if grasps is None:
        raise ValueError(f"{contact_mug.FOLDER} is not set, expected the folder of the grasps")
    try:
        grasp = grasps.grasp(job.seed, MUG_FRICTION)
    except ValueError:  # the hand is in the mug
        return ()
    ours, theirs = contact_mug.here(grasp), contact_mug.there(grasp)
    sure = math.nan if theirs.held is None else float(theirs.held)
    held = float(ours.held), sure, float(theirs.held_hard)
    return MugGrasp(*held, float(ours.still), ours.fastest, theirs.fastest)


def _to_json(job: Job, values: tuple[float, ...]) -> str:
    return json.dumps([asdict(job), values])


def _from_json(line: str) -> tuple[Job, tuple[float, ...]]:
    job, values = json.loads(line)
    return Job(**job), tuple(values)
