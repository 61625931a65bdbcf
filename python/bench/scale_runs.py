"""Runs of the scorer in processes of their own, and what was seen of them."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import energymargin as em

__all__ = ["Sample", "ScoredRun", "dataset_file", "scored_run", "size_of"]

SCRIPT = Path(__file__).with_name("scored_run.py")


@dataclass(frozen=True)
class Sample:
    """A moment of a run."""

    done: int
    """States that are scored."""
    seconds: float
    """Since the start."""
    cpu: float
    """Processor time of the process, without those that it has started [s]."""
    resident: int
    """Memory [B]."""
    peak: int
    """The most that `resident` has been."""


@dataclass(frozen=True)
class ScoredRun:
    """All moments of a run."""

    samples: list[Sample]

    @property
    def first(self) -> Sample:
        """When the first states were scored."""
        return next(sample for sample in self.samples if sample.done)

    @property
    def last(self) -> Sample:
        """When all were."""
        return self.samples[-1]

    @property
    def rate(self) -> float:
        """States a second, from the first score on."""
        return self._states / (self.last.seconds - self.first.seconds)

    @property
    def cpu(self) -> float:
        """Processor time of the process for a state [s]."""
        return (self.last.cpu - self.first.cpu) / self._states

    @property
    def _states(self) -> int:
        return self.last.done - self.first.done


def scored_run(
    data: Path, store: Path, executor: str, nodes: int = 100, metrics: str | None = None
) -> ScoredRun:
    """Scores a dataset into a store; `executor` is threads:N, processes:N or tcp://..."""
    command = [sys.executable, str(SCRIPT), str(data), str(store), f"--executor={executor}"]
    command += [f"--nodes={nodes}", *([f"--metrics={metrics}"] if metrics else [])]
    done = subprocess.run(command, check=False, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)} ended with exit code {done.returncode}")
    return ScoredRun([Sample(**json.loads(line)) for line in done.stdout.splitlines()])


def dataset_file(folder: Path, task: str, trajectories: int, frames: int) -> Path:
    """A dataset of a task, which is generated if it is not in the folder."""
    path = folder / f"{task}-{trajectories}x{frames}.h5"
    if not path.exists():
        em.datasets.generate(
            task, path=path, trajectories=trajectories, frames=frames, seed=0, processes=None
        ).close()
    return path


def size_of(store: Path) -> int:
    """A store on disk [B], of which nothing is left beside the file once it is closed."""
    return store.stat().st_size
