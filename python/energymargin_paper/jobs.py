"""Long work of a study, which goes on from its files: trajectories, and jobs on workers."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from energymargin._core import Cancel
from energymargin.base.replacing import replace_text
from energymargin.datasets import Dataset, generate, load
from energymargin.executors import ask
from energymargin.tasks import Task, parameters_of

__all__ = ["Lines", "load_or_generate", "pairs", "resumed"]

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
    there = dict(map(lines.read, _complete_lines(path)))
    results = {job: there[job] for job in jobs if job in there}
    progress(len(results), len(jobs))
    with path.open("a") as file:

        def keep(finished: Sequence[tuple[Job, Result]]) -> None:
            for job, result in finished:
                file.write(lines.write(job, result) + "\n")
                file.flush()
                results[job] = result
                progress(len(results), len(jobs))

        def of_jobs(jobs: Sequence[Job], cancel: Cancel) -> list[Result]:
            found = [run(job, cancel) for job in jobs]
            return [] if cancel.is_set else found

        ask([[job for job in jobs if job not in results]], of_jobs, keep, most=1, threads=threads)
    return {job: results[job] for job in jobs}


def load_or_generate(
    path: Path,
    task: Task,
    trajectories: int,
    frames: int,
    seed: int,
) -> Dataset:
    """The dataset in a file, which is made if there is none. Arguments: as `generate`.

    Raises ValueError if the file holds another.
    """
    if not path.exists():
        asked: Any = {"trajectories": trajectories, "frames": frames, "seed": seed}
        generate(task, path=path, **asked).close()
    dataset = load(path)
    found = (dataset.task, dataset.parameters, dataset.seed, dataset.lengths.tolist())
    if found != (task.name, parameters_of(task), seed, [frames] * trajectories):
        raise ValueError(f"{path} holds other trajectories: remove it, or choose another folder")
    return dataset


def _complete_lines(path: Path) -> list[str]:
    """The lines of a file, none if there is no file; a line that a kill left unfinished is cut."""
    if not path.exists():
        return []
    lines = path.read_text().splitlines(keepends=True)
    complete = [line for line in lines if line.endswith("\n")]
    if complete != lines:
        replace_text(path, "".join(complete))
    return complete
