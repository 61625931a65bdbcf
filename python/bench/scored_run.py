"""Scores a dataset into a store, and prints how it goes: one run of `scale.py`, alone in a process.

A line of JSON each tenth of a second, when the first states are scored, and at the end.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from pathlib import Path
from typing import Annotated

import cyclopts
from cyclopts import Parameter

import energymargin as em
from energymargin.executors import Dask, Executor, Processes, Threads

EVERY = 0.1  # s


def main(
    data: Path,
    store: Path,
    executor: Annotated[str, Parameter(help="threads:N, processes:N, or tcp://...")],
    nodes: int = 100,
    metrics: str | None = None,
) -> None:
    """Scores what is missing."""
    samples = Samples()
    try:
        em.store.score_dataset(
            data,
            store,
            metrics.split(",") if metrics else None,
            settings=em.SearchSettings(nodes=nodes),
            executor=chosen(executor),
            progress=samples.progress,
        )
    except em.ScoreError as error:  # all others are scored
        print(error, file=sys.stderr)
    samples.tell()


def chosen(executor: str) -> Executor:
    """The executor of this name."""
    kind, _, count = executor.partition(":")
    if kind == "threads":
        return Threads(int(count))
    return Processes(int(count)) if kind == "processes" else Dask(executor)


class Samples:
    """What is printed of the run."""

    def __init__(self) -> None:
        """It begins."""
        self._start, self._done, self._lock = time.perf_counter(), 0, threading.Lock()
        threading.Thread(target=self._tick, daemon=True).start()

    def progress(self, done: int, total: int) -> None:
        """So many are scored."""
        first, self._done = self._done == 0, done
        if first and done:
            self.tell()

    def tell(self) -> None:
        """Prints how far it is."""
        lines = Path("/proc/self/status").read_text().splitlines()
        memory = {
            line.split(":")[0]: 1024 * int(line.split()[1])
            for line in lines
            if line.startswith("Vm")
        }
        sample = {
            "done": self._done,
            "seconds": time.perf_counter() - self._start,
            "cpu": time.process_time(),
            "resident": memory["VmRSS"],
            # the kernel brings the peak up to date now and then only
            "peak": max(memory["VmHWM"], memory["VmRSS"]),
        }
        with self._lock:
            print(json.dumps(sample), flush=True)

    def _tick(self) -> None:
        while True:
            self.tell()
            time.sleep(EVERY)


if __name__ == "__main__":
    cyclopts.run(main)
