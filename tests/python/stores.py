"""Stores in tests: settings, a run that stops, and files that are read while others write them."""

import sqlite3
import time

import numpy as np

from energymargin.evaluate.searches import SearchSettings
from energymargin.store import ScoreStore

NODES, SEED = 20, 3
SETTINGS = SearchSettings(nodes=NODES, seed=SEED)


class Stop(Exception):
    pass


def stop_after(count):
    """A progress that ends the run once so many states are scored.

    After the first one there are others to come: later ones may all come in one chunk.
    """

    def progress(done, _total):
        if done >= count:
            raise Stop

    return progress


class Counts(list):
    """A progress that notes each count."""

    def __call__(self, *count):
        self.append(count)


def same(found, table):
    """Whether scores by metric are those of a table, to the last bit."""
    return set(found) == set(table.scores) and all(
        np.array_equal(found[metric], table[metric]) for metric in found
    )


def scores(path, run=None):
    """By metric, of a run, or of the only one."""
    with ScoreStore(path) as store:
        return store.run(run).labelled_scores().scores


def rows(path, table):
    """How many there are, looked at from outside."""
    with sqlite3.connect(path) as file:
        return file.execute(f"SELECT count(*) FROM {table}").fetchone()[0]


def changed(path, statement, values=()):
    """Changes a file of scores on purpose."""
    with sqlite3.connect(path) as file:
        file.execute("DELETE FROM checksum")
        file.execute(statement, values)


def score_count(path):
    """How many scores there are; none before there is a file, or it has tables."""
    if not path.exists():
        return 0
    with sqlite3.connect(path, timeout=10) as file:
        tables = file.execute("SELECT count(*) FROM sqlite_master WHERE name = 'scores'")
        if tables.fetchone() == (0,):
            return 0
        return file.execute("SELECT count(*) FROM scores").fetchone()[0]


def await_scores(process, path, count):
    """Waits until there are so many, which a process that runs writes."""
    deadline = time.monotonic() + 60
    while score_count(path) < count:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.005)
