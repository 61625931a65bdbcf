"""Jobs of a study on threads, and the file that has a line for each that is finished."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from pathlib import Path
from typing import TypeVar

from energymargin._core import Cancel
from energymargin.interrupts import held_interrupts

__all__ = ["complete_lines", "finished"]

POLL = 0.05  # s, between two looks for Ctrl-C
AHEAD = 8  # jobs that lie ready for each thread

Job = TypeVar("Job")
Result = TypeVar("Result")


def complete_lines(path: Path) -> list[str]:
    """The lines of a file, none if there is no file; a line that a kill left unfinished is cut."""
    if not path.exists():
        return []
    lines = path.read_text().splitlines(keepends=True)
    complete = [line for line in lines if line.endswith("\n")]
    if complete != lines:
        path.write_text("".join(complete))
    return complete


def finished(
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
