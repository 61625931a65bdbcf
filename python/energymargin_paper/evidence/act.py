"""Acting on the margin: four tasks, a plan of each that is chosen in four ways, in held-out worlds.

A plan is chosen once, for the world that is believed. Then it runs in worlds with other frictions,
other errors of the start and another kind of disturbance, the same for each way of choosing.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel
from energymargin.base.checks import one_of, whole_number
from energymargin.base.plausibility import PlausibilityWarning
from energymargin.base.table_text import csv_text, markdown_table
from energymargin_paper.evidence.act_demo import Demo
from energymargin_paper.evidence.act_methods import METHODS, Choice, Chosen, choose
from energymargin_paper.evidence.act_trials import ENGINES, Outcome, Trial, duration, run
from energymargin_paper.evidence.pairs_of_trials import paired
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DEMOS", "STUDY", "Acted", "Settings", "demo_of"]

DEMOS = {"push": "PushDemo", "balance": "BalanceDemo", "grasp": "GraspDemo", "scoop": "ScoopDemo"}
CHOICES_FILE, TRIALS_FILE = "choices.jsonl", "trials.jsonl"
NOMINAL, MARGIN = METHODS[0], METHODS[-1]


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on what cannot be."""

    demos: tuple[str, ...] = setting(tuple(DEMOS), "Tasks, separated by commas.")
    engines: tuple[str, ...] = setting(ENGINES, "Where plans are tried, separated by commas.")
    worlds: int = setting(200, "Held-out worlds of each task.")
    first: int = setting(10_000, "Number of the first world; those below were seen before.")
    budget: int = setting(0, "Simulation steps of a search; 0 takes the task's own.")
    seed: int = setting(0, "Seed of the searches.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        for demo in self.demos:
            one_of("demos", demo, tuple(DEMOS))
        for engine in self.engines:
            one_of("engines", engine, ENGINES)
        whole_number("worlds", self.worlds, 1)
        for name in ("first", "budget", "seed"):
            whole_number(name, getattr(self, name), 0)


@dataclass(frozen=True, eq=False)
class Acted:
    """What came out."""

    settings: Settings
    chosen: dict[Choice, Chosen]
    outcomes: dict[Trial, Outcome]
    times: dict[tuple[str, str], float | None]
    """By task and method, when the undisturbed motion is done [s]."""

    def of(
        self, demo: str, method: str, engine: str
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Whether it was lost, and whether it succeeded, by world."""
        own = [
            outcome
            for trial, outcome in self.outcomes.items()
            if (trial.demo, trial.method, trial.engine) == (demo, method, engine)
        ]
        return np.array([o.lost for o in own]), np.array([o.success for o in own])

    def to_markdown(self) -> str:
        """A table for each engine, and the plans."""
        s = self.settings
        text = (
            f"{s.worlds} held-out worlds of each task: other frictions, other errors of the start, "
            "another kind of disturbance than the one under which plans were chosen. *Lost*: the "
            "object left the capture set before the end. *Success*: it is in the success set at "
            "the end. *Gained, lost*: worlds in which the plan holds and the nominal one does not, "
            "and the other way round; p of McNemar's exact test. *Time*: when the undisturbed "
            "motion is done."
        )
        parts = [f"# Acting on the margin\n\n{text}\n"]
        for engine in s.engines:
            name = {"bullet": "Bullet", "mujoco": "MuJoCo"}[engine]
            parts.append(f"## In {name}\n\n{self._table(engine)}\n")
        parts.append(f"## The plans\n\n{self._plans()}\n")
        return "\n".join(parts)

    def _table(self, engine: str) -> str:
        header = ["task", "plan", "lost", "of nominal", "gained, lost", "p", "success", "time [s]"]
        rows = [self._row(d, m, engine) for d in self.settings.demos for m in METHODS]
        return markdown_table(header, rows)

    def _row(self, demo: str, method: str, engine: str) -> list[str]:
        before, _ = self.of(demo, NOMINAL, engine)
        lost, success = self.of(demo, method, engine)
        gained, worse = int((before & ~lost).sum()), int((lost & ~before).sum())
        done = self.times[demo, method]
        nominal = method == NOMINAL
        return [
            demo if nominal else "",
            method,
            f"{lost.mean():.1%}",
            "" if nominal or not before.any() else f"{lost.sum() / before.sum():.2f}",
            "" if nominal else f"{gained}, {worse}",
            "" if nominal else f"{paired(gained, worse, len(lost))[3]:.2g}",
            f"{success.mean():.1%}",
            "never" if done is None else f"{done:.2f}",
        ]

    def _plans(self) -> str:
        rows = [
            [
                choice.demo if choice.method == NOMINAL else "",
                choice.method,
                ", ".join(f"{name} {value:.3g}" for name, value in found.values.items()),
                f"{found.steps / 1e6:.2f}",
                f"{found.seconds:.0f}",
            ]
            for choice, found in self.chosen.items()
        ]
        header = ["task", "plan", "parameters", "steps [millions]", "seconds"]
        return markdown_table(header, rows)

    def to_csv(self) -> str:
        """A line for each plan in each world."""
        rows = [
            (t.demo, t.method, t.engine, t.seed, o.lost, o.success)
            for t, o in self.outcomes.items()
        ]
        return csv_text(("task", "plan", "engine", "world", "lost", "success"), rows)


class ActStudy(Study[Settings, Acted]):
    """Plans that were chosen by the margin, against nominal ones, in worlds held out.

    Four tasks: a push to a wall, a lift of a square on a bar, a grip of a mesh, a scoop of four
    boxes. Plans: the nominal script; the best by the force score; the best over randomized models
    without a disturbance; the best by the margin, of as many steps.

    The folder gets act.md, act.csv and a strip of pictures for each task.

    Example: `energymargin reproduce act --demos push --worlds 50`
    """

    name = "act"
    title, unit = "Acting", "jobs"
    settings = Settings()
    quick = Settings(worlds=10, budget=400_000)
    packages = ("mujoco", "cma")

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Acted:
        """Chooses all plans, one after the other, and then tries them."""
        with _heavy_arm():
            return self._compute(settings, folder, threads, progress)

    def _compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Acted:
        demos, release = {name: demo_of(name) for name in settings.demos}, version("energymargin")
        choices = [
            Choice(release, name, method, settings.budget or demo.budget, settings.seed)
            for name, demo in demos.items()
            for method in METHODS
        ]
        worlds = range(settings.first, settings.first + settings.worlds)
        jobs = len(choices) * (1 + len(worlds) * len(settings.engines))
        chosen = resumed(
            folder / CHOICES_FILE,
            choices,
            lambda choice, cancel: choose(demos[choice.demo], choice, folder, threads, cancel),
            1,
            lines=pairs(Choice, Chosen),
            progress=lambda done, _: progress(done, jobs),
        )
        trials = [
            Trial(c.demo, c.method, json.dumps(found.values), engine, world)
            for c, found in chosen.items()
            for engine in settings.engines
            for world in worlds
        ]

        def tried(trial: Trial, cancel: Cancel) -> Outcome:
            values = json.loads(trial.values)
            return run(demos[trial.demo], values, trial.engine, trial.seed, cancel)

        outcomes = resumed(
            folder / TRIALS_FILE,
            trials,
            tried,
            threads,
            lines=pairs(Trial, Outcome),
            progress=lambda done, _: progress(len(choices) + done, jobs),
        )
        times = {
            (c.demo, c.method): duration(demos[c.demo].problem(found.values))
            for c, found in chosen.items()
        }
        return Acted(settings, chosen, outcomes, times)

    def figures(self, result: Acted) -> Iterator[tuple[str, Figure]]:
        """A strip for each task."""
        from energymargin_paper.evidence.act_strips import figure_strip

        values = {(c.demo, c.method): found.values for c, found in result.chosen.items()}
        shown = result.settings.demos if "bullet" in result.settings.engines else ()
        for name in shown:
            before, _ = result.of(name, NOMINAL, "bullet")
            after, _ = result.of(name, MARGIN, "bullet")
            differs = np.flatnonzero(before & ~after)
            if len(differs):
                world = result.settings.first + int(differs[0])
                plans = {method: values[name, method] for method in (NOMINAL, MARGIN)}
                with _heavy_arm():
                    figure = figure_strip(demo_of(name), plans, world)
                yield f"act_{name}.png", figure


STUDY = ActStudy()


@contextmanager
def _heavy_arm() -> Iterator[None]:
    """The scoop has the mass of its arm, which is dense for a scoop: no warning of it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlausibilityWarning)
        yield


def demo_of(name: str) -> Demo:
    """The demonstration of a task."""
    module = import_module(f"energymargin_paper.evidence.act_{name}")
    made: Demo = getattr(module, DEMOS[name])()
    return made
