"""Policies in the loop: open and closed, a learned one, others' environments.

Each part is a module with `cases`, `run` and `report`; the study runs the cases of all parts on a
pool, keeps a line for each, and puts the reports on one page.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from energymargin._core import Cancel
from energymargin.base.checks import one_of, whole_number
from energymargin.base.plausibility import PlausibilityWarning
from energymargin.base.table_text import csv_text
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["PARTS", "STUDY", "Found", "Looped", "Settings"]

PARTS = ("loops", "learned", "fetch", "pusht")
CASES_FILE = "cases.jsonl"

Found = dict[str, Any]
"""What came out of a case, by name; as JSON holds it."""


class Part(Protocol):
    """A module `policies_...` of one part."""

    TITLE: str

    def cases(self, settings: Any) -> list[str]:
        """The names of its cases."""
        ...

    def run(self, case: str, settings: Any, cancel: Cancel) -> Found:
        """What comes out of one."""
        ...

    def report(self, settings: Any, found: dict[str, Found]) -> str:
        """Its tables and sentences."""
        ...

    def draw(self, ax: Axes, found: dict[str, Found]) -> None:
        """Its picture."""
        ...


@dataclass(frozen=True)
class Settings:
    """Settings of the study; raises ValueError on what cannot be."""

    parts: tuple[str, ...] = setting(PARTS, "Parts, separated by commas.")
    rollouts: int = setting(
        30, "Rollouts of a probability, ten times as many where they are quick."
    )
    worlds: int = setting(200, "Held-out worlds in which each controller runs.")
    episodes: int = setting(100, "Episodes of each learned policy.")
    questions: int = setting(300, "Questions about each environment of others.")
    seed: int = setting(0, "Of everything that is drawn.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        for part in self.parts:
            one_of("parts", part, PARTS)
        for name in ("rollouts", "worlds", "episodes", "questions"):
            whole_number(name, getattr(self, name), 1)
        whole_number("seed", self.seed, 0)


@dataclass(frozen=True)
class Job:
    """A case, with the settings that it depends on."""

    version: str
    part: str
    case: str
    rollouts: int
    worlds: int
    episodes: int
    questions: int
    seed: int


@dataclass(frozen=True, eq=False)
class Row:
    """What came out of it."""

    found: Found


@dataclass(frozen=True, eq=False)
class Looped:
    """What came out, by part and case, and the parts that are left out, with the reason."""

    settings: Settings
    found: dict[str, dict[str, Found]]
    left_out: dict[str, str]

    def to_markdown(self) -> str:
        """A section for each part."""
        sections = [
            f"## {part_of(name).TITLE}\n\n"
            + (self.left_out.get(name) or part_of(name).report(self.settings, self.found[name]))
            for name in self.settings.parts
        ]
        s = self.settings
        said = (
            f"Made with the seed {s.seed}: {s.rollouts} rollouts of a probability, ten times as "
            f"many where they are quick, {s.worlds} held-out worlds, {s.episodes} episodes of each "
            f"learned policy, {s.questions} questions about each environment of others."
        )
        return "\n\n".join(["# Policies in the loop", said, *sections]) + "\n"

    def to_csv(self) -> str:
        """A line for each case."""
        rows = [
            (part, case, json.dumps(found))
            for part, cases in self.found.items()
            for case, found in cases.items()
        ]
        return csv_text(("part", "case", "found"), rows)


class PoliciesStudy(Study[Settings, Looped]):
    """How robust controllers and policies are, told with them in the loop.

    Four parts: open and closed loops on four tasks; a learned policy;
    FetchPush of gymnasium-robotics; gym-pusht. The last two need those packages, and say so where
    they are not there.

    The folder gets policies.md, policies.csv, policies.png and cases.jsonl, a line for each case.

    Example: `energymargin reproduce policies --parts loops,learned`
    """

    name = "policies"
    title, unit = "Closing loops", "cases"
    settings = Settings()
    quick = Settings(rollouts=4, worlds=4, episodes=4, questions=6)
    packages = ("mujoco", "gymnasium-robotics", "gym-pusht")
    improved = True

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Looped:
        """Runs the cases that the folder does not have yet, without warnings of what is meant: a
        heavy arm, pads that twist, a score of a state that is about to be lost."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PlausibilityWarning)
            return self._compute(settings, folder, threads, progress)

    def _compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Looped:
        left_out = {name: why for name in settings.parts if (why := _lacks(name))}
        release = version("energymargin")
        shared = (settings.rollouts, settings.worlds, settings.episodes, settings.questions)
        jobs = [
            Job(release, name, case, *shared, settings.seed)
            for name in settings.parts
            if name not in left_out
            for case in part_of(name).cases(settings)
        ]
        rows = resumed(
            folder / CASES_FILE,
            jobs,
            lambda job, cancel: Row(part_of(job.part).run(job.case, settings, cancel)),
            threads,
            lines=pairs(Job, Row),
            progress=progress,
        )
        found: dict[str, dict[str, Found]] = {name: {} for name in settings.parts}
        for job, row in rows.items():
            found[job.part][job.case] = row.found
        return Looped(settings, found, left_out)

    def figures(self, result: Looped) -> Iterator[tuple[str, Figure]]:
        """A picture of each part that was made."""
        from matplotlib.figure import Figure

        shown = [name for name in result.settings.parts if result.found[name]]
        if shown:
            figure = Figure(figsize=(3.2 * len(shown), 3.2), dpi=120, layout="constrained")
            grid = figure.subplots(1, len(shown), squeeze=False)
            for ax, name in zip(grid[0], shown, strict=True):
                part_of(name).draw(ax, result.found[name])
                ax.set_title(part_of(name).TITLE, fontsize=9)
                ax.tick_params(labelsize=7)
            yield "policies.png", figure


STUDY = PoliciesStudy()


def part_of(name: str) -> Part:
    """The module of a part."""
    module: Any = import_module(f"energymargin_paper.evidence.policies_{name}")
    return module  # type: ignore[no-any-return]


def _lacks(name: str) -> str:
    """Why a part is left out; empty if nothing is missing."""
    lacks = getattr(part_of(name), "lacks", None)
    return lacks() if lacks else ""
