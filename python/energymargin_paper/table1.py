"""The paper's Table I: how well each score predicts robustness and success, on every task.

Each task's states are scored in both readings of the effector, "coast" and "drive"; the
trajectories, and so the labels, the force score and the ceiling, are the same in both.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from energymargin import datasets, tasks
from energymargin._core import Problem
from energymargin.cli.options import PICTURE_NODES
from energymargin.cli.progress import share_bar
from energymargin.cli.terminal import err, out
from energymargin.datasets import Dataset
from energymargin.datasets.generation import load_or_generate
from energymargin.evaluation import LabelledScores, evaluate
from energymargin.evaluation.labelled import HORIZONS, compared_states
from energymargin.executors.threads import Threads
from energymargin.store import Run, ScoreStore, score_dataset
from energymargin.store.scoring import begin_run
from energymargin.tasks.base import EFFECTORS
from energymargin_paper.ceiling import (
    CAPTURED,
    CEILING,
    ceiling_dataset,
    ceiling_run,
    evaluate_ceiling,
    scripted,
)
from energymargin_paper.study import Progress, Study
from energymargin_paper.table1_text import (
    FRAMES,
    METRICS,
    WEIGHTS,
    Settings,
    Table1,
    TaskResult,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["STUDY", "Settings", "Table1", "TaskResult"]

TREES = 3  # a state's: one for capture and success, one for each planner of the effort


class Table1Study(Study[Settings, Table1]):
    """How well each score predicts robustness and success, on every task, beside the paper's.

    AUC and AP of the scores of recorded states against what happened afterwards, in both readings
    of the effector. The *ceiling* is what a score could reach at most: it lets the robot's own
    script go on from each state, many times, with fresh noise.

    The folder gets table1.md and table1.csv, the trajectories (TASK.h5), every score (*.db) and a
    picture of each task (TASK.png).
    With 1000 nodes it takes hours; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce table1 --tasks push --nodes 100`
    """

    name = "table1"
    title, unit = "Scoring", "states"
    settings = Settings()
    quick = Settings(trajectories=20, nodes=50, continuations=20)

    def settings_in_all(self, quick: bool) -> Settings:
        """With smaller trees, which take an hour and not a day."""
        return self.quick if quick else replace(self.settings, nodes=100)

    def bar(self) -> AbstractContextManager[Progress]:
        """Of what is being done, and the share that is done of all."""
        return share_bar(err)

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Table1:
        """Computes what is not in the folder; `progress(what, share)`. Raises ValueError on a
        folder that holds a table of other settings, before anything long is computed."""
        parts = []
        for name in settings.tasks:
            progress(f"{name}: trajectories", 0.0)
            parts.append(_Part.prepare(name, settings, folder))
        stages = [stage for part in parts for stage in part.stages(threads)]
        total, before = sum(stage.work for stage in stages), 0.0
        for stage in stages:

            def count(done: int, of: int, stage: _Stage = stage, before: float = before) -> None:
                what = f"{stage.what}, {done} of {of} states"
                progress(what, (before + stage.work * (done / of)) / total)

            stage.run(count)
            before += stage.work
        results = []
        for part in parts:
            progress(f"{part.dataset.task}: comparing with the labels", 1.0)
            results.append(part.result())
        return Table1(settings, folder, results)

    def show(self, result: Table1) -> None:
        """In 80 columns."""
        out.print(result.render())

    def figures(self, result: Table1) -> Iterator[tuple[str, Figure]]:
        """Search trees of each task."""
        from energymargin.plots.datasets import figure_trees

        for name in result.settings.tasks:
            dataset = datasets.load(result.folder / f"{name}.h5")
            yield f"{name}.png", figure_trees(dataset, PICTURE_NODES, result.settings.seed)


STUDY = Table1Study()


@dataclass(frozen=True)
class _Stage:
    """One long computation, over the states of one dataset."""

    what: str
    work: float
    """How long it may take [s]; what counts is its ratio to the others'."""
    run: Callable[[Callable[[int, int], None]], object]
    """Takes a `progress(done, total)`."""


@dataclass(frozen=True)
class _Part:
    """One task: its files, and what is to be computed."""

    dataset: Dataset
    """In the task's own reading of the effector."""
    settings: Settings
    folder: Path

    @classmethod
    def prepare(cls, name: str, settings: Settings, folder: Path) -> _Part:
        """Generates the trajectories if they are not there, and opens every file once."""
        path, task = folder / f"{name}.h5", tasks.make(name)
        dataset = load_or_generate(path, task, settings.trajectories, FRAMES, settings.seed)
        part = cls(dataset, settings, folder)
        for effector in part.effectors():
            with part.scores(effector):
                pass
        with part.shares():
            pass
        return part

    def effectors(self) -> list[str]:
        """Both readings, the task's own first."""
        own = self.dataset.parameters["effector"]
        return sorted(EFFECTORS, key=lambda effector: effector != own)

    def reading(self, effector: str) -> Dataset:
        """The same trajectories, of a task with this effector."""
        return replace(self.dataset, parameters={**self.dataset.parameters, "effector": effector})

    @contextmanager
    def scores(self, effector: str) -> Iterator[Run]:
        """The scores in one reading."""
        with ScoreStore(self._path(f"{effector}-scores"), create=True) as store:
            yield begin_run(store, self.reading(effector), METRICS, self.settings.search)

    @contextmanager
    def shares(self) -> Iterator[Run]:
        """The shares of the ceiling."""
        settings = self.settings
        with ScoreStore(self._path(CEILING), create=True) as store:
            yield ceiling_run(store, self.dataset, settings.continuations, settings.seed)

    def problem(self) -> Problem:
        """That of the first state."""
        first = self.dataset.trajectories[0]
        return tasks.make(self.dataset.task, **self.dataset.parameters).problem(
            first.states[0], first.params, first.contacts[0]
        )

    def stages(self, threads: int) -> list[_Stage]:
        """What takes long: the scores in the task's own reading, the ceiling, the other reading."""
        task, settings = scripted(self.dataset), self.settings
        start = time.perf_counter()
        task.rollout(settings.seed, frames=2)
        step = (time.perf_counter() - start) / task.steps
        states = len(self.dataset.frames())
        edge = self.problem().duration / task.step

        def score(effector: str) -> _Stage:
            return _Stage(
                f"{task.name}: scores, {effector}",
                states * TREES * settings.nodes * edge * step,
                lambda progress: score_dataset(
                    self.reading(effector),
                    self._path(f"{effector}-scores"),
                    METRICS,
                    settings=settings.search,
                    executor=Threads(threads),
                    progress=progress,
                ),
            )

        ceiling = _Stage(
            f"{task.name}: ceiling",
            states * settings.continuations * task.steps / 2 * step,
            lambda progress: ceiling_dataset(
                self.dataset,
                self._path(CEILING),
                settings.continuations,
                settings.seed,
                threads=threads,
                progress=progress,
            ),
        )
        own, other = self.effectors()
        return [score(own), ceiling, score(other)]

    def result(self) -> TaskResult:
        """The evaluation of all files, once they are whole."""
        seed, weights = self.settings.seed, self.problem().force_weights
        readings = {}
        for effector in self.effectors():
            with self.scores(effector) as run:
                readings[effector] = evaluate(run.labelled_scores(), seed=seed)
        with self.shares() as run:
            labelled = run.labelled_scores()
        return TaskResult(
            task=self.dataset.task,
            readings=readings,
            ceiling=evaluate_ceiling(labelled, seed),
            captured=[_share_captured(labelled, horizon) for horizon in HORIZONS],
            succeeded=float(np.mean([t.success for t in self.dataset.trajectories])),
            weights={name: getattr(weights, name) for name in WEIGHTS},
        )

    def _path(self, what: str) -> Path:
        return self.folder / f"{self.dataset.task}-{what}.db"


def _share_captured(labelled: LabelledScores, horizon: int) -> float:
    return float(compared_states(labelled, CAPTURED[horizon], horizon).labels.mean())
