"""States scored by threads, by processes and by a Dask cluster, in turns."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

from energymargin.store import ScoreStore
from scale_runs import ScoredRun, dataset_file, scored_run
from tables import markdown

__all__ = ["Throughput", "measure_throughput"]

FRAMES = 10
WORKERS = 2
THREADS = f"{WORKERS} threads"
DASK = f"Dask, {WORKERS} workers"
LOCAL = {THREADS: f"threads:{WORKERS}", "1 process": "processes:1", "2 processes": "processes:2"}
EXECUTORS = (*LOCAL, DASK)
DOOR = 30.0  # s; how long a scheduler may take to answer


@dataclass
class Throughput:
    """What was measured."""

    nodes: int = 100
    states: dict[str, int] = field(default_factory=lambda: {"push": 120, "topple": 400})
    """Number of states of each task."""
    runs: dict[str, dict[str, list[ScoredRun]]] = field(default_factory=dict)
    """By task and executor, one each round."""

    def tables(self) -> str:
        """In Markdown."""
        shown = ", ".join(f"{count} states of `{task}`" for task, count in self.states.items())
        rounds = min((len(of[THREADS]) for of in self.runs.values()), default=0)
        text = (
            f"{shown}; {self.nodes} nodes, all metrics; medians of {rounds} rounds in which the"
            " executors take turns, and the spread of the ratios. From the first score to the last"
            " one; what comes before it, the start of the processes, stands by itself.\n\n"
        )
        return text + "\n".join(self._table(task) for task in self.runs)

    def numbers(self) -> dict[str, object]:
        """For a program."""
        return {
            task: {
                name: {
                    "states_per_second": [run.rate for run in runs],
                    "ratio": self._ratios(task, name),
                    "first_score": [run.first.seconds for run in runs],
                }
                for name, runs in of_task.items()
            }
            for task, of_task in self.runs.items()
        }

    def _table(self, task: str) -> str:
        rows = []
        for name, runs in self.runs[task].items():
            ratios = self._ratios(task, name)
            rows.append(
                [
                    name,
                    f"{median(run.rate for run in runs):.1f}",
                    f"x {median(ratios):.2f}",
                    f"{min(ratios):.2f} to {max(ratios):.2f}",
                    f"{median(run.first.seconds for run in runs):.2f}",
                ]
            )
        return markdown([task, "states a second", "to threads", "spread", "first score [s]"], rows)

    def _ratios(self, task: str, name: str) -> list[float]:
        pairs = zip(self.runs[task][name], self.runs[task][THREADS], strict=False)
        return [run.rate / threads.rate for run, threads in pairs]


def measure_throughput(
    results: Throughput, folder: Path, rounds: int, tell: Callable[[str], None]
) -> None:
    """Fills the results. Raises RuntimeError if two stores differ by a bit."""
    with cluster(WORKERS) as address:
        executors = LOCAL | {DASK: address}
        for task, states in results.states.items():
            data = dataset_file(folder, task, states // FRAMES, FRAMES)
            runs = results.runs[task] = {name: [] for name in EXECUTORS}
            expected: dict[str, bytes] = {}  # those of the first run
            for number in range(rounds):
                for name in turned(EXECUTORS, number):
                    tell(f"{task}: {name}")
                    store = folder / "throughput.db"
                    store.unlink(missing_ok=True)
                    runs[name].append(scored_run(data, store, executors[name], results.nodes))
                    found = bits(store)
                    expected = expected or found
                    if found != expected:
                        raise RuntimeError(f"{task}: the scores of {name} are other bits")
                    store.unlink()


def turned(names: Sequence[str], by: int) -> list[str]:
    """The names in turns: another one is the first."""
    by %= len(names)
    return [*names[by:], *names[:by]]


def bits(store: Path) -> dict[str, bytes]:
    """All scores of a store."""
    with ScoreStore(store) as opened:
        scores = opened.run().labelled_scores().scores
    return {metric: values.tobytes() for metric, values in scores.items()}


@contextmanager
def cluster(workers: int) -> Iterator[str]:
    """A Dask scheduler and its workers, of one thread each, as one would start them by hand."""
    with socket.socket() as door:
        door.bind(("127.0.0.1", 0))
        port = door.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    here = ["--host", "127.0.0.1", "--no-dashboard"]
    processes = [_dask("scheduler", "--port", str(port), *here)]
    try:
        _await_door(port)
        one = ["--nthreads", "1", "--no-nanny", *here]
        processes += [_dask("worker", address, *one) for _ in range(workers)]
        _await_workers(address, workers)
        yield address
    finally:
        for process in processes:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def _dask(kind: str, *options: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "dask", kind, *options],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},  # of jobs without work
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def _await_door(port: int) -> None:
    end = time.monotonic() + DOOR
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
            return
        except OSError:
            if time.monotonic() > end:
                raise
            time.sleep(0.05)


def _await_workers(address: str, workers: int) -> None:
    from distributed import Client

    with Client(address) as client:
        client.wait_for_workers(workers, timeout=DOOR)
