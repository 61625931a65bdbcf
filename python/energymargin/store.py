"""Scores on disk (SQLite): they survive an interrupt, and a run goes on where it was.

A file belongs to one dataset and one choice of settings. It holds the labels of all states as well,
so that an evaluation needs nothing else:

    settings  name, value (JSON)
    states    trajectory, frame, captured, success, seconds (NULL: not scored yet),
              captured_any, success_any (NULL: there is one set for all objects)
    scores    trajectory, frame, metric, value (inf is an effort for which no escape was found)
"""

from __future__ import annotations

import errno
import json
import os
import sqlite3
from collections.abc import Callable, Sequence
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel
from energymargin.datasets import Dataset
from energymargin.evaluation import LabelledScores
from energymargin.limits import Limit
from energymargin.scoring import check_settings, chosen_metrics, score
from energymargin.tasks.base import Trajectory

__all__ = ["Row", "ScoreStore", "score_dataset"]

# Marks the file as ours in SQLite's own header: "EMsc".
APPLICATION_ID = 0x454D7363
VERSION = 2  # 1 had no labels of at least one object

# Settings that older files do not name, as they were then.
_BEFORE = {"nodes_per_edge": 1, "least_likelihood": 0.0, "stop_at_escape": False}

_TABLES = """
CREATE TABLE settings (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE states (
    trajectory INTEGER NOT NULL, frame INTEGER NOT NULL,
    captured INTEGER NOT NULL, success INTEGER NOT NULL, seconds REAL,
    captured_any INTEGER, success_any INTEGER,
    PRIMARY KEY (trajectory, frame)
) WITHOUT ROWID;
CREATE TABLE scores (
    trajectory INTEGER NOT NULL, frame INTEGER NOT NULL, metric TEXT NOT NULL, value REAL NOT NULL,
    PRIMARY KEY (trajectory, frame, metric),
    FOREIGN KEY (trajectory, frame) REFERENCES states
) WITHOUT ROWID;
"""


class Row(Protocol):
    """The scores of one state."""

    @property
    def index(self) -> int:
        """The number of the state in its dataset."""
        ...

    @property
    def seconds(self) -> float:
        """Computing time [s]."""
        ...

    @property
    def scores(self) -> dict[str, float]:
        """By metric."""
        ...


