"""Memory of a process that scores more and more recorded states by a cheap metric."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from energymargin import datasets
from energymargin.datasets import Dataset
from scale_runs import Sample, ScoredRun, dataset_file, scored_run, size_of
from tables import markdown

__all__ = ["Memory", "measure_memory", "picture"]

TASK, FRAMES = "topple", 10
METRIC = "force"
SHOWN = 300  # points of a curve


@dataclass(frozen=True)
class Scored:
    """One dataset."""

    states: int
    data: int
    """The dataset on disk [B]."""
    store: int
    """The scores on disk [B]."""
    run: ScoredRun

    def resident(self, share: float) -> int:
        """Memory when so much of the states were scored [B]."""
        return next(s.resident for s in self.run.samples if s.done >= share * self.run.last.done)

    @property
    def curve(self) -> list[Sample]:
        """A few of the samples, from the first score on."""
        samples = [sample for sample in self.run.samples if sample.done]
        step = -(-len(samples) // SHOWN)
        return [*samples[:-1:step], samples[-1]]


@dataclass
class Memory:
    """What was measured."""

    sizes: Sequence[int] = (10_000, 100_000, 1_000_000)
    """States of the datasets, rising."""
    scored: list[Scored] = field(default_factory=list)
    task: str = TASK

    def tables(self) -> str:
        """In Markdown."""
        rows = [
            [
                f"{one.states:,}",
                f"{one.data / 1e6:.1f}",
                f"{one.store / 1e6:.1f}",
                f"{one.run.rate:,.0f}",
                *(f"{one.resident(share) / 1e6:.0f}" for share in (0.1, 0.5, 1.0)),
                f"{one.run.last.peak / 1e6:.0f}",
            ]
            for one in self.scored
        ]
        headers = ["states", "dataset [MB]", "store [MB]", "states a second"]
        headers += ["resident at 10 % [MB]", "at 50 %", "at the end", "peak"]
        return (
            f"States of `{self.task}`, scored by `{METRIC}` on one thread.\n\n"
            f"{markdown(headers, rows)}"
        )

    def numbers(self) -> list[dict[str, object]]:
        """For a program."""
        return [
            {
                "states": one.states,
                "dataset_bytes": one.data,
                "store_bytes": one.store,
                "states_per_second": one.run.rate,
                "peak_bytes": one.run.last.peak,
                "curve": [(sample.done, sample.resident) for sample in one.curve],
            }
            for one in self.scored
        ]


def measure_memory(
    results: Memory, folder: Path, data: Path | None, tell: Callable[[str], None]
) -> None:
    """Fills the results; the smaller datasets are the first part of the largest.

    `data` is a dataset that has so many states. Raises ValueError if it has fewer.
    """
    tell("dataset")
    largest = data or dataset_file(folder, TASK, max(results.sizes) // FRAMES, FRAMES)
    store = folder / "memory.db"
    for states in results.sizes:
        tell(f"{states:,} states")
        store.unlink(missing_ok=True)
        part = folder / f"{states}.h5"
        with datasets.open(largest) as dataset:
            results.task = dataset.task
            path = largest if states == dataset.size else cut(dataset, states, part)
        run = scored_run(path, store, "threads:1", metrics=METRIC)
        results.scored.append(Scored(states, path.stat().st_size, size_of(store), run))
        store.unlink()
        part.unlink(missing_ok=True)


def cut(dataset: Dataset, states: int, path: Path) -> Path:
    """Writes the first trajectories that have so many states."""
    ends = dataset.lengths.cumsum().tolist()
    if states not in ends:
        raise ValueError(
            f"data has {dataset.size} states, expected trajectories that end at {states}"
        )
    some = dataset.trajectories[: ends.index(states) + 1]
    Dataset(dataset.task, dataset.parameters, dataset.seed, some).save(path)
    return path


def picture(results: Memory, path: Path) -> None:
    """Draws the curves."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 3.2), layout="constrained")
    axes = figure.subplots()
    for one in results.scored:
        x = [sample.done / 1e3 for sample in one.curve]
        y = [sample.resident / 1e6 for sample in one.curve]
        axes.plot(x, y, label=f"{one.states:,} states", linewidth=2)
    last = results.scored[-1]
    axes.set_title(
        f"{last.states:,} states of {results.task}: {last.data / 1e6:.0f} MB of dataset,"
        f" {last.store / 1e6:.0f} MB of store, {last.run.rate:,.0f} states/s",
        fontsize=9,
    )
    axes.set(xlabel="states scored [thousand]", ylabel="resident memory [MB]")
    axes.set_ylim(bottom=0)
    axes.set_xlim(left=0)
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=120)
