"""Whether the problems of a dataset are still those that a store knows its states by."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from energymargin.store.database import Database
from energymargin.store.run import Run
from energymargin.store.schema import state_digest

__all__ = ["Digests", "adopt", "forget_if_changed"]

Digests = Callable[[Sequence[int]], Mapping[int, bytes]]
"""Fingerprints of the problems of some states by their numbers, which rise; of those that make one.
"""

SAMPLE = 100  # states that are looked at; of a smaller dataset, all
BLOCK = 100  # states that are adopted at a time


def adopt(store: Database, run: Run, digests: Digests) -> None:
    """Gives the problems of a dataset that comes from an older file the digests they have now.

    `digests`: of the states as they are, for an older file asks of no future.
    """
    (old,) = store.database.execute(
        "SELECT digest_2 FROM datasets WHERE id = ?", (run.dataset,)
    ).fetchone()
    if old is None:
        return
    with store.transaction():
        for first in range(0, run.states, BLOCK):
            numbers = range(first, min(first + BLOCK, run.states))
            for number, new in digests(numbers).items():
                _rename(store.database, run, number, state_digest(old, number), new)
        store.database.execute("UPDATE datasets SET digest_2 = NULL WHERE id = ?", (run.dataset,))


def _rename(database: sqlite3.Connection, run: Run, number: int, old: bytes, new: bytes) -> None:
    """Gives a state's problem another digest; if there is one with that, its state and scores."""
    found = database.execute("SELECT digest, id FROM problems WHERE digest IN (?, ?)", (old, new))
    problems = dict(found.fetchall())
    if new not in problems:
        database.execute("UPDATE problems SET digest = ? WHERE digest = ?", (new, old))
    elif old in problems:
        database.execute(
            "UPDATE posed SET problem = ? WHERE dataset = ? AND number = ? AND problem = ?",
            (problems[new], run.dataset, number, problems[old]),
        )
        database.execute(
            "UPDATE OR IGNORE scores SET problem = ? WHERE problem = ?",
            (problems[new], problems[old]),
        )


def forget_if_changed(store: Database, run: Run, digests: Digests) -> None:
    """Looks up all states anew, if some of a sample make another problem than they once did.

    So it is when the task's code was changed since. A change that touches only a few states of a
    large dataset may be missed.
    """
    sample = np.unique(np.linspace(0, run.states - 1, SAMPLE).astype(int)).tolist()
    known = _known(store.database, run, sample)
    if known != digests(list(known)):
        with store.transaction():
            store.database.execute(
                "DELETE FROM posed WHERE dataset = ? AND future = ?",
                (run.dataset, run.future_number),
            )


def _known(database: sqlite3.Connection, run: Run, numbers: Sequence[int]) -> dict[int, bytes]:
    """Digests of the problems of these states, as far as the store has them; in their order."""
    found = {}
    for number in numbers:
        row = database.execute(
            "SELECT digest FROM posed JOIN problems ON problem = problems.id "
            "WHERE dataset = ? AND future = ? AND number = ?",
            (run.dataset, run.future_number, number),
        ).fetchone()
        if row is not None:
            found[number] = row[0]
    return found