class ScoreStore:
    """An open file of scores; close it, or use it in a `with` statement."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Opens a file that exists.

        Raises FileNotFoundError if it does not, ValueError if it is not a file of scores.
        """
        self.path = Path(path)
        if not self.path.exists():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(self.path))
        try:
            self._database = sqlite3.connect(self.path)
            self._check_format()
        except sqlite3.DatabaseError as error:
            raise ValueError(f"{self.path} is not a file of scores, or damaged: {error}") from error

    @classmethod
    def for_dataset(
        cls,
        path: str | os.PathLike[str],
        dataset: Dataset,
        metrics: Sequence[str],
        nodes: int,
        seed: int,
        *,
        nodes_per_edge: int = 1,
        least_likelihood: float = 0.0,
        stop_at_escape: bool = False,
    ) -> ScoreStore:
        """Opens the file of the scores of these settings: `for_settings`, with checks."""
        check_settings(
            metrics, nodes, seed, nodes_per_edge=nodes_per_edge, least_likelihood=least_likelihood
        )
        return cls.for_settings(
            path,
            dataset,
            metrics,
            nodes=nodes,
            seed=seed,
            nodes_per_edge=nodes_per_edge,
            least_likelihood=least_likelihood,
            stop_at_escape=stop_at_escape,
        )

    @classmethod
    def for_settings(
        cls,
        path: str | os.PathLike[str],
        dataset: Dataset,
        metrics: Sequence[str],
        **numbers: float,
    ) -> ScoreStore:
        """Opens the file of these settings, or makes it if there is none.

        `numbers` are what the metrics' values depend on, such as nodes and seed. Raises ValueError
        if the file holds scores of another dataset or other settings, and says which differ.
        """
        settings = {
            "task": dataset.task,
            "dataset": dataset.digest(),
            **numbers,
            "metrics": sorted(metrics),
            "energymargin": version("energymargin"),
        }
        if not Path(path).exists():
            _create(Path(path), settings, dataset)
        store = cls(path)
        found = _BEFORE | store.settings()
        different = [name for name in settings if found.get(name) != settings[name]]
        if different:
            store.close()
            raise ValueError(
                f"{path} holds other scores; choose another file, or remove it. "
                + "; ".join(
                    f"{_say(name)}: {_show(found.get(name))} there, {_show(settings[name])} now"
                    for name in different
                )
            )
        return store

    def settings(self) -> dict[str, Any]:
        """What the scores belong to: task, dataset (digest), metrics, energymargin, and numbers."""
        return {
            name: json.loads(value)
            for name, value in self._database.execute("SELECT name, value FROM settings")
        }

    def missing(self) -> list[int]:
        """The numbers of the states that have no scores yet, rising."""
        rows = self._database.execute(
            "SELECT seconds IS NULL FROM states ORDER BY trajectory, frame"
        )
        return [number for number, (missing,) in enumerate(rows) if missing]

    def counts(self) -> tuple[int, int]:
        """How many states are scored, and how many there are."""
        scored, total = self._database.execute(
            "SELECT count(seconds), count(*) FROM states"
        ).fetchone()
        return int(scored), int(total)

    def add(self, rows: Sequence[Row]) -> None:
        """Keeps these rows, all or none. A row's index is the number of its state."""
        metrics = self.settings()["metrics"]
        with self._database:
            self._database.executemany(
                "INSERT INTO scores VALUES (?, ?, ?, ?) ON CONFLICT DO NOTHING",
                [
                    (*self._keys[row.index], metric, row.scores[metric])
                    for row in rows
                    for metric in metrics
                ],
            )
            self._database.executemany(
                "UPDATE states SET seconds = ? WHERE trajectory = ? AND frame = ?",
                [(row.seconds, *self._keys[row.index]) for row in rows],
            )

    def labelled_scores(self) -> LabelledScores:
        """All labels and scores, for an evaluation; a score that is not there yet is NaN."""
        any_object = "captured_any, success_any" if self._version > 1 else "NULL, NULL"
        states = self._database.execute(
            f"SELECT trajectory, frame, captured, success, {any_object} FROM states "
            "ORDER BY trajectory, frame"
        ).fetchall()
        number = {(t, k): i for i, (t, k, *_) in enumerate(states)}
        settings = self.settings()
        scores = {metric: np.full(len(states), np.nan) for metric in settings["metrics"]}
        for t, k, metric, value in self._database.execute(
            "SELECT trajectory, frame, metric, value FROM scores"
        ):
            scores[metric][number[t, k]] = value
        trajectory, _, *labels = zip(*states, strict=True)
        captured, success, captured_any, success_any = map(_flags, labels)
        assert captured is not None and success is not None  # the tables do not allow NULL
        return LabelledScores(
            task=settings["task"],
            trajectory=np.array(trajectory, dtype=np.int64),
            captured=captured,
            success=success,
            scores=scores,
            captured_any=captured_any,
            success_any=success_any,
        )

    def seconds(self) -> float:
        """Mean computing time of a state, over those that are scored [s]; 0 if none is."""
        (mean,) = self._database.execute("SELECT avg(seconds) FROM states").fetchone()
        return float(mean or 0.0)

    def close(self) -> None:
        """Closes the file; what `add` got is in it."""
        self._database.close()

    def __enter__(self) -> ScoreStore:
        """The open file itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Closes the file."""
        self.close()

    @cached_property
    def _keys(self) -> list[tuple[int, int]]:
        """Trajectory and frame of each state, by its number."""
        return self._database.execute(
            "SELECT trajectory, frame FROM states ORDER BY trajectory, frame"
        ).fetchall()

    def _check_format(self) -> None:
        (application,) = self._database.execute("PRAGMA application_id").fetchone()
        (format_version,) = self._database.execute("PRAGMA user_version").fetchone()
        (state,) = self._database.execute("PRAGMA quick_check(1)").fetchone()
        if state != "ok":
            raise ValueError(f"{self.path} is damaged: {' '.join(state.split())}")
        if application != APPLICATION_ID:
            raise ValueError(
                f"{self.path} is not a file of scores: it is an SQLite file of something else"
            )
        self._version = int(format_version)
        if format_version > VERSION:
            raise ValueError(
                f"{self.path} has version {format_version} of the scores' format, "
                f"and this energymargin reads up to {VERSION}: update it"
            )


