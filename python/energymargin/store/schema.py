"""The tables of a store of scores (SQLite), and how an older file becomes one.

    datasets   id, digest (and what its states are known by, if not their problems), task,
               parameters (JSON), states (how many), digest_2 (of version 2)
    states     dataset, number, trajectory, frame, captured, success, captured_any, success_any
               (NULL: one set for all objects)
    futures    id, asks (JSON: horizon [frames], plan, check, dwell; null: of the state as it is)
    problems   id, digest: SHA-256 of what the problem is
    posed      dataset, future, number, problem: that of a state with a future, once it was made
    questions  id, metric, settings (JSON: those that change this metric), algorithm
    scores     problem, stream, question, value (inf: no escape was found), seconds
    curves     problem, stream, question, times [s], curve (probability until each): float64, little
               endian, of the scores that have one
    particles  problem, stream, question, scores: float64, of a belief, whose mean is the score
    runs       id, dataset, future, settings (JSON: all of them)
    asked      run, question: what a run asks of each state of its dataset
    scorers    id, host, process, until: who is at work, and how long others believe that [s]
    claims     problem, stream, question, scorer: what is being computed
    checksum   value: of all other tables, while nobody writes

A score belongs to what the problem is, not to where it stands: two datasets with the same state at
the same number share it, and so do two runs that ask the same question. A state has one problem as
it is, and one more for each future that is asked of it.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from contextlib import closing
from typing import Any

from energymargin.metrics import METRICS
from energymargin.scoring.settings import LATER, SearchSettings
from energymargin.store import checksum

__all__ = [
    "APPLICATION_ID",
    "NO_FUTURE",
    "VERSION",
    "create",
    "future_number",
    "has_its_tables",
    "migrate",
    "state_digest",
    "with_those_before",
]

# Marks the file as ours in SQLite's own header: "EMsc".
APPLICATION_ID = 0x454D7363
# 1 had no labels of at least one object; 1 and 2 were of one dataset and one choice of settings; up
# to 3 a state had one problem; up to 4 there were no beliefs; up to 5 no checksum
VERSION = 6

NO_FUTURE = "null"  # as JSON

_TABLES = """
CREATE TABLE datasets (
    id INTEGER PRIMARY KEY, digest TEXT UNIQUE, task TEXT NOT NULL, parameters TEXT,
    states INTEGER NOT NULL, digest_2 TEXT
);
CREATE TABLE problems (id INTEGER PRIMARY KEY, digest BLOB NOT NULL UNIQUE);
CREATE TABLE states (
    dataset INTEGER NOT NULL REFERENCES datasets, number INTEGER NOT NULL,
    trajectory INTEGER NOT NULL, frame INTEGER NOT NULL,
    captured INTEGER NOT NULL, success INTEGER NOT NULL,
    captured_any INTEGER, success_any INTEGER,
    PRIMARY KEY (dataset, number)
) WITHOUT ROWID;
CREATE TABLE futures (id INTEGER PRIMARY KEY, asks TEXT NOT NULL UNIQUE);
CREATE TABLE posed (
    dataset INTEGER NOT NULL REFERENCES datasets, future INTEGER NOT NULL REFERENCES futures,
    number INTEGER NOT NULL, problem INTEGER NOT NULL REFERENCES problems,
    PRIMARY KEY (dataset, future, number)
) WITHOUT ROWID;
CREATE TABLE questions (
    id INTEGER PRIMARY KEY, metric TEXT NOT NULL, settings TEXT NOT NULL, algorithm TEXT NOT NULL,
    UNIQUE (metric, settings, algorithm)
);
CREATE TABLE scores (
    problem INTEGER NOT NULL REFERENCES problems, stream INTEGER NOT NULL,
    question INTEGER NOT NULL REFERENCES questions, value REAL NOT NULL, seconds REAL NOT NULL,
    PRIMARY KEY (problem, stream, question)
) WITHOUT ROWID;
CREATE TABLE curves (
    problem INTEGER NOT NULL REFERENCES problems, stream INTEGER NOT NULL,
    question INTEGER NOT NULL REFERENCES questions, times BLOB NOT NULL, curve BLOB NOT NULL,
    PRIMARY KEY (problem, stream, question)
);
CREATE TABLE particles (
    problem INTEGER NOT NULL REFERENCES problems, stream INTEGER NOT NULL,
    question INTEGER NOT NULL REFERENCES questions, scores BLOB NOT NULL,
    PRIMARY KEY (problem, stream, question)
);
CREATE TABLE runs (
    id INTEGER PRIMARY KEY, dataset INTEGER NOT NULL REFERENCES datasets,
    future INTEGER NOT NULL REFERENCES futures, settings TEXT NOT NULL
);
CREATE TABLE asked (
    run INTEGER NOT NULL REFERENCES runs, question INTEGER NOT NULL REFERENCES questions,
    PRIMARY KEY (run, question)
) WITHOUT ROWID;
CREATE TABLE scorers (
    id INTEGER PRIMARY KEY AUTOINCREMENT, host TEXT NOT NULL, process INTEGER NOT NULL,
    until REAL NOT NULL
);
CREATE TABLE claims (
    problem INTEGER NOT NULL, stream INTEGER NOT NULL, question INTEGER NOT NULL,
    scorer INTEGER NOT NULL REFERENCES scorers ON DELETE CASCADE,
    PRIMARY KEY (problem, stream, question)
) WITHOUT ROWID;
CREATE INDEX claims_of_scorer ON claims (scorer);
"""
_TABLES += checksum.TABLE

# Settings that older files do not name, as they were then.
_BEFORE = {
    **{"nodes_per_edge": 1, "least_likelihood": 0.0, "stop_at_escape": False, "rollouts": 30},
    **LATER,
}
# Settings of older files that are none of a search.
_OF_FILE = ("task", "dataset", "metrics", "energymargin")


def create(database: sqlite3.Connection) -> None:
    """Makes the tables that are not there, in the transaction that is open."""
    for statement in _TABLES.split(";"):
        if statement.strip():
            once = statement.replace("TABLE", "TABLE IF NOT EXISTS", 1)
            database.execute(once.replace("CREATE INDEX", "CREATE INDEX IF NOT EXISTS", 1))
    database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    database.execute(f"PRAGMA user_version = {VERSION}")


def has_its_tables(database: sqlite3.Connection) -> bool:
    """Whether the tables of a file of this version are those that `create` makes."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as fresh:
        create(fresh)
        return _tables(database) == _tables(fresh)


