"""The paper's Table I: how well each score predicts robustness and success, on every task.

Each task's states are scored in both readings of the effector, "coast" and "drive"; the
trajectories, and so the labels, the force score and the ceiling, are the same in both.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from energymargin import tasks
from energymargin._core import Problem
from energymargin.datasets import Dataset
from energymargin.datasets.generation import load_or_generate
from energymargin.evaluation import LabelledScores, evaluate
from energymargin.evaluation.cells import PAPER
from energymargin.evaluation.labelled import HORIZONS, compared_states
from energymargin.executors.threads import Threads, thread_count
from energymargin.experiments.ceiling import (
    CAPTURED,
    CEILING,
    ceiling_dataset,
    ceiling_run,
    evaluate_ceiling,
    scripted,
)
from energymargin.experiments.table1_text import (
    FRAMES,
    METRICS,
    WEIGHTS,
    Settings,
    Table1,
    TaskResult,
)
from energymargin.store import Run, ScoreStore, score_dataset
from energymargin.store.scoring import begin_run
from energymargin.tasks.base import EFFECTORS

__all__ = [
    "FULL",
    "QUICK",
    "Settings",
    "Table1",
    "TaskResult",
    "check_tasks",
    "paper_tasks",
    "reproduce",
]

TREES = 3  # a state's: one for capture and success, one for each planner of the effort

FULL = Settings(tasks=())
QUICK = Settings(tasks=(), trajectories=20, nodes=50, continuations=20)
"""For a first picture in a few minutes."""


def paper_tasks() -> list[str]:
    """The tasks of the paper's Table I that there are, in its order."""
    return [name for name in PAPER if name in tasks.names()]


def check_tasks(names: Sequence[str]) -> None:
    """Raises ValueError unless these are tasks of the paper's table, each once."""
    wrong = [name for name in names if name not in paper_tasks() or list(names).count(name) > 1]
    if wrong or not names:
        what = repr(wrong[0]) if wrong else "empty"
        raise ValueError(
            f"tasks has {what}, expected some of {', '.join(paper_tasks())}, each once"
        )


def reproduce(
    settings: Settings,
    folder: Path,
    *,
    threads: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Table1:
    """Makes the table; trajectories, scores and shares are kept in the folder as soon as they are
    there, and the same call goes on from them.

    `progress(what, share)` is called with what is being done, and the share that is done of all.
    Raises ValueError on a task that is not in the paper's table, or a folder that holds a table of
    other settings, before anything long is computed.
    """
    check_tasks(settings.tasks)
    threads = thread_count(threads)
    advance = progress or (lambda _what, _share: None)
    parts = []
    for name in settings.tasks:
        advance(f"{name}: trajectories", 0.0)
        parts.append(_Part.prepare(name, settings, folder))
    stages = [stage for part in parts for stage in part.stages(threads)]
    total, before = sum(stage.work for stage in stages), 0.0
    for stage in stages:

        def count(done: int, of: int, stage: _Stage = stage, before: float = before) -> None:
            what = f"{stage.what}, {done} of {of} states"
            advance(what, (before + stage.work * (done / of)) / total)

        stage.run(count)
        before += stage.work
    results = []
    for part in parts:
        advance(f"{part.dataset.task}: comparing with the labels", 1.0)
        results.append(part.result())
    return Table1(settings, folder, results)


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
