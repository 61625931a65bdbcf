"""Scores on a pool of workers: chunks of problems go out, rows come back."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from energymargin._core import Problem, ScoreRow, ScoreRun
from energymargin.closing import Closing
from energymargin.executors.pool import POLL, Outcome, Pool, Stopped
from energymargin.executors.session import Failed, Pace, Row, Work
from energymargin.executors.threads import add_to_run
from energymargin.metrics import METRICS
from energymargin.searches import SearchSettings

__all__ = ["PoolSession", "score_chunk"]

CHUNK = 1.0  # s; of work: so much is lost with a worker, and beside it sending costs little
CHUNKS_A_SECOND = 200  # of a large cluster, whose scheduler has no time for more
MOST = 1000  # problems of a chunk
AHEAD = 3  # chunks for each worker: one that it scores, one that it has, one that waits
MOST_DEATHS = 3  # workers that one problem may take with it
LAST_ROWS = 0.1  # s; how long a stop waits for rows that are finished


@dataclass(frozen=True)
class _Chunk:
    """What a worker gets."""

    settings: SearchSettings
    work: tuple[tuple[int, str, tuple[str, ...]], ...]
    """Stream index, problem (JSON) and metrics of each."""
    deaths: int = 0
    """Workers that died over it."""


@dataclass(frozen=True, eq=False)
class _Scored:
    """What a worker gives back."""

    rows: list[Row]
    seconds: float
    """Of work, with reading the problems."""


def score_chunk(chunk: _Chunk, stopped: Stopped) -> _Scored:
    """The rows of a chunk, on one thread; those that are finished once it is stopped."""
    start = time.perf_counter()
    work, rows = _read(chunk)
    run = ScoreRun(list(METRICS), threads=1, **chunk.settings.all())
    add_to_run(run, work)
    while not (run.finished or stopped()):
        rows += run.take(POLL)
    run.cancel()
    rows += run.take(0)
    return _Scored(rows, time.perf_counter() - start)


def _read(chunk: _Chunk) -> tuple[list[Work], list[Row | ScoreRow]]:
    """The problems of a chunk, and rows of those that cannot be read."""
    work: list[Work] = []
    failed: list[Row | ScoreRow] = []
    for index, text, metrics in chunk.work:
        try:
            work.append(Work(index, Problem.from_json(text), metrics))
        except ValueError as error:
            failed.append(Failed(index, str(error)))
    return work, failed


class PoolSession(Closing):
    """A Session on a pool of workers.

    A worker that dies takes nothing with it: its chunk is done again, each problem by itself, and
    only a problem over which worker after worker dies gets a row with an error.
    """

    def __init__(self, pool: Pool, settings: SearchSettings) -> None:
        """The pool is closed at the end."""
        self._pool = pool
        self._settings = settings
        self._pace = Pace()
        self._chunks: dict[int, _Chunk] = {}
        self._next = 0

    @property
    def pending(self) -> int:
        """As Session.pending."""
        return sum(len(chunk.work) for chunk in self._chunks.values())

    def room(self) -> int:
        """As Session.room: whole chunks."""
        chunks = AHEAD * self._pool.slots - len(self._chunks)
        return max(0, chunks) * self._size()

    def add(self, work: Sequence[Work]) -> None:
        """As Session.add. Raises ValueError on a problem that cannot be sent."""
        each = -(-len(work) // max(1, self._pool.slots))  # so that none is idle at the end
        size = min(self._size(), max(each, self._pace.problems(self._shortest, MOST)))
        sent = [(one.index, _text(one), one.metrics) for one in work]
        for first in range(0, len(sent), size):
            self._submit(_Chunk(self._settings, tuple(sent[first : first + size])))

    def take(self, timeout: float) -> Sequence[Row]:
        """As Session.take. Raises what went wrong in a worker, if it is not of one problem."""
        return [row for outcome in self._pool.take(timeout) for row in self._rows(outcome)]

    def stop(self) -> Sequence[Row]:
        """As Session.stop."""
        rows: list[Row] = []
        for outcome in self._pool.stop(LAST_ROWS):
            if isinstance(outcome.value, _Scored):
                rows += outcome.value.rows
                if len(outcome.value.rows) == len(self._chunks[outcome.job].work):
                    del self._chunks[outcome.job]
        return rows

    def close(self) -> None:
        """Closes the pool."""
        self._pool.close()

    def _size(self) -> int:
        """Problems of a chunk."""
        return self._pace.problems(max(CHUNK, self._shortest), MOST)

    @property
    def _shortest(self) -> float:
        """A chunk [s] of which all workers together do not need more than there may be."""
        return self._pool.slots / CHUNKS_A_SECOND

    def _submit(self, chunk: _Chunk) -> None:
        self._chunks[self._next] = chunk
        self._pool.submit(self._next, score_chunk, chunk)
        self._next += 1

    def _rows(self, outcome: Outcome) -> Iterator[Row]:
        chunk = self._chunks.pop(outcome.job)
        if outcome.died:
            yield from self._again(chunk, outcome.died)
            return
        if outcome.error is not None:
            raise outcome.error
        scored: _Scored = outcome.value
        self._pace.saw(len(scored.rows), scored.seconds)
        yield from scored.rows

    def _again(self, chunk: _Chunk, died: str) -> Iterator[Row]:
        """Each problem of a chunk whose worker has died, but for one that has done so too often."""
        deaths = chunk.deaths + (len(chunk.work) == 1)
        if deaths == MOST_DEATHS:
            ((index, _, _),) = chunk.work
            yield Failed(index, f"{deaths} workers died while they scored it, the last {died}")
            return
        for one in chunk.work:
            self._submit(replace(chunk, work=(one,), deaths=deaths))


def _text(work: Work) -> str:
    try:
        return work.text
    except ValueError as error:
        raise ValueError(
            f"problem {work.index} cannot be sent to another process ({error}): use threads"
        ) from error
