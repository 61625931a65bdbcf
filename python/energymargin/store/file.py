"""A file of scores: the runs that it holds."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from energymargin.checks import whole_number
from energymargin.datasets import Dataset, Future
from energymargin.notebook import shown_by
from energymargin.settings import algorithm_of
from energymargin.store import schema
from energymargin.store.database import Database
from energymargin.store.run import Run

__all__ = ["ScoreStore"]

LABELS = 10000  # states that are put in at a time


class ScoreStore(Database):
    """An open file of scores; close it, or use it in a `with` statement.

    It holds the runs of any number of datasets, futures and settings. Several processes of one
    machine may have it open at once, and write to it.
    """

    _repr_html_ = shown_by("data.score_store")

    def runs(self) -> list[Run]:
        """Every dataset with a future and settings that was ever begun here, in that order."""
        return [Run(self, n) for (n,) in self.database.execute("SELECT id FROM runs ORDER BY id")]

    def run(self, number: int | None = None) -> Run:
        """A run by its number, or for None the only one; ValueError if there is no such run."""
        if number is not None:
            whole_number("run", number, 1)
        runs = self.runs()
        found = [run for run in runs if number is None or run.number == number]
        if len(found) == 1:
            return found[0]
        there = "; ".join(map(str, runs)) or "none"
        if number is None:
            raise ValueError(
                f"{self.path} has {len(runs)} runs, choose one by its number (--run): {there}"
            )
        raise ValueError(f"run is {number}, and {self.path} has {there}")

    def begin(
        self,
        dataset: Dataset,
        settings: Mapping[str, Any],
        questions: Mapping[str, Mapping[str, Any]],
        known_by: str = "",
        future: Future | None = None,
    ) -> Run:
        """The run of this dataset with these settings, which is begun if there is none.

        `questions` are the settings of each metric, by its name: those that change its value.
        `future` is what they ask of each state, None is about the state as it is.
        `known_by` names what its states are known by, if not their problems: a state is known by
        one thing alone, so such runs have the states once more.
        """
        digest = dataset.digest() + known_by
        with self.transaction():
            number = self._dataset(dataset, digest)
            asks = schema.NO_FUTURE if future is None else future.to_json()
            ahead = schema.future_number(self.database, asks)
            asked = sorted(self._question(metric, own) for metric, own in questions.items())
            for run in self.runs():
                if (run.dataset, run.future_number, run.questions) == (number, ahead, asked):
                    return run
            cursor = self.database.execute(
                "INSERT INTO runs (dataset, future, settings) VALUES (?, ?, ?)",
                (number, ahead, _json(settings)),
            )
            self.database.executemany(
                "INSERT INTO asked VALUES (?, ?)", [(cursor.lastrowid, one) for one in asked]
            )
            assert cursor.lastrowid is not None  # it was just inserted
            return Run(self, cursor.lastrowid)

    def _dataset(self, dataset: Dataset, digest: str) -> int:
        """The number of a dataset, which is put in with its labels if it is not there."""
        found = self.database.execute("SELECT id FROM datasets WHERE digest = ?", (digest,))
        row = found.fetchone() or self._adopted(dataset, digest)
        if row is not None:
            return int(row[0])
        cursor = self.database.execute(
            "INSERT INTO datasets (digest, task, parameters, states) VALUES (?, ?, ?, ?)",
            (digest, dataset.task, json.dumps(dataset.parameters), dataset.size),
        )
        assert cursor.lastrowid is not None  # it was just inserted
        for first in range(0, dataset.size, LABELS):
            last = min(first + LABELS, dataset.size)
            labels = dataset.labels(first, last)
            self.database.executemany(
                "INSERT INTO states VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                ((cursor.lastrowid, n, *own) for n, own in enumerate(labels, start=first)),
            )
        return cursor.lastrowid

    def _adopted(self, dataset: Dataset, digest: str) -> tuple[int] | None:
        """A dataset of an older file, if it is this one: from now on known by its digest."""
        old = self.database.execute("SELECT id FROM datasets WHERE digest IS NULL").fetchall()
        if not old:
            return None
        row: tuple[int] | None = self.database.execute(
            "UPDATE datasets SET digest = ?, parameters = ? WHERE digest IS NULL AND digest_2 = ? "
            "RETURNING id",
            (digest, json.dumps(dataset.parameters), dataset.digest_of_version_2()),
        ).fetchone()
        return row

    def _question(self, metric: str, settings: Mapping[str, Any]) -> int:
        key = (metric, _json(settings), algorithm_of(settings))
        self.database.execute(
            "INSERT INTO questions (metric, settings, algorithm) VALUES (?, ?, ?) "
            "ON CONFLICT DO NOTHING",
            key,
        )
        (number,) = self.database.execute(
            "SELECT id FROM questions WHERE (metric, settings, algorithm) = (?, ?, ?)", key
        ).fetchone()
        return int(number)


def _json(settings: Mapping[str, Any]) -> str:
    return json.dumps(settings, sort_keys=True)
