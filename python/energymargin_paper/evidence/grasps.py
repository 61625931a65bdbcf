"""Grasps that others made: does their robot, their engine and MuJoCo lose what is lost here?"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from energymargin.base.checks import not_negative_number, one_of, whole_number
from energymargin.base.plausibility import PlausibilityWarning
from energymargin.base.table_text import csv_text
from energymargin.grasps.protocols import PRESETS
from energymargin.model.scenes.mjcf_model import engine
from energymargin_paper.evidence.grasps_data import (
    FOLDER,
    MUG,
    OF_ROBOT,
    PAIRED,
    data_folder,
)
from energymargin_paper.evidence.grasps_engines import (
    Ends,
    Job,
    engines_text,
    run_engines,
)
from energymargin_paper.evidence.grasps_labels import (
    Asked,
    Contradiction,
    Labelled,
    of_engine,
    of_robot,
)
from energymargin_paper.jobs import Lines, resumed
from energymargin_paper.study import Progress, Study, setting

__all__ = ["PARTS", "STUDY", "Grasps", "Settings"]

PARTS = ("a", "b", "c")


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    data: str = setting("", "Folder with graspa/ and acronym/.", shown=FOLDER)
    parts: tuple[str, ...] = setting(PARTS, "Parts, separated by commas.")
    objects: tuple[str, ...] = setting(PAIRED, "Objects of a, separated by commas.")
    grasps: int = setting(40, "Grasps of each object of a.")
    draws: int = setting(8, "Trials of a grasp with noise, in both engines of a.")
    friction: float = setting(0.4, "Coefficient of friction of a.")
    protocol: str = setting("shake", "Protocol of a.")
    every: int = setting(1, "Each so manieth recorded grasp of b and c.")
    rollouts: int = setting(30, "Trials of a grasp of b and c.")
    seed: int = setting(0, "Seed of all draws.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        for part in self.parts:
            one_of("parts", part, PARTS)
        for name in self.objects:
            one_of("objects", name, (*OF_ROBOT, MUG))
        one_of("protocol", self.protocol, tuple(PRESETS))
        for name in ("grasps", "draws", "rollouts", "every"):
            whole_number(name, getattr(self, name), 1)
        whole_number("seed", self.seed, 0)
        not_negative_number("friction", self.friction)


@dataclass(frozen=True, eq=False)
class Grasps:
    """What came out, by part."""

    settings: Settings
    engines: dict[Job, Ends] = field(default_factory=dict)
    robot: list[Labelled] = field(default_factory=list)
    engine: tuple[list[Labelled], Contradiction] | None = None

    def to_csv(self) -> str:
        """A line for each grasp of a, and for each label of b and c."""
        head = ("part", "object or label", "grasp", "here", "there")
        rows: list[tuple[object, ...]] = []
        for job, end in self.engines.items():
            here, there = (" ".join(str(int(held)) for held in e) for e in (end.here, end.there))
            rows.append(("a", job.object, job.number, here, there))
        for job, end in self.engines.items():
            shares = (sum(held[0]) / len(held[0]) for held in (end.drawn, end.drawn_there))
            rows.append(("a", f"{job.object}, with noise", job.number, *shares))
        labelled = [*self.robot, *(self.engine[0] if self.engine else [])]
        for one in labelled:
            for k, probability in enumerate(one.probabilities):
                rows.append(("b, c", one.label, k, probability, int(one.held[k])))
        return csv_text(head, rows)

    def to_markdown(self) -> str:
        """Each part's table, and what it is of."""
        return "\n".join(["# Grasps that others made\n", *self._sections()])

    def _sections(self) -> Iterator[str]:
        s = self.settings
        yield "Intervals are of 95 %, over whole objects where there are several.\n"
        if self.engines:
            yield "## a. Two engines\n"
            yield (
                "Grasps near recorded ones whose open hand is free, by a Panda's hand of rigid "
                f"fingers; protocol `{s.protocol}` without a table, friction {s.friction:g}; lost "
                "is what slips by 3 cm or turns by 30 degrees in the hand. MuJoCo runs at steps "
                "of 0.5 and 0.25 ms, each with its own contacts (`impratio` 10) and with stiff "
                "ones (`solimp` .99 .999 .0001, `impratio` 100). *Alike* is the share of the "
                "grasps that are held or lost here, at our step or a quarter of it, as in MuJoCo "
                "where its four runs are of one mind; *of the gripped* leaves out those that no "
                "engine grips. The second table has the same draws of a pose (5 mm, 10 degrees, "
                f"even) and of a disturbance, {s.draws} a grasp: the share that is held, the mean "
                "difference of a grasp's share from MuJoCo's at 0.5 ms, and the share of trials "
                "that end alike; MuJoCo at 0.25 ms tells how near to itself it is.\n"
            )
            yield engines_text(self.engines)
        if self.robot:
            yield "\n## b. A real robot\n"
            yield (
                "GRASPA's grasps by a Panda, friction 0.8, YCB's masses; belief of 7 mm and 0.05 "
                f"rad, {s.rollouts} trials a grasp. *Other planners' mean* is the mean label of "
                "the other planners' grasps of the same object, which no geometry tells.\n"
            )
            yield from (one.to_markdown() for one in self.robot)
        if self.engine:
            labels, odd = self.engine
            yield "\n## c. Another engine\n"
            yield (
                "ACRONYM's grasps of a mug, labelled by FleX; its mass and inertia, and its "
                "friction or a quarter of it; rigid fingers, belief of 2 mm and 0.02 rad, "
                f"{s.rollouts} trials a grasp.\n"
            )
            yield from (one.to_markdown() for one in labels)
            yield (
                f"FleX loses {odd.lost}. In {odd.narrow} of them each finger closes on the mug "
                f"within 2 mm, so it is between them, and {odd.held} of these hold here."
            )
        yield ""


