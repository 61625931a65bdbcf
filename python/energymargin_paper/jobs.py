"""Jobs of a study on a pool of workers, and the file that has a line for each that is finished."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import asdict
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from energymargin._core import Cancel
from energymargin.limits import Limit
from energymargin.replacing import replace_text
from energymargin.results import collect

__all__ = ["Jobs", "Lines", "pairs", "resumed"]

POLL = 0.05  # s, between two looks for Ctrl-C
AHEAD = 8  # jobs that lie ready for each worker

Job = TypeVar("Job")
Result = TypeVar("Result")


class Jobs(Generic[Job, Result]):
    """The Workers of a pool: each calls `run(job)` for one job after the other.

    `stop` sets `cancel`, so that threads end their jobs early: such results are left out.
    """

    def __init__(
        self,
        pool: Executor,
        workers: int,
        run: Callable[[Job], Result],
        jobs: Iterable[Job],
        cancel: Cancel,
    ) -> None:
        """`workers`: how many the pool has. It is shut down once the jobs are stopped."""
        self._pool, self._run, self._cancel = pool, run, cancel
        self._ahead = AHEAD * workers
        self._waiting = list(jobs)[::-1]
        self._running: set[Future[Result]] = set()

    @property
    def busy(self) -> bool:
        """As Workers.busy."""
        return bool(self._waiting or self._running)

    def step(self) -> Sequence[Result]:
        """As Workers.step. Raises what a job raised; `stop` then returns the other results."""
        while self._waiting and len(self._running) < self._ahead:
            self._running.add(self._pool.submit(self._run, self._waiting.pop()))
        done, _ = wait(self._running, POLL, FIRST_COMPLETED)
        results = [future.result() for future in done]
        self._running -= done
        return results

    def stop(self) -> Sequence[Result]:
        """As Workers.stop."""
        done = [future for future in self._running if future.done() and not future.exception()]
        self._cancel.set()
        self._pool.shutdown(cancel_futures=True)
        return [future.result() for future in done]


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
    run: Callable[[Job, Cancel], Result],
    threads: int,
    *,
    lines: Lines[Job, Result],
    progress: Callable[[int, int], object],
) -> dict[Job, Result]:
    """The results of all jobs: those of the file, and the missing ones, each added to the file as
    soon as `run(job, cancel)` has returned it. `progress(done, total)` counts jobs.

    On Ctrl-C `cancel` is set, jobs that end early are left out, and KeyboardInterrupt is raised. An
    error of a job is raised too; what is finished is in the file.
    """
    results = dict(map(lines.read, _complete_lines(path)))
    missing = [job for job in jobs if job not in results]
    done = len(jobs) - len(missing)
    cancel = Cancel()
    progress(done, len(jobs))
    with path.open("a") as file:

        def keep(finished: Sequence[tuple[Job, Result]]) -> None:
            nonlocal done
            for job, result in finished:
                file.write(lines.write(job, result) + "\n")
                file.flush()
                results[job] = result
                done += 1
                progress(done, len(jobs))

        pool = ThreadPoolExecutor(threads)
        workers = Jobs(pool, threads, lambda job: (job, run(job, cancel)), missing, cancel)
        collect(workers, keep, Limit())
    return {job: results[job] for job in jobs}


def _complete_lines(path: Path) -> list[str]:
    """The lines of a file, none if there is no file; a line that a kill left unfinished is cut."""
    if not path.exists():
        return []
    lines = path.read_text().splitlines(keepends=True)
    complete = [line for line in lines if line.endswith("\n")]
    if complete != lines:
        replace_text(path, "".join(complete))
    return complete
