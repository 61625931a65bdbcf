"""A file of scores: its runs, the problems of their states, scores that come from elsewhere."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from energymargin.base.aliases import AnyPath, Floats
from energymargin.base.checks import whole_number
from energymargin.base.metrics import check_scores
from energymargin.base.summary import Summarized
from energymargin.evaluate.executors.rows import Row
from energymargin.evaluate.searches import algorithm_of
from energymargin.evaluate.store import schema
from energymargin.evaluate.store.answer_file import AnswerFile
from energymargin.evaluate.store.schema import state_digest
from energymargin.records.datasets import Dataset, Future
from energymargin.records.evaluation import LabelledScores
from energymargin.records.store.run import Run

LABELS = 10000  # states whose labels are inserted at a time


class ScoreStore(AnswerFile, Summarized):
    """An open file of scores; close it, or use it in a `with` statement.

    It holds the runs of any number of datasets, futures and settings. One process at a time
    opens it with `create`, to put scores in; others of this machine may read it meanwhile.
    """

    def runs(self) -> list[Run]:
        """All runs, in the order in which they began."""
        return [Run(self, n) for (n,) in self.database.execute("SELECT id FROM runs ORDER BY id")]

    def run(self, number: int | None = None) -> Run:
        """A run by its number. None is the only one, or that with a horizon if the other one is
        `beside` it. Raises ValueError if there is no such run."""
        if number is not None:
            whole_number("run", number, 1)
        runs = self.runs()
        if number is None and len(runs) == 2:
            runs = [run for run in runs if self.beside(run)] or runs
        found = [run for run in runs if number is None or run.number == number]
        if len(found) == 1:
            return found[0]
        there = "; ".join(map(str, runs)) or "none"
        if number is None:
            text = f"{self.path} has {len(runs)} runs, choose one by its number (--run): {there}"
            raise ValueError(text)
        raise ValueError(f"run is {number}, and {self.path} has {there}")

    def beside(self, run: Run) -> Run | None:
        """The run about the states as they are that has the dataset, belief and settings of this
        one, which has a horizon; of several one that is up to date, with most metrics; None if
        there is none."""
        others = (other for other in self.runs() if other.future is None)
        alike = [other for other in others if other.common_settings == run.common_settings]
        best = max(alike, key=lambda one: (one.up_to_date, len(one.metrics)), default=None)
        return None if run.future is None else best

    def labelled_scores(self, run: Run) -> tuple[LabelledScores, LabelledScores | None]:
        """The scores of a run with their labels, and those of the run `beside` it, if there is
        one."""
        now = self.beside(run)
        return run.labelled_scores(), None if now is None else now.labelled_scores()

    def scores(self, run: Run) -> dict[str, Floats]:
        """The scores of a run by metric, shape (N,), and those of the run `beside` it, with NOW
        before a name that both have."""
        labelled, now = self.labelled_scores(run)
        return labelled.scores if now is None else labelled.scores | labelled.named_beside(now)

    def begin(
        self,
        dataset: Dataset,
        settings: Mapping[str, Any],
        questions: Mapping[str, Mapping[str, Any]],
        known_by: str = "",
        future: Future | None = None,
    ) -> Run:
        """The run of this dataset with these settings; a new one if there is none.

        `questions`: by metric, the settings that change its value. `future`: what the metrics ask
        of each state; None is about the state as it is. `known_by`: what identifies the states, if
        not their problems. The file then has the dataset a second time.
        """
        digest = dataset.digest() + known_by
        with self.transaction():
            number = self._dataset(dataset, digest)
            asks = schema.NO_FUTURE if future is None else future.to_json()
            ahead = self.number_of("futures", asks=asks)
            keys = [
                {"metric": metric, "settings": _json(own), "algorithm": algorithm_of(metric)}
                for metric, own in questions.items()
            ]
            asked = sorted(self.number_of("questions", **key) for key in keys)
            for run in self.runs():
                if (run.dataset, run.future_number, run.questions) == (number, ahead, asked):
                    return run
            insert = "INSERT INTO runs (dataset, future, settings) VALUES (?, ?, ?)"
            cursor = self.database.execute(insert, (number, ahead, _json(settings)))
            pairs = [(cursor.lastrowid, one) for one in asked]
            self.database.executemany("INSERT INTO asked VALUES (?, ?)", pairs)
            assert cursor.lastrowid is not None  # it was just inserted
            return Run(self, cursor.lastrowid)

    def _dataset(self, dataset: Dataset, digest: str) -> int:
        """The number of a dataset, which is inserted with its labels if it is not there."""
        found = self.database.execute("SELECT id FROM datasets WHERE digest = ?", (digest,))
        row = found.fetchone()
        if row is not None:
            return int(row[0])
        facts = {"task": dataset.task, "parameters": json.dumps(dataset.parameters)}
        number = self.number_of("datasets", digest=digest, states=dataset.size, **facts)
        for first in range(0, dataset.size, LABELS):
            labels = dataset.labels(first, min(first + LABELS, dataset.size))
            rows = ((number, n, *own) for n, own in enumerate(labels, start=first))
            self.database.executemany("INSERT INTO states VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows)
        return number


_json = partial(json.dumps, sort_keys=True)


def add_scores(
    path: AnyPath, dataset: Dataset, scores: Mapping[str, ArrayLike], *, settings: Mapping[str, Any]
) -> int:
    """Puts scores that were computed elsewhere into the store at `path`, which is made if there is
    none, as a run of their own; returns its number.

    `scores`: by metric, shape (N,), one a state in the order of the dataset; inf is an effort
    without an escape, NaN a missing score. `settings` say where they come from, as
    {"source": "published"}: with others they are another run. The same call again changes nothing.
    `evaluate`, reports and the viewer show such a run as any other. Raises ValueError on another
    number of scores, or none, and on a score that cannot be; errors else as ScoreStore.
    """
    columns = {name: np.asarray(values, dtype=np.float64) for name, values in scores.items()}
    for name, values in columns.items():
        if values.shape != (dataset.size,):
            text = f"scores of {name!r} have shape {values.shape}"
            raise ValueError(f"{text}, expected ({dataset.size},): one a state")
        check_scores(name, values)
    if not columns or not settings:
        raise ValueError(f"scores and settings are {sorted(columns)} and {settings}, expected some")
    questions = {metric: dict(settings) for metric in columns}
    with ScoreStore(path, create=True) as store:
        run = store.begin(dataset, settings, questions, known_by=" by place")
        run.pose({n: state_digest(run.digest, n) for n in range(dataset.size)})
        of_states = [{m: float(v[n]) for m, v in columns.items()} for n in range(dataset.size)]
        run.add_rows([Row(n, own) for n, own in enumerate(of_states)])
        return run.number
