"""Pushes of centimetres and grams at true scale, beside the same in an enlarged scene.

Enlarged by a factor, with the same densities and accelerations, all happens alike: lengths are as
many times as large, times and speeds grow by the square root. So where a rollout ends, divided by
the factor, is where it ends at true scale, but for what the simulation does with absolute lengths
and speeds, and for rounding. Enlarged by a power of two all numbers round alike; a factor of 1.001
shows what rounding does alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Problem, Scene, World
from energymargin.checks import whole_number
from energymargin.table_text import csv_text, markdown_table
from energymargin.tasks.base import STEP
from energymargin_paper.paper.printed import printed
from energymargin_paper.paper.push_real import LONGEST_EDGE, TOLERANCE, scene
from energymargin_paper.paper.table2 import COMBINATIONS, TASK, recorded
from energymargin_paper.study import Progress, Study, setting

__all__ = ["STUDY", "VARIANTS", "Enlarged", "Settings", "Variant"]

MOVING = ("object", "effector")
COLUMNS = ("median [mm]", "90 % [mm]", "most [mm]", "effort [%]")


@dataclass(frozen=True)
class Variant:
    """A way to simulate the same pushes."""

    name: str
    scale: float = 1.0
    step: float = STEP
    """At true scale [s]."""
    tolerance: float = TOLERANCE
    """The solver's, relative."""


VARIANTS = (
    Variant("true scale"),
    Variant("10 times as large", scale=10),
    Variant("16 times as large: it rounds alike", scale=16),
    Variant("1.001 times as large: rounding alone", scale=1.001),
    Variant("half the step", step=STEP / 2),
    Variant("a thousandth of the tolerance", tolerance=TOLERANCE / 1000),
)


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    recordings: int = setting(4, "Recordings of each combination.")
    frames: int = setting(10, "Frames of each recording, evenly spaced.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        whole_number("recordings", self.recordings, 1, 12)
        whole_number("frames", self.frames, 1, 100)


@dataclass(frozen=True)
class Enlarged:
    """What came out: where the object ends [m], and the effort [J], all at true scale."""

    ends: dict[str, NDArray[np.float64]]
    """By variant, rows of x, y and effort, shape (N, 3)."""

    def row(self, variant: Variant) -> tuple[float, ...]:
        """How far the ends lie from those at true scale [mm]: median, 90 % and most; the mean
        difference of the efforts, as a share of their mean [%]."""
        ours, other = self.ends[variant.name], self.ends[VARIANTS[0].name]
        apart = 1e3 * np.linalg.norm((ours - other)[:, :2], axis=1)
        effort = 100 * np.abs(ours - other)[:, 2].mean() / other[:, 2].mean()
        median, most = np.quantile(apart, [0.5, 0.9])
        return float(median), float(most), float(apart.max()), float(effort)

    def to_markdown(self) -> str:
        """A line a variant."""
        count = len(next(iter(self.ends.values())))
        text = (
            f"{count} rollouts of {LONGEST_EDGE:g} s from recorded states of all combinations of "
            f"{TASK}, with random disturbances within its bounds: how far apart the object ends, "
            "in lengths of the true scale, and how much the efforts differ."
        )
        rows = [[v.name, *(f"{x:.3g}" for x in self.row(v))] for v in VARIANTS[1:]]
        table = markdown_table(["", *COLUMNS], rows)
        return f"# True scale and enlarged scenes\n\n{text}\n\n{table}\n"

    def to_csv(self) -> str:
        """The same."""
        rows = [(variant.name, *self.row(variant)) for variant in VARIANTS[1:]]
        return csv_text(("variant", *COLUMNS), rows)


class EnlargedStudy(Study[Settings, Enlarged]):
    """Whether pushes of centimetres and grams are as exact at true scale as in an enlarged scene.

    Rollouts from recorded states of push-real, at true scale and 10 and 16 times as large, beside
    what rounding, half the step and the solver's tolerance change.

    The folder gets enlarged.md and enlarged.csv. It takes a quarter of a minute.

    Example: `energymargin reproduce enlarged --frames 20`
    """

    name = "enlarged"
    title, unit = "Simulating", "combinations"
    settings = Settings()
    quick = Settings(recordings=1, frames=5)
    resumes = threaded = False

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Enlarged:
        """Simulates all, on one thread."""
        ends: dict[str, list[NDArray[np.float64]]] = {variant.name: [] for variant in VARIANTS}
        for done, combination in enumerate(COMBINATIONS, 1):
            problems = _problems(combination, settings)
            for variant in VARIANTS:
                ends[variant.name].append(_ends(combination, problems, variant))
            progress(done, len(COMBINATIONS))
        return Enlarged({name: np.concatenate(rows) for name, rows in ends.items()})


STUDY = EnlargedStudy()


def _problems(combination: str, settings: Settings) -> list[Problem]:
    """Of the chosen frames."""
    dataset = recorded(combination, settings.recordings)
    frames = np.linspace(0, len(dataset.trajectories[0]) - 1, settings.frames).astype(int)
    name, tool = combination.split("-")
    task = tasks.make(TASK, object=name, tool=tool)
    return [task.problem(t.states[k]) for t in dataset.trajectories for k in frames]


def _ends(combination: str, problems: list[Problem], variant: Variant) -> NDArray[np.float64]:
    """The object's x and y and the effort, at true scale, shape (N, 3)."""
    name, tool = combination.split("-")
    factor = variant.scale
    made = scene(
        printed("objects", name),
        printed("effectors", tool),
        factor,
        step=variant.step,
        tolerance=variant.tolerance,
    )
    world, random = World(made), np.random.default_rng(0)
    x = made.slice("object").start
    rows = []
    for problem in problems:
        bounds = np.concatenate([problem.force * factor**3, problem.torque * factor**4])
        wrench = random.uniform(-1, 1, 6) * bounds
        state = _enlarged(problem, made, factor)
        rollout = world.rollout(state, wrench, LONGEST_EDGE * math.sqrt(factor))
        rows.append([*rollout.state[x : x + 2] / factor, rollout.effort / factor**4])
    return np.array(rows)


def _enlarged(problem: Problem, made: Scene, factor: float) -> NDArray[np.float64]:
    """The problem's state in the enlarged scene, shape (n,)."""
    bodies = problem.scene.unpack(problem.state)
    root = math.sqrt(factor)
    state: NDArray[np.float64] = made.pack(
        **{
            name: {
                "position": bodies[name]["position"] * factor,
                "orientation": bodies[name]["orientation"],
                "velocity": bodies[name]["velocity"] * root,
                "angular_velocity": bodies[name]["angular_velocity"] / root,
            }
            for name in MOVING
        }
    )
    return state