def _tables(database: sqlite3.Connection) -> set[tuple[str, str]]:
    """All but SQLite's own, such as the statistics of ANALYZE."""
    return set(
        database.execute(
            "SELECT name, sql FROM sqlite_master "
            r"WHERE sql IS NOT NULL AND name NOT LIKE 'sqlite\_%' ESCAPE '\'"
        )
    )


def state_digest(dataset: str, number: int) -> bytes:
    """Stands for the content of a recorded state, where a problem's own is not there to be read."""
    return hashlib.sha256(f"state {number} of the dataset {dataset}".encode()).digest()


def future_number(database: sqlite3.Connection, asks: str) -> int:
    """Of a future (JSON), which is put in if it is not there."""
    database.execute("INSERT INTO futures (asks) VALUES (?) ON CONFLICT DO NOTHING", (asks,))
    (number,) = database.execute("SELECT id FROM futures WHERE asks = ?", (asks,)).fetchone()
    return int(number)


def migrate(database: sqlite3.Connection, version: int) -> None:
    """Brings a file of an older version to this one, in the transaction that is open."""
    if version < 3:
        _migrate_one_run(database, version)
    elif version == 3:
        _migrate_one_problem_a_state(database)
    else:
        create(database)


def _migrate_one_problem_a_state(database: sqlite3.Connection) -> None:
    """Of version 3: each state's problem is the one without a future."""
    for table in ("asked", "runs", "states"):
        database.execute(f"ALTER TABLE {table} RENAME TO old_{table}")
    create(database)
    future = future_number(database, NO_FUTURE)
    database.execute(
        "INSERT INTO states SELECT dataset, number, trajectory, frame, captured, success, "
        "captured_any, success_any FROM old_states"
    )
    database.execute(
        "INSERT INTO posed SELECT dataset, ?, number, problem FROM old_states "
        "WHERE problem IS NOT NULL",
        (future,),
    )
    for number, dataset, settings in database.execute("SELECT id, dataset, settings FROM old_runs"):
        named = with_those_before(json.loads(settings))
        database.execute(
            "INSERT INTO runs VALUES (?, ?, ?, ?)", (number, dataset, future, _json(named))
        )
    database.execute("INSERT INTO asked SELECT run, question FROM old_asked")
    for table in ("asked", "runs", "states"):
        database.execute(f"DROP TABLE old_{table}")


