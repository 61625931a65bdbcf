"""A checksum of all that a file of scores says: what a disk has changed since is found.

Who leaves the file in order, and alone, writes it; the next change takes it away again. So a file
that is being written has none, nor has one whose scorer was killed.
"""

from __future__ import annotations

import sqlite3
import zlib

TABLE = "CREATE TABLE checksum (value INTEGER NOT NULL);"


def write(database: sqlite3.Connection) -> None:
    """Puts it in, in the transaction that is open, if it is not there."""
    if database.execute("SELECT 1 FROM checksum").fetchone() is None:
        database.execute("INSERT INTO checksum VALUES (?)", (_value(database),))


def remove(database: sqlite3.Connection) -> None:
    """Takes it away, if it is there, in the transaction that is open."""
    if "checksum" in _tables(database):
        database.execute("DELETE FROM checksum")


def holds(database: sqlite3.Connection) -> bool:
    """Whether the file says what it said when the checksum was written, or has none."""
    if "checksum" not in _tables(database):
        return True
    written = database.execute("SELECT value FROM checksum").fetchall()
    return written in ([], [(_value(database),)])


def _value(database: sqlite3.Connection) -> int:
    """Checksum of all rows of all other tables, in any order."""
    return sum(
        zlib.crc32(repr((table, row)).encode())
        for table in _tables(database)
        if table != "checksum"
        for row in database.execute(f"SELECT * FROM {table}")
    )


def _tables(database: sqlite3.Connection) -> list[str]:
    """All but SQLite's own."""
    rows = database.execute(
        "SELECT name FROM sqlite_master "
        r"WHERE type = 'table' AND name NOT LIKE 'sqlite\_%' ESCAPE '\'"
    )
    return [name for (name,) in rows]
