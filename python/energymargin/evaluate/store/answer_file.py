"""A store: an SQLite file that is opened, checked, and written in transactions."""

from __future__ import annotations

import errno
import hashlib
import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from energymargin.base.aliases import AnyPath
from energymargin.base.closing import Closing
from energymargin.base.locks import Lock
from energymargin.evaluate.searches import algorithm
from energymargin.evaluate.store import schema

HDF5 = b"\x89HDF\r\n\x1a\n"  # as such files begin
WAIT = 10.0  # s; how long another program may hold the file
CACHE = 8192  # KiB of the file in memory; with 65536 a transaction takes longer, not less
CHECKED = 2**28  # bytes; beyond, a check of the whole file takes longer than people would wait
SUMMED = 2**25  # bytes, a million rows; beyond, the checksum of what they say takes more than 2 s


class AnswerFile(Closing):
    """An open store; close it, or use it in a `with` statement."""

    doing = "scoring into"
    """What the one that has it open with `create` does, as another one is told."""

    def __init__(self, path: AnyPath, *, create: bool = False) -> None:
        """Opens a file; with `create` to put scores in, and makes it if there is none.

        Raises FileNotFoundError if there is
        none, PermissionError if it or its folder cannot be written (as is needed to read it, too,
        unless it is open elsewhere), ValueError if it is not a file of scores, is damaged, or comes
        from another version, and with the number of another process that puts scores in.
        """
        self.path = Path(path)
        self._absolute = Path(os.path.abspath(path))  # the process may change its folder
        self._may_have_written = False
        self._lock: Lock | None = None
        is_new = not self.path.exists()
        if is_new and not create:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(self.path))
        if not self.path.parent.is_dir():
            raise FileNotFoundError(errno.ENOENT, "no such folder", str(self.path.parent))
        if self.path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(self.path))
        with self._named():
            self.database = sqlite3.connect(self.path, timeout=WAIT, isolation_level=None)
        try:
            with self._named():
                self._open(create)
            self._identity = _identity(self._absolute)
            self._lock = Lock(self.path, self.doing) if create else None
        except BaseException:
            self.close()
            if is_new and self.path.exists() and not self.path.stat().st_size:  # on a full disk
                self.path.unlink()
            raise

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """All that is written in it is committed, or nothing.

        Raises OSError if the disk is full, PermissionError if the file cannot be written,
        TimeoutError if another program holds it; FileNotFoundError as `require_in_place`, after the
        commit.
        """
        with self._committed():
            before = self.database.total_changes
            yield
            if self.database.total_changes > before:
                self.database.execute("DELETE FROM checksum")
        self.require_in_place()

    @contextmanager
    def _committed(self) -> Iterator[None]:
        with self._named():
            self.database.execute("BEGIN IMMEDIATE")
            self._may_have_written = True
            try:
                yield
                self.database.execute("COMMIT")
            except BaseException:
                if self.database.in_transaction:
                    self.database.execute("ROLLBACK")
                raise

    @staticmethod
    def key(*asked: object) -> bytes:
        """The digest of a question, by all that its answer depends on, and by the version since
        which the same question has the same bits."""
        return hashlib.sha256(repr((algorithm(), *asked)).encode()).digest()

    def answer(self, question: bytes, first: int = 0) -> bytes | None:
        """What was kept of a question's draws from `first` on; None if it is not there."""
        asked = "SELECT content FROM answers WHERE question = ? AND first = ?"
        row = self.database.execute(asked, (question, first)).fetchone()
        return None if row is None else bytes(row[0])

    def spans(self, question: bytes) -> list[tuple[int, int]]:
        """Which draws of a question have answers, rising: the first, and the one after the last."""
        asked = "SELECT first, first + many FROM answers WHERE question = ? ORDER BY first"
        return self.database.execute(asked, (question,)).fetchall()

    def keep(self, question: bytes, content: bytes, first: int = 0, many: int = 1) -> None:
        """Keeps what came of so many draws. Errors: as `transaction`."""
        with self.transaction():
            row = (question, first, many, content)
            self.database.execute("INSERT OR REPLACE INTO answers VALUES (?, ?, ?, ?)", row)

    def value(self, question: str) -> Any:
        """What a question with one answer gives."""
        return self.database.execute(question).fetchone()[0]

    def number_of(self, table: str, **key: Any) -> int:
        """The number of the row with this key, which is inserted if it is not there."""
        names, marks = ", ".join(key), ", ".join("?" * len(key))
        insert = f"INSERT INTO {table} ({names}) VALUES ({marks}) ON CONFLICT DO NOTHING"
        select = f"SELECT id FROM {table} WHERE ({names}) = ({marks})"
        self.database.execute(insert, tuple(key.values()))
        return int(self.database.execute(select, tuple(key.values())).fetchone()[0])

    def require_in_place(self) -> None:
        """Raises FileNotFoundError if the file was renamed or removed since it was opened. A file
        of another name then has all that was written."""
        if _identity(self._absolute) != self._identity:
            # SQLite does not do so when it closes a file of another name, whose log it would lose.
            self.database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            raise FileNotFoundError(
                errno.ENOENT,
                "was renamed or removed while it was written: under its new name it has all "
                "scores; give it the old name again, and the same command goes on",
                str(self.path),
            )

    def close(self, *, remove: bool = False) -> None:
        """Closes the file; with `remove` it goes."""
        self.database.close()
        if remove:
            self.path.unlink()
        if self._lock is not None:
            self._lock.close()

    def __exit__(self, *error: object) -> None:
        """Closes it, with a checksum if it may have been written and all went well."""
        went_well = error[:1] == (None,)
        try:
            if self._may_have_written and went_well and self._is_smaller_than(SUMMED):
                with suppress(OSError), self._committed():
                    schema.write_checksum(self.database)
        finally:
            self.close()

    def _is_smaller_than(self, size: int) -> bool:
        return self.path.exists() and self.path.stat().st_size < size

    def _open(self, create: bool) -> None:
        self.database.execute("PRAGMA foreign_keys = ON")
        self.database.execute(f"PRAGMA cache_size = -{CACHE}")
        if create and not self.value("SELECT count(*) FROM sqlite_master"):
            with self._committed():
                schema.create(self.database)
        self._check_format()
        self.database.execute("PRAGMA journal_mode = WAL")
        self.database.execute("PRAGMA synchronous = NORMAL")

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Turns errors of SQLite into errors that name the file, and say what to do."""
        try:
            yield
        except sqlite3.DatabaseError as error:
            raise self._in_words(error) from error

    def _in_words(self, error: sqlite3.DatabaseError) -> Exception:
        text, path = str(error), str(self.path)
        if isinstance(error, (sqlite3.IntegrityError, sqlite3.ProgrammingError)):
            return error
        if "locked" in text:
            return TimeoutError(f"{path} was held by another program for {WAIT:.0f} s")
        if "full" in text:
            advice = "what was written before is safe: make room, and the same command goes on"
            return OSError(errno.ENOSPC, f"the disk is full; {advice}", path)
        if "readonly" in text or "unable to open" in text:
            advice = "it and its folder must be writable: copy it, or choose another place"
            return PermissionError(errno.EACCES, f"{text}; {advice}", path)
        if "disk I/O" in text:
            return OSError(errno.EIO, text, path)
        return ValueError(f"{path} is not a file of scores{_why(self.path, text)}")

    def _check_format(self) -> None:
        if self.value("PRAGMA application_id") != schema.APPLICATION_ID:
            what = "it is empty, or an SQLite file of something else"
            raise ValueError(f"{self.path} is not a file of scores: {what}")
        version = self.value("PRAGMA user_version")
        if version != schema.VERSION:
            way = "update it" if version > schema.VERSION else "give another name, and score again"
            text = f"{self.path} has version {version} of the scores' format"
            raise ValueError(f"{text}, and this energymargin reads version {schema.VERSION}: {way}")
        small = self._is_smaller_than(CHECKED)
        if small and (state := self.value("PRAGMA quick_check(1)")) != "ok":
            raise ValueError(f"{self.path} is damaged: {' '.join(state.split())}")
        if self._is_smaller_than(SUMMED) and not self._has_its_checksum():
            text = f"{self.path} is damaged, as its checksum says"
            text += ": take a copy of it from elsewhere, or remove it; if it was changed on purpose"
            raise ValueError(f"{text}, DELETE FROM checksum in SQLite takes it")
        if not schema.has_its_tables(self.database):
            text = f"{self.path} is damaged: its tables are not those of a file of scores"
            raise ValueError(text)

    def _has_its_checksum(self) -> bool:
        self.database.execute("BEGIN")  # a snapshot, whatever others write meanwhile
        try:
            return schema.has_its_checksum(self.database)
        finally:
            self.database.execute("COMMIT")


def _identity(path: Path) -> tuple[int, int] | None:
    """Device and inode of a file, equal for all its names; None if there is no file."""
    with suppress(OSError):
        status = path.stat()
        return status.st_dev, status.st_ino
    return None


def _why(path: Path, text: str) -> str:
    """What a file is that SQLite does not read, and what to do."""
    with path.open("rb") as file:
        if file.read(len(HDF5)) == HDF5:
            way = f"whose scores `energymargin score {path}` makes"
            return f": it is an HDF5 file, as a dataset is, {way}"
    if "not a database" in text:
        return f": {text}; give another name"
    return f", or damaged: {text}; give another name, or remove it"
