"""What is written into a run: the problems that its states make, and their scores."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.executors import Row
from energymargin.store.run import FLOATS, Run


def pose(run: Run, digests: Mapping[int, bytes]) -> dict[int, tuple[str, ...]]:
    """Says which problems some states make, by their numbers; returns the metrics that each lacks
    in the store."""
    with run.store.transaction():
        return {number: _lacking(run, number, digest) for number, digest in digests.items()}


def _lacking(run: Run, number: int, digest: bytes) -> tuple[str, ...]:
    database = run.store.database
    database.execute("INSERT INTO problems (digest) VALUES (?) ON CONFLICT DO NOTHING", (digest,))
    (problem,) = database.execute("SELECT id FROM problems WHERE digest = ?", (digest,)).fetchone()
    database.execute(
        "INSERT INTO posed VALUES (?, ?, ?, ?) ON CONFLICT (dataset, future, number) "
        "DO UPDATE SET problem = excluded.problem WHERE problem != excluded.problem",
        (run.dataset, run.future_number, number, problem),
    )
    there = database.execute(
        "SELECT question FROM scores WHERE problem = ? AND stream = ?", (problem, number)
    ).fetchall()
    return tuple(metric for metric, question in run.asked.items() if (question,) not in there)


def add_rows(run: Run, rows: Sequence[Row]) -> None:
    """Inserts the scores of states that were posed, all or none."""
    database = run.store.database
    with run.store.transaction():
        for row in rows:
            (problem,) = database.execute(
                "SELECT problem FROM posed WHERE dataset = ? AND future = ? AND number = ?",
                (run.dataset, run.future_number, row.index),
            ).fetchone()
            for table, values in _inserted(run.asked, row):
                database.execute(
                    f"INSERT INTO {table} VALUES (?, ?{', ?' * len(values)}) "
                    "ON CONFLICT DO NOTHING",
                    (problem, row.index, *values),
                )


def _inserted(asked: Mapping[str, int], row: Row) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """The table of each value of a row, and its columns from the question on."""
    for metric, value in row.scores.items():
        if metric in asked and not math.isnan(value):
            yield "scores", (asked[metric], value, row.times.get(metric, 0.0))
    for metric, (times, curve) in row.curves.items():
        if metric in asked:
            yield "curves", (asked[metric], _packed(times), _packed(curve))
    for metric, values in row.particles.items():
        yield "particles", (asked[metric], _packed(values))


def _packed(numbers: NDArray[np.float64]) -> bytes:
    return np.asarray(numbers, FLOATS).tobytes()