class GraspsStudy(Study[Settings, Grasps]):
    """Grasps of others: beside MuJoCo (a), a real robot (b) and FleX (c).

    The data are not in this package: --data is a folder with `graspa/` (grasps.csv, objects.csv,
    meshes/) of GRASPA-test and GRASPA-benchmark, and `acronym/` (mug.h5, mug.obj) of ACRONYM. The
    folder of results gets grasps.md, grasps.csv and all runs.

    Example: `energymargin reproduce grasps --data ../grasps --parts b,c --quick`
    """

    name = "grasps"
    title, unit = "Grasping", "grasps"
    settings = Settings()
    quick = Settings(grasps=4, draws=2, every=25, rollouts=4)
    packages = ("mujoco",)
    folders = (FOLDER,)

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Grasps:
        """Runs what the folder does not have yet."""
        data, made, s = data_folder(settings.data), Grasps(settings), settings
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PlausibilityWarning)  # that each trial would repeat
            if "a" in settings.parts:
                engine()
                found = resumed(
                    *(folder / "engines.jsonl", _jobs(settings), partial(run_engines, data)),
                    *(threads,),
                    lines=LINES,
                    progress=progress,
                )
                made = replace(made, engines=found)
            asked = Asked(data, folder, s.every, s.rollouts, s.seed, threads, progress)
            if "b" in settings.parts:
                made.robot.extend(of_robot(asked))
            if "c" in settings.parts:
                made = replace(made, engine=of_engine(asked))
        return made


STUDY = GraspsStudy()


def _jobs(s: Settings) -> list[Job]:
    numbers = (s.friction, s.protocol, s.draws, s.seed)
    program = version("energymargin")
    return [Job(program, name, k, *numbers) for k in range(s.grasps) for name in s.objects]


def _to_json(job: Job, ends: Ends) -> str:
    return json.dumps([asdict(job), asdict(ends)])


def _from_json(line: str) -> tuple[Job, Ends]:
    job, ends = json.loads(line)
    return Job(**job), Ends(**{name: _tuples(value) for name, value in ends.items()})


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


LINES = Lines(_from_json, _to_json)
