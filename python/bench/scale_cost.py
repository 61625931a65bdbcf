"""What a state costs, of each task and metric, and what ten million of them need."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from energymargin import Cancel
from energymargin.evaluate.parallel import CHUNKS_A_SECOND
from energymargin.executors import Dask, ask
from energymargin.store import ScoreStore
from scale_runs import dataset_file, scored_run, size_of
from scale_throughput import WORKERS, cluster
from tables import markdown

__all__ = ["Cost", "Sizes", "measure_cost"]

SEARCHES = {
    "capture": "capture, success",
    "effort": "effort",
    "effort/est": "effort/est",
    "effort/rrt": "effort/rrt",
    "effort/any": "effort/any",
    "effort/est/any": "effort/est/any",
    "effort/rrt/any": "effort/rrt/any",
    "force": "force",
}
"""The columns, by the metric that has the time of a search."""

MANY = 10_000_000
CORES = (64, 1000)
HOUR = 3600.0


@dataclass(frozen=True)
class Sizes:
    """How much is measured."""

    tasks: Sequence[str] = ("push", "balance", "topple", "grasp", "push-multi", "scoop")
    trajectories: int = 5
    frames: dict[int, int] = field(default_factory=lambda: {100: 10, 1000: 3})
    """Frames of each trajectory, by the number of nodes."""
    driver: tuple[int, int] = (50, 20)
    """Trajectories and frames of the dataset with which the driver is timed."""
    chunks: int = 4000
    """Jobs without work that Dask has to hand out."""

    def quick(self) -> Sizes:
        """Little ones: does it work?"""
        return Sizes(("topple",), 1, {5: 4, 10: 2}, (5, 8), 40)


@dataclass(frozen=True)
class Driver:
    """What it costs to have a state scored elsewhere."""

    seconds: float
    """Time of the driver's processor a state [s]: problem, fingerprint, store, cluster and back."""
    data: float
    """Size of the dataset on disk, a state [B]."""
    store: float
    """Size of the store on disk, a state with all its metrics [B]."""


@dataclass
class Cost:
    """What was measured."""

    sizes: Sizes
    seconds: dict[str, dict[int, dict[str, float]]] = field(default_factory=dict)
    """Time of a state [s], by task, number of nodes and metric."""
    drivers: dict[str, Driver] = field(default_factory=dict)
    """By task."""
    chunks: float = 0.0
    """Jobs without work that Dask hands out and takes back [1/s]."""

    def tables(self) -> str:
        """In Markdown."""
        states = " and ".join(
            f"{self.sizes.trajectories * frames} states at {nodes} nodes"
            for nodes, frames in self.sizes.frames.items()
        )
        return (
            f"One thread, {states} of {self.sizes.trajectories} trajectories of each task."
            f" Milliseconds a state:\n\n{self._measured()}\n"
            f"Ten million states with all their metrics:\n\n{self._paper()}\n"
            f"Dask handed out {self.chunks:,.0f} chunks without work a second (driver, scheduler"
            f" and {WORKERS} workers on this machine); it is asked for {CHUNKS_A_SECOND} at most.\n"
        )

    def numbers(self) -> dict[str, object]:
        """For a program."""
        return {
            "seconds": self.seconds,
            "drivers": {task: vars(driver) for task, driver in self.drivers.items()},
            "chunks_per_second": self.chunks,
        }

    def _measured(self) -> str:
        rows = [
            [
                task,
                str(nodes),
                *(milliseconds(times[m]) if m in times else "" for m in SEARCHES),
                milliseconds(sum(times.values())),
            ]
            for task, by_nodes in self.seconds.items()
            for nodes, times in by_nodes.items()
        ]
        return markdown(["task", "nodes", *SEARCHES.values(), "all"], rows)

    def _paper(self) -> str:
        rows = [
            self._row(task, nodes, sum(times.values()))
            for task, by_nodes in self.seconds.items()
            for nodes, times in by_nodes.items()
        ]
        headers = ["task", "nodes", "core hours", *(f"{n} cores [h]" for n in CORES)]
        headers += ["driver [ms a state]", "driver [h]", "workers it can feed"]
        return markdown([*headers, "dataset [GB]", "store [GB]"], rows)

    def _row(self, task: str, nodes: int, seconds: float) -> list[str]:
        driver = self.drivers[task]
        fed = seconds / driver.seconds
        walls = [MANY * seconds / min(cores, fed) / HOUR for cores in CORES]
        return [
            task,
            str(nodes),
            f"{MANY * seconds / HOUR:,.0f}",
            *(f"{wall:,.1f}{'*' if n > fed else ''}" for n, wall in zip(CORES, walls, strict=True)),
            f"{1e3 * driver.seconds:.2f}",
            f"{MANY * driver.seconds / HOUR:.1f}",
            f"{fed:,.0f}",
            f"{MANY * driver.data / 1e9:.1f}",
            f"{MANY * driver.store / 1e9:.1f}",
        ]


def milliseconds(seconds: float) -> str:
    """Three digits, or all before the point."""
    return f"{1e3 * seconds:,.0f}" if seconds >= 1.0 else f"{1e3 * seconds:.3g}"


def measure_cost(results: Cost, folder: Path, tell: Callable[[str], None]) -> None:
    """Fills the results."""
    sizes = results.sizes
    with cluster(WORKERS) as address:
        for task in sizes.tasks:
            by_nodes = {}
            for nodes, frames in sizes.frames.items():
                tell(f"{task}: {nodes} nodes")
                data = dataset_file(folder, task, sizes.trajectories, frames)
                by_nodes[nodes] = seconds_of(data, folder / "cost.db", nodes)
            tell(f"{task}: driver")
            data = dataset_file(folder, task, *sizes.driver)
            results.drivers[task] = driver_of(data, folder / "cost.db", address)
            results.seconds[task] = by_nodes
        tell("Dask: chunks")
        results.chunks = chunks_a_second(address, sizes.chunks)


def seconds_of(data: Path, store: Path, nodes: int) -> dict[str, float]:
    """Time of each metric a state, on one thread [s]."""
    store.unlink(missing_ok=True)
    scored_run(data, store, "threads:1", nodes)
    with ScoreStore(store) as opened:
        run = opened.run()
        times = {metric: run.times()[metric] / run.states for metric in run.metrics}
    store.unlink()
    return {metric: seconds for metric, seconds in times.items() if metric in SEARCHES}


def driver_of(data: Path, store: Path, address: str) -> Driver:
    """With trees of one node, so that the driver has the most to do."""
    store.unlink(missing_ok=True)
    with ScoreStore(store, create=True):
        pass
    empty = size_of(store)
    run = scored_run(data, store, address, nodes=1)
    states = run.last.done
    driver = Driver(run.cpu, data.stat().st_size / states, (size_of(store) - empty) / states)
    store.unlink()
    return driver


def chunks_a_second(address: str, count: int) -> float:
    """How many jobs without work a cluster does."""
    with Dask(address).workers() as workers:
        start = time.perf_counter()
        ask([range(count)], nothing, lambda _done: None, most=1, executor=workers)
    return count / (time.perf_counter() - start)


def nothing(chunks: Sequence[int], _cancel: Cancel) -> Sequence[int]:
    """A job without work."""
    return chunks
