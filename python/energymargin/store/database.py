"""The SQLite file of scores: it is opened, checked, and written in transactions."""

from __future__ import annotations

import errno
import os
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from energymargin.closing import Closing
from energymargin.interrupts import since_interrupt
from energymargin.store import checksum, schema

__all__ = ["Database"]

# How long the file may be held by another process [s], and how often a signal is looked at.
PATIENCE = 600.0
WAIT = 0.1
CACHE = 8192  # KiB of the file in memory; with 65536 a transaction takes longer, not less
CHECKED = 2**28  # bytes; beyond, a check of the whole file takes longer than people would wait
SUMMED = 2**25  # bytes, a million rows; beyond, the checksum of what they say takes more than 2 s
DESCRIPTORS = Path("/proc/self/fd")  # of Linux: the present names of all files that are open


class Database(Closing):
    """An open file of scores, as a database; close it, or use it in a `with` statement."""

    def __init__(self, path: str | os.PathLike[str], *, create: bool = False) -> None:
        """Opens a file, or with `create` makes it if there is none.

        A file of an older version is brought to this one. Raises FileNotFoundError if there is
        none, PermissionError if it or its folder cannot be written (as is needed to read it, too,
        unless it is open elsewhere), ValueError if it is not a file of scores, is damaged, or comes
        from a newer version.
        """
        self.path = Path(path)
        self._may_have_written = False
        self._place = _OpenPlace(self.path)
        if not self.path.exists():
            if not create:
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
            self._place.begin()
        except BaseException:
            self.database.close()
            raise

    @contextmanager
    def transaction(self, patience: float = PATIENCE) -> Iterator[None]:
        """All that is written in it is committed, or nothing; others wait for its end.

        Raises OSError if the disk is full, PermissionError if the file cannot be written,
        TimeoutError if another process holds it for longer than `patience` [s], KeyboardInterrupt
        if it does so after Ctrl-C; FileNotFoundError as `require_in_place`, after the commit.
        """
        with self._committed(patience):
            self._may_have_written, before = True, self.database.total_changes
            yield
            if self.database.total_changes > before:
                checksum.remove(self.database)
        self.require_in_place()

    @contextmanager
    def _committed(self, patience: float) -> Iterator[None]:
        with self._named():
            self._retried("BEGIN IMMEDIATE", patience)
            try:
                yield
                self._retried("COMMIT")
            except BaseException:
                if self.database.in_transaction:
                    self.database.execute("ROLLBACK")
                raise

    def require_in_place(self) -> None:
        """Raises FileNotFoundError if the file was renamed or removed since it was opened. The file
        of the new name then has all that was written."""
        change = self._place.change()
        if change:
            # SQLite does not do so when it closes a file of another name, whose log it would lose.
            self.database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            raise FileNotFoundError(errno.ENOENT, change, str(self.path))

    def close(self) -> None:
        """Closes the file."""
        self.database.close()

    def __exit__(self, *error: object) -> None:
        """Closes it, with a checksum if it may have been written and all went well."""
        went_well = error[:1] == (None,)
        try:
            if self._may_have_written and went_well and self._is_smaller_than(SUMMED):
                with suppress(OSError), self._committed(WAIT):
                    checksum.write(self.database)
        finally:
            self.close()

    def _is_smaller_than(self, size: int) -> bool:
        return self.path.exists() and self.path.stat().st_size < size

    def _open(self, create: bool) -> None:
        self.database.execute("PRAGMA foreign_keys = ON")
        self.database.execute(f"PRAGMA cache_size = -{CACHE}")
        if create and self._is_empty():
            with self.transaction():
                if self._is_empty():  # still, now that nobody else can make it
                    schema.create(self.database)
        self._check_format()
        self._retried("PRAGMA journal_mode = WAL")
        self.database.execute("PRAGMA synchronous = NORMAL")
        if self._version() < schema.VERSION:
            with self.transaction():
                if self._version() < schema.VERSION:
                    schema.migrate(self.database)

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Turns errors of SQLite into errors that name the file, and say what to do."""
        try:
            yield
        except sqlite3.DatabaseError as error:
            raise self._in_words(error) from error

    def _in_words(self, error: sqlite3.DatabaseError) -> Exception:
        text, path = str(error), str(self.path)
        if _is_busy(error) or isinstance(error, (sqlite3.IntegrityError, sqlite3.ProgrammingError)):
            return error
        if "full" in text:
            advice = "what was written before is safe: make room, and the same command goes on"
            return OSError(errno.ENOSPC, f"the disk is full; {advice}", path)
        if "readonly" in text or "unable to open" in text:
            advice = "it and its folder must be writable: copy it, or choose another place"
            return PermissionError(errno.EACCES, f"{text}; {advice}", path)
        if "disk I/O" in text:
            return OSError(errno.EIO, text, path)
        return ValueError(f"{path} is not a file of scores, or damaged: {text}")

    def _is_empty(self) -> bool:
        (tables,) = self._retried("SELECT count(*) FROM sqlite_master").fetchone()
        return bool(tables == 0)

    def _version(self) -> int:
        return int(self._retried("PRAGMA user_version").fetchone()[0])

    def _check_format(self) -> None:
        (application,) = self._retried("PRAGMA application_id").fetchone()
        if application != schema.APPLICATION_ID:
            raise ValueError(
                f"{self.path} is not a file of scores: it is empty, or an SQLite file of something "
                "else"
            )
        version = self._version()
        if version > schema.VERSION:
            raise ValueError(
                f"{self.path} has version {version} of the scores' format, "
                f"and this energymargin reads up to {schema.VERSION}: update it"
            )
        if version < schema.OLDEST:
            raise ValueError(
                f"{self.path} has version {version} of the scores' format, and this energymargin "
                f"reads versions {schema.OLDEST} and {schema.VERSION}: open it once with 0.13, "
                "which brings it up to date, or score the dataset again"
            )
        if self._is_smaller_than(CHECKED):
            (state,) = self._retried("PRAGMA quick_check(1)").fetchone()
            if state != "ok":
                raise ValueError(f"{self.path} is damaged: {' '.join(state.split())}")
        if self._is_smaller_than(SUMMED) and not self._says_what_was_written():
            raise ValueError(
                f"{self.path} is damaged, as its checksum says: take a copy of it from elsewhere; "
                "if it was changed on purpose, DELETE FROM checksum in SQLite accepts it"
            )
        if version == schema.VERSION and not schema.has_its_tables(self.database):
            raise ValueError(
                f"{self.path} is damaged: its tables are not those of a file of scores"
            )

    def _says_what_was_written(self) -> bool:
        self._retried("BEGIN")  # a snapshot, whatever others write meanwhile
        try:
            return checksum.holds(self.database)
        finally:
            self.database.execute("COMMIT")

    def _retried(self, statement: str, patience: float = PATIENCE) -> sqlite3.Cursor:
        """Runs a statement; waits while another process has the file, unless Ctrl-C comes."""
        end = time.monotonic() + patience
        while True:
            try:
                return self.database.execute(statement)
            except sqlite3.OperationalError as error:
                if not _is_busy(error):
                    raise
                if since_interrupt() > WAIT:
                    raise KeyboardInterrupt from error
                if time.monotonic() > end:
                    raise TimeoutError(
                        f"{self.path} was held by another process for {patience:.0f} s"
                    ) from error


def _is_busy(error: BaseException) -> bool:
    """Whether another process holds the file right now."""
    return isinstance(error, sqlite3.OperationalError) and "locked" in str(error)


class _OpenPlace:
    """The place of a file that this process has open."""

    def __init__(self, path: Path) -> None:
        """Of a file that may not be there yet."""
        self._path = Path(os.path.abspath(path))  # the process may change its folder
        self._identity: tuple[int, int] | None = None

    def begin(self) -> None:
        """The file is there now."""
        self._identity = _identity(self._path)

    def change(self) -> str:
        """What happened to the file, and what to do; empty if it is where it was."""
        if self._identity is None or _identity(self._path) == self._identity:
            return ""
        name = self._present_name()
        if name is None:
            return (
                "was renamed while it was written: the file of the new name has all scores; give "
                "it the old name again, and the same command goes on"
            )
        if not os.path.exists(name):
            return "was removed while it was written, and what was scored since then is lost"
        return (
            f"was renamed to {name} while it was written: that file has all scores; give it the "
            "old name again, and the same command goes on"
        )

    def _present_name(self) -> str | None:
        """None where the system does not tell."""
        if not DESCRIPTORS.is_dir():
            return None
        links = (DESCRIPTORS / name for name in os.listdir(DESCRIPTORS))
        found = (os.readlink(link) for link in links if _identity(link) == self._identity)
        return next(found, None)


def _identity(path: Path) -> tuple[int, int] | None:
    """The same for all names of a file; None if there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino
