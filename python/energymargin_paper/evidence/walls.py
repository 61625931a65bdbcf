"""Does anything get through a wall? Searches in closed cages, and shots at walls.

Every search and every shot is one line of runs.jsonl in the folder, written as soon as it is
finished: stopped and started again, the study goes on with what is missing.
"""

from __future__ import annotations

import json
import math
import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import asdict, astuple, dataclass, fields
from importlib.metadata import version
from pathlib import Path

from energymargin._core import Cancel, escape_effort
from energymargin.checks import whole_number
from energymargin.plausibility import PlausibilityWarning
from energymargin.table_text import csv_text, markdown_table
from energymargin_paper.evidence import cages, projectiles
from energymargin_paper.jobs import Lines, resumed
from energymargin_paper.study import Progress, Study, setting

__all__ = ["PLANNERS", "SHOT", "STUDY", "Job", "Outcome", "Settings", "Walls", "run"]

PLANNERS = ("est", "rrt")
SHOT = "shot"
SLOW = 60.0  # s, beyond which a search or shot is named in the report
RUNS_FILE = "runs.jsonl"
TITLES = {
    "est": "Closed cages, searched with AO-EST",
    "rrt": "Closed cages, searched with AO-RRT",
    SHOT: "Shots",
}


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    cages: int = setting(1000, "Closed cages, each with two searches.")
    shots: int = setting(10_000, "Projectiles at walls.")
    nodes: int = setting(400, "Nodes of each search.")
    seed: int = setting(0, "Seed of the first cage and the first shot; the others follow.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        whole_number("cages", self.cages, 0)
        whole_number("shots", self.shots, 0)
        whole_number("nodes", self.nodes, 1)
        whole_number("seed", self.seed, 0, 2**63 - 1)
        if self.cages + self.shots == 0:
            raise ValueError("cages and shots are 0, expected at least one of them above")


@dataclass(frozen=True)
class Job:
    """One search in a cage, or one shot."""

    version: str
    kind: str
    """One of PLANNERS, or SHOT."""
    seed: int
    nodes: int
    """0 of a shot."""


@dataclass(frozen=True)
class Outcome:
    """What came out of a job."""

    kind: str
    seed: int
    nodes: int
    case: str
    """One of the shots' cases; "cage"."""
    walls: str
    object: str
    thickness: float
    """Of the walls [m]."""
    strength: float
    """Bound on the force in weights of the object, or speed [m/s]."""
    result: float
    """Effort of escape [J]; of a shot, how far a part got beyond a middle plane [m]."""
    seconds: float
    """It took, on one thread [s]."""

    @property
    def passed(self) -> bool:
        """Whether something got through."""
        return self.result > 0.0 if self.kind == SHOT else self.result < math.inf


@dataclass(frozen=True)
class Walls:
    """The result."""

    rows: list[Outcome]

    @property
    def passed(self) -> list[Outcome]:
        """Where something got through."""
        return [row for row in self.rows if row.passed]

    def to_csv(self) -> str:
        """One line for each search and shot."""
        header = (*(field.name for field in fields(Outcome)), "passed")
        return csv_text(header, [(*astuple(row), int(row.passed)) for row in self.rows])

    def to_markdown(self) -> str:
        """A table by walls and objects for each planner and for the shots; each passage by seed."""
        lines = ["# Walls", "", "How many got through, of how many."]
        for kind, title in TITLES.items():
            rows = [row for row in self.rows if row.kind == kind]
            if rows:
                lines += ["", f"## {title}", "", _table(rows)]
        lines += ["", "## What got through", ""]
        lines += [_line(row) for row in self.passed] or ["Nothing."]
        slow = [row for row in self.rows if row.seconds > SLOW]
        lines += ["", f"## What took more than {SLOW:g} s", ""]
        lines += [f"{_line(row)}: {row.seconds:.0f} s" for row in slow] or ["Nothing."]
        return "\n".join(lines) + "\n"


def _table(rows: Sequence[Outcome]) -> str:
    """Shots by case and wall, cages by wall; a column for each kind of object, and one for all."""
    objects = [name for name in projectiles.PROJECTILES if any(row.object == name for row in rows)]

    def shares(of: Sequence[Outcome]) -> list[str]:
        return [_share([row for row in of if row.object == name]) for name in objects]

    lines = []
    for case, walls in sorted({(row.case, row.walls) for row in rows}):
        of = [row for row in rows if (row.case, row.walls) == (case, walls)]
        lines.append([f"{case}, {walls}", *shares(of), _share(of)])
    lines.append(["all", *shares(rows), f"**{_share(rows)}**"])
    return markdown_table(["", *objects, "all"], lines)


def _share(rows: Sequence[Outcome]) -> str:
    return f"{sum(row.passed for row in rows)} of {len(rows)}" if rows else ""


def _line(row: Outcome) -> str:
    """A row in words, with all that it takes to make it again."""
    place = f"{row.walls}, {row.object}, {1e3 * row.thickness:.2f} mm"
    if row.kind == SHOT:
        what = f"random_shot({row.seed}): {row.case}, {place}, {row.strength:.1f} m/s"
        return f"- {what}, {1e3 * row.result:.2f} mm"
    what = f"random_cage({row.seed}), {row.kind}: {place}, {row.strength:.1f} weights"
    return f"- {what}, {row.result:.4g} J"


class WallsStudy(Study[Settings, Walls]):
    """Whether anything gets through a wall: searches in closed cages, and shots at walls.

    Cages of boxes, compounds, hulls and meshes, searched with AO-EST and AO-RRT: every effort is to
    be infinite. Projectiles at 1 to 20 m/s at walls of 1 to 10 mm, at walls that move, and struck
    by a paddle: none is to get beyond a wall's middle.

    The folder gets walls.md, walls.csv and runs.jsonl, one line a search or shot. It takes hours;
    stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce walls --cages 100 --shots 1000`
    """

    name = "walls"
    title, unit = "Searching and shooting", "searches and shots"
    settings = Settings()
    quick = Settings(cages=12, shots=200, nodes=50)

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Walls:
        """Makes every search and shot that is not in the folder yet."""
        path, lines = folder / RUNS_FILE, Lines(_from_json, _to_json)
        with warnings.catch_warnings():
            # Random scenes float and are heavy.
            warnings.simplefilter("ignore", PlausibilityWarning)
            rows = resumed(
                path, list(_jobs(settings)), run, threads, lines=lines, progress=progress
            )
        return Walls(list(rows.values()))


STUDY = WallsStudy()


def _jobs(settings: Settings) -> Iterator[Job]:
    program = version("energymargin")
    for seed in range(settings.seed, settings.seed + settings.cages):
        for planner in PLANNERS:
            yield Job(program, planner, seed, settings.nodes)
    for seed in range(settings.seed, settings.seed + settings.shots):
        yield Job(program, SHOT, seed, 0)


def _to_json(job: Job, row: Outcome) -> str:
    return json.dumps({**asdict(job), **asdict(row)})


def _from_json(line: str) -> tuple[Job, Outcome]:
    values = json.loads(line)
    job = {field.name: values[field.name] for field in fields(Job)}
    return Job(**job), Outcome(**{field.name: values[field.name] for field in fields(Outcome)})


def run(job: Job, cancel: Cancel | None = None) -> Outcome:
    """One search or shot. Once `cancel` is set, a search ends early and a shot raises Cancelled."""
    begun = time.perf_counter()
    if job.kind == SHOT:
        shot = projectiles.random_shot(job.seed)
        about = (shot.case, shot.walls, shot.object, shot.thickness, shot.speed)
        result = projectiles.depth(shot, cancel=cancel)
    else:
        cage = cages.random_cage(job.seed)
        about = ("cage", cage.walls, cage.object, cage.thickness, cage.weights)
        search = escape_effort(
            cage.problem,
            planner=job.kind,
            nodes=job.nodes,
            seed=job.seed,
            search="improved",
            cancel=cancel,
        )
        result = search.effort
    return Outcome(job.kind, job.seed, job.nodes, *about, result, time.perf_counter() - begun)
