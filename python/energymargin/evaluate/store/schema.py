"""The tables of a store (SQLite).

    datasets   id, digest (and what its states are known by, if not their problems), task,
               parameters (JSON), states (how many)
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
    answers    question (digest), first, many, content: what came of its draws from the first on,
               as whoever asked it writes it down
    checksum   value: of all other tables

A score belongs to what the problem is, not to where it stands: two datasets with the same state at
the same number share it, and so do two runs that ask the same question. A state has one problem as
it is, and one more for each future that is asked of it.

The checksum finds what a disk has changed. Who leaves the file in order writes it, and the next
change removes it. So a file that is being written has none, nor has one whose scorer was killed.
"""

from __future__ import annotations

import hashlib
import sqlite3
import zlib
from contextlib import closing

# Marks the file as ours in SQLite's own header: "EMsc".
APPLICATION_ID = 0x454D7363
VERSION = 8

NO_FUTURE = "null"  # as JSON

_ANSWERED = """problem INTEGER NOT NULL REFERENCES problems, stream INTEGER NOT NULL,
    question INTEGER NOT NULL REFERENCES questions, {}, PRIMARY KEY (problem, stream, question)"""
_TABLES = f"""
CREATE TABLE datasets (
    id INTEGER PRIMARY KEY, digest TEXT UNIQUE, task TEXT NOT NULL, parameters TEXT,
    states INTEGER NOT NULL
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
    {_ANSWERED.format("value REAL NOT NULL, seconds REAL NOT NULL")}
) WITHOUT ROWID;
CREATE TABLE curves ({_ANSWERED.format("times BLOB NOT NULL, curve BLOB NOT NULL")});
CREATE TABLE particles ({_ANSWERED.format("scores BLOB NOT NULL")});
CREATE TABLE runs (
    id INTEGER PRIMARY KEY, dataset INTEGER NOT NULL REFERENCES datasets,
    future INTEGER NOT NULL REFERENCES futures, settings TEXT NOT NULL
);
CREATE TABLE asked (
    run INTEGER NOT NULL REFERENCES runs, question INTEGER NOT NULL REFERENCES questions,
    PRIMARY KEY (run, question)
) WITHOUT ROWID;
CREATE TABLE answers (
    question BLOB NOT NULL, first INTEGER NOT NULL, many INTEGER NOT NULL, content BLOB NOT NULL,
    PRIMARY KEY (question, first)
);
CREATE TABLE checksum (value INTEGER NOT NULL);
"""


def create(database: sqlite3.Connection) -> None:
    """Makes the tables that are not there, in the transaction that is open."""
    for statement in _TABLES.split(";"):
        if statement.strip():
            database.execute(statement.replace("TABLE", "TABLE IF NOT EXISTS", 1))
    database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    database.execute(f"PRAGMA user_version = {VERSION}")


def has_its_tables(database: sqlite3.Connection) -> bool:
    """Whether the tables of a file of this version are those that `create` makes."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as fresh:
        create(fresh)
        return _tables(database) == _tables(fresh)


def _tables(database: sqlite3.Connection) -> set[tuple[str, str]]:
    """The columns of all but SQLite's own, such as the statistics of ANALYZE."""
    return set(
        database.execute(
            "SELECT tables.name, columns.name "
            "FROM sqlite_master AS tables, pragma_table_info(tables.name) AS columns "
            r"WHERE tables.type = 'table' AND tables.name NOT LIKE 'sqlite\_%' ESCAPE '\'"
        )
    )


def state_digest(dataset: str, number: int) -> bytes:
    """Stands for the content of a recorded state, where a problem's own is not there to be read."""
    return hashlib.sha256(f"state {number} of the dataset {dataset}".encode()).digest()


def write_checksum(database: sqlite3.Connection) -> None:
    """Puts it in, in the transaction that is open, if it is not there."""
    if database.execute("SELECT 1 FROM checksum").fetchone() is None:
        database.execute("INSERT INTO checksum VALUES (?)", (_checksum(database),))


def has_its_checksum(database: sqlite3.Connection) -> bool:
    """Whether the file says what it said when the checksum was written, or has none."""
    written = database.execute("SELECT value FROM checksum").fetchall()
    return written in ([], [(_checksum(database),)])


def _checksum(database: sqlite3.Connection) -> int:
    """Checksum of all rows of all other tables, in any order."""
    return sum(
        zlib.crc32(repr((table, row)).encode())
        for table in {table for table, _ in _tables(database)} - {"checksum"}
        for row in database.execute(f"SELECT * FROM {table}")
    )
