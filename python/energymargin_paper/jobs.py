"""Jobs of a study on threads, and the file that has a line for each that is finished."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from energymargin._core import Cancel
from energymargin.interrupts import held_interrupts

__all__ = ["Lines", "pairs", "resumed"]

POLL = 0.05  # s, between two looks for Ctrl-C
AHEAD = 8  # jobs that lie ready for each thread

Job = TypeVar("Job")
Result = TypeVar("Result")


class Lines(NamedTuple, Generic[Job, Result]):
    """How a job and its result are a line of a file."""

    read: Callable[[str], tuple[Job, Result]]
    write: Callable[[Job, Result], str]


def pairs(job: type[Job], result: type[Result]) -> Lines[Job, Result]:
    """Two JSON objects in a list, of dataclasses."""

    def read(line: str) -> tuple[Job, Result]:
        of_job, of_result = json.loads(line)
        return job(**of_job), result(**of_result)

    def write(of_job: Any, of_result: Any) -> str:
        return json.dumps([asdict(of_job), asdict(of_result)])

    return Lines(read, write)


def resumed(
    path: Path,
    jobs: Sequence[Job],
    run: Callable[[Job, Cancel], tuple[Job, Result]],
    threads: int,
    *,
    lines: Lines[Job, Result],
    progress: Callable[[int, int], object],
) -> dict[Job, Result]:
    """The results of all jobs: those of the file, and what it lacked, which is added as soon as it
    is there. `progress(done, total)` counts jobs; errors and Ctrl-C as `_finished`."""
    results = dict(map(lines.read, _complete_lines(path)))
    missing = [job for job in jobs if job not in results]
    done = len(jobs) - len(missing)
    progress(done, len(jobs))
    with path.open("a") as file:
        for job, result in _finished(missing, run, threads):
            file.write(lines.write(job, result) + "\n")
            file.flush()
            results[job] = result
            done += 1
            progress(done, len(jobs))
    return {job: results[job] for job in jobs}


def _complete_lines(path: Path) -> list[str]:
    """The lines of a file, none if there is no file; a line that a kill left unfinished is cut."""
    if not path.exists():
        return []
    lines = path.read_text().splitlines(keepends=True)
    complete = [line for line in lines if line.endswith("\n")]
    if complete != lines:
        path.write_text("".join(complete))
    return complete


def _finished(
    jobs: Iterable[Job], run: Callable[[Job, Cancel], Result], threads: int
) -> Iterator[Result]:
    """Results as they are there, of `run(job, cancel)`. On Ctrl-C the cancel is set, and what was
    cut short is left out; then KeyboardInterrupt is raised. So is an error of a job."""
    waiting, stop = iter(jobs), Cancel()
    running: set[Future[Result]] = set()
    with held_interrupts() as interrupted, ThreadPoolExecutor(threads) as pool:
        try:
            while not interrupted.is_set():
                more = islice(waiting, AHEAD * threads - len(running))
                running |= {pool.submit(run, job, stop) for job in more}
                if not running:
                    break
                done, running = wait(running, POLL, FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)
    if interrupted.is_set():
        raise KeyboardInterrupt