def with_those_before(settings: dict[str, Any]) -> dict[str, Any]:
    """The settings of a run, with those that its older file does not name."""
    named = _BEFORE | settings if "nodes" in settings else settings
    return dict(sorted(named.items()))


def _migrate_one_run(database: sqlite3.Connection, version: int) -> None:
    """Of the versions 1 and 2, of one dataset.

    Its problems are known by the old fingerprint of their dataset alone, until it is scored again.
    """
    database.execute("ALTER TABLE states RENAME TO old_states")
    database.execute("ALTER TABLE scores RENAME TO old_scores")
    create(database)
    settings = {
        name: json.loads(value)
        for name, value in database.execute("SELECT name, value FROM settings")
    }
    count = _move_states(database, settings, some=version > 1)
    _move_scores(database, settings)
    for table in ("settings", "old_scores", "old_states"):
        database.execute(f"DROP TABLE {table}")
    database.execute("UPDATE datasets SET states = ?", (count,))


def _move_states(database: sqlite3.Connection, settings: dict[str, Any], some: bool) -> int:
    """The one dataset, its states, and a problem for each; returns how many."""
    digest = settings["dataset"]
    database.execute(
        "INSERT INTO datasets VALUES (1, NULL, ?, NULL, 0, ?)", (settings["task"], digest)
    )
    any_object = "captured_any, success_any" if some else "NULL, NULL"
    states = database.execute(
        f"SELECT trajectory, frame, captured, success, {any_object} FROM old_states "
        "ORDER BY trajectory, frame"
    ).fetchall()
    problems = [(n + 1, state_digest(digest, n)) for n in range(len(states))]
    database.executemany("INSERT INTO problems VALUES (?, ?)", problems)
    database.executemany(
        "INSERT INTO states VALUES (1, ?, ?, ?, ?, ?, ?, ?)",
        [(n, *state) for n, state in enumerate(states)],
    )
    future = future_number(database, NO_FUTURE)
    database.executemany(
        "INSERT INTO posed VALUES (1, ?, ?, ?)", [(future, n, n + 1) for n in range(len(states))]
    )
    return len(states)


def _move_scores(database: sqlite3.Connection, settings: dict[str, Any]) -> None:
    """The one run, its questions, and the scores; the first metric has a state's whole time."""
    numbers = {name: value for name, value in settings.items() if name not in _OF_FILE}
    if set(settings["metrics"]) <= set(METRICS):
        numbers = with_those_before(numbers)
    future = future_number(database, NO_FUTURE)
    database.execute("INSERT INTO runs VALUES (1, 1, ?, ?)", (future, _json(numbers)))
    for question, metric in enumerate(settings["metrics"], start=1):
        own = SearchSettings(**numbers).of(metric) if "nodes" in numbers else numbers
        database.execute(
            "INSERT INTO questions VALUES (?, ?, ?, ?)",
            (question, metric, _json(own), settings["energymargin"]),
        )
        database.execute("INSERT INTO asked VALUES (1, ?)", (question,))
        database.execute(
            "INSERT INTO scores SELECT problem, number, ?, value, iif(?, seconds, 0) "
            "FROM old_scores JOIN old_states USING (trajectory, frame) "
            "JOIN states USING (trajectory, frame) JOIN posed USING (dataset, number) "
            "WHERE metric = ? AND seconds IS NOT NULL",
            (question, question == 1, metric),
        )


def _json(settings: dict[str, Any]) -> str:
    return json.dumps(settings, sort_keys=True)