def score_dataset(
    dataset: Dataset,
    path: str | os.PathLike[str],
    metrics: Sequence[str] | None = None,
    nodes: int = 1000,
    seed: int = 0,
    *,
    nodes_per_edge: int = 1,
    least_likelihood: float = 0.0,
    stop_at_escape: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> bool:
    """Scores every state of a dataset that has no score in the file at `path` yet, and keeps each
    as soon as it is there. Returns whether all are scored now: False if `timeout` [s] was over, or
    `cancel` was set, before.

    Then, or on KeyboardInterrupt, or any other error, all that was finished is in the file, and the
    same call goes on from it: the scores are those of an undisturbed run, to the last bit.
    Arguments and errors: as `scoring.score`, and `ScoreStore.for_dataset`. `progress(done, total)`
    counts all states of the dataset.
    """
    limit = Limit(timeout, cancel)
    problems = dataset.problems()
    metrics = chosen_metrics(problems, metrics)
    with ScoreStore.for_dataset(
        path,
        dataset,
        metrics,
        nodes,
        seed,
        nodes_per_edge=nodes_per_edge,
        least_likelihood=least_likelihood,
        stop_at_escape=stop_at_escape,
    ) as store:
        missing = store.missing()
        kept = len(problems) - len(missing)

        def advance(done: int, _total: int) -> None:
            if progress is not None:
                progress(kept + done, len(problems))

        advance(0, len(missing))
        table = score(
            [problems[number] for number in missing],
            metrics,
            nodes,
            seed,
            nodes_per_edge=nodes_per_edge,
            least_likelihood=least_likelihood,
            stop_at_escape=stop_at_escape,
            threads=threads,
            progress=advance,
            on_rows=store.add,
            indices=missing,
            **limit.rest(),
        )
        return table.complete


def _create(path: Path, settings: dict[str, Any], dataset: Dataset) -> None:
    """A new file in one step: nobody ever sees a half made one."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such folder", str(path.parent))
    database = sqlite3.connect(temporary)
    try:
        database.executescript(_TABLES)
        database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        database.execute(f"PRAGMA user_version = {VERSION}")
        with database:
            database.executemany(
                "INSERT INTO settings VALUES (?, ?)",
                [(name, json.dumps(value)) for name, value in settings.items()],
            )
            database.executemany(
                "INSERT INTO states VALUES (?, ?, ?, ?, NULL, ?, ?)",
                [
                    (t, k, *_labels(trajectory, k))
                    for t, trajectory in enumerate(dataset.trajectories)
                    for k in range(len(trajectory))
                ],
            )
        database.execute("PRAGMA journal_mode = WAL")
        database.close()
        os.replace(temporary, path)
    finally:
        database.close()
        temporary.unlink(missing_ok=True)


def _labels(trajectory: Trajectory, frame: int) -> tuple[bool | None, ...]:
    """Of one state, in the order of the columns."""
    some = trajectory.captured_any
    return (
        bool(trajectory.captured[frame]),
        trajectory.success,
        None if some is None else bool(some[frame]),
        trajectory.success_any,
    )


def _flags(column: Sequence[int | None]) -> NDArray[np.bool_] | None:
    """A column of labels; None if it has none."""
    return None if None in column else np.array(column, dtype=bool)


def _say(name: str) -> str:
    return "version of energymargin" if name == "energymargin" else name


def _show(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value))
    text = str(value)
    return text[:12] if len(text) == 64 else text
