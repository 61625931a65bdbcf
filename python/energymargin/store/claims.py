"""Claims: several scorers on one store share the work, and take over that of a dead one.

A scorer claims the scores that it is about to compute, and renews its lease from time to time. Its
claims end with the lease, or with its process on this machine. If a scorer was only slow, two
compute the same score, which does no harm.
"""

from __future__ import annotations

import math
import os
import socket
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin.beliefs.gathering import BeliefRow
from energymargin.closing import Closing
from energymargin.executors import Row
from energymargin.processes import is_running
from energymargin.store.database import Database
from energymargin.store.run import FLOATS, Run

__all__ = ["Claim", "Scorer"]

LEASE = 60.0  # s; how long the claims of a scorer count that does not renew it
BEAT = 5.0  # s; how often a lease is renewed
SIGN_OFF = 0.2  # s; how long a scorer that leaves waits for the file


@dataclass(frozen=True)
class Claim:
    """The scores of a state that a scorer may compute now."""

    metrics: tuple[str, ...]
    """Those that are missing, and that nobody else computes."""
    taken: bool
    """Whether somebody else computes other missing ones."""


class Scorer(Closing):
    """A scorer of one run. Use it in a `with` statement, at whose end its claims are given up."""

    def __init__(self, store: Database, run: Run) -> None:
        """Registers the scorer in the store."""
        self._store, self._run, self._database = store, run, store.database
        self._problems: dict[int, int] = {}  # of the claimed states, by their numbers
        self._renewed = 0.0
        with store.transaction():
            self._remove_gone()
            (others,) = self._database.execute("SELECT count(*) FROM scorers").fetchone()
            self.start = int(run.states * _share(others))
            """The state at which it begins: each scorer at another one."""
            (self._number,) = self._database.execute(
                "INSERT INTO scorers (host, process, until) VALUES (?, ?, ?) RETURNING id",
                (socket.gethostname(), os.getpid(), time.time() + LEASE),
            ).fetchone()

    def claim(self, digests: Mapping[int, bytes]) -> dict[int, Claim]:
        """Claims the missing scores of these states; `digests` are of their problems, by number."""
        with self._store.transaction():
            self._remove_gone()
            self._renew()
            return {
                number: self._claim(number, self._problem(number, digest))
                for number, digest in digests.items()
            }

    def add(self, rows: Sequence[Row]) -> None:
        """Inserts the scores of these rows, all or none, and gives up the claims on them."""
        asked = self._run.asked
        with self._store.transaction():
            self._renew()
            for row in rows:
                problem = self._problems[row.index]
                self._database.executemany(
                    "INSERT INTO scores VALUES (?, ?, ?, ?, ?) ON CONFLICT DO NOTHING",
                    [
                        (problem, row.index, asked[metric], value, row.times.get(metric, 0.0))
                        for metric, value in row.scores.items()
                        if metric in asked and not math.isnan(value)
                    ],
                )
                self._database.executemany(
                    "INSERT INTO curves VALUES (?, ?, ?, ?, ?) ON CONFLICT DO NOTHING",
                    [
                        (problem, row.index, asked[metric], *map(_packed, curve))
                        for metric, curve in row.curves.items()
                        if metric in asked
                    ],
                )
                self._database.executemany(
                    "INSERT INTO particles VALUES (?, ?, ?, ?) ON CONFLICT DO NOTHING",
                    [
                        (problem, row.index, asked[metric], _packed(values))
                        for metric, values in _particles(row).items()
                    ],
                )
            self._give_up([row.index for row in rows])
        self._forget([row.index for row in rows])

    def give_up(self, numbers: Sequence[int]) -> None:
        """Gives up the claims on these states."""
        with self._store.transaction():
            self._give_up(numbers)
        self._forget(numbers)

    def beat(self) -> None:
        """Renews the lease, if it is time to."""
        if time.monotonic() > self._renewed + BEAT:
            with self._store.transaction():
                self._renew()

    def alone(self) -> bool:
        """Whether there is no other scorer."""
        (count,) = self._database.execute("SELECT count(*) FROM scorers").fetchone()
        return bool(count == 1)

    def close(self) -> None:
        """Removes the scorer and its claims; on a full disk others see that its process is gone."""
        with suppress(OSError), self._store.transaction(SIGN_OFF):
            self._database.execute("DELETE FROM scorers WHERE id = ?", (self._number,))

    def _problem(self, number: int, digest: bytes) -> int:
        """The number of the problem with this digest, which becomes that of the state."""
        self._database.execute(
            "INSERT INTO problems (digest) VALUES (?) ON CONFLICT DO NOTHING", (digest,)
        )
        (problem,) = self._database.execute(
            "SELECT id FROM problems WHERE digest = ?", (digest,)
        ).fetchone()
        self._database.execute(
            "INSERT INTO posed VALUES (?, ?, ?, ?) ON CONFLICT (dataset, future, number) "
            "DO UPDATE SET problem = excluded.problem WHERE problem != excluded.problem",
            (self._run.dataset, self._run.future_number, number, problem),
        )
        self._problems[number] = problem
        return int(problem)

    def _claim(self, number: int, problem: int) -> Claim:
        there = self._questions("scores", problem, number)
        taken = self._questions("claims", problem, number)
        lacking = {metric: q for metric, q in self._run.asked.items() if q not in there}
        free = {metric: q for metric, q in lacking.items() if q not in taken}
        self._database.executemany(
            "INSERT INTO claims VALUES (?, ?, ?, ?)",
            [(problem, number, question, self._number) for question in free.values()],
        )
        return Claim(tuple(free), taken=len(free) < len(lacking))

    def _questions(self, table: str, problem: int, number: int) -> set[int]:
        rows = self._database.execute(
            f"SELECT question FROM {table} WHERE problem = ? AND stream = ?", (problem, number)
        )
        return {question for (question,) in rows}

    def _give_up(self, numbers: Sequence[int]) -> None:
        self._database.executemany(
            "DELETE FROM claims WHERE problem = ? AND stream = ? AND scorer = ?",
            [(self._problems[number], number, self._number) for number in numbers],
        )

    def _forget(self, numbers: Sequence[int]) -> None:
        for number in numbers:
            del self._problems[number]

    def _renew(self) -> None:
        self._renewed = time.monotonic()
        self._database.execute(
            "INSERT INTO scorers VALUES (?, ?, ?, ?) "
            "ON CONFLICT (id) DO UPDATE SET until = excluded.until",
            (self._number, socket.gethostname(), os.getpid(), time.time() + LEASE),
        )

    def _remove_gone(self) -> None:
        """Removes the scorers whose lease or process has ended, with their claims."""
        now, here = time.time(), socket.gethostname()
        scorers = self._database.execute("SELECT id, host, process, until FROM scorers").fetchall()
        gone = [
            (number,)
            for number, host, process, until in scorers
            if until < now or (host == here and not is_running(process))
        ]
        self._database.executemany("DELETE FROM scorers WHERE id = ?", gone)


def _particles(row: Row) -> Mapping[str, NDArray[np.float64]]:
    """By metric, the scores of a belief's particles; of a problem there are none."""
    return row.values if isinstance(row, BeliefRow) else {}


def _packed(numbers: NDArray[np.float64]) -> bytes:
    return np.asarray(numbers, FLOATS).tobytes()


def _share(others: int) -> float:
    """The share of the states at which to begin beside so many others: 0, 1/2, 1/4, 3/4, ..."""
    return int(f"{others:b}"[::-1], 2) / (1 << others.bit_length())
