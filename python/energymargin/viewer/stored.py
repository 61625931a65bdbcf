"""Scores from a file of scores, by trajectory and frame."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.datasets import Dataset
from energymargin.store import ScoreStore

__all__ = ["StoredScores"]

SEARCHED = (
    *("nodes", "seed", "search", "rollouts"),
    *("strength", "objects", "common_random_numbers"),
)


class StoredScores:
    """What a file of scores says of a dataset's states."""

    def __init__(
        self, path: str | os.PathLike[str], dataset: Dataset, run: int | None = None
    ) -> None:
        """Reads them all.

        Raises ValueError if the file holds no scores, if they are another dataset's, or if there
        are several runs and none is chosen; OSError if it cannot be read.
        """
        with ScoreStore(path) as store:
            chosen = store.run(run)
            if not chosen.digest.startswith(dataset.digest()):  # some name more after it
                raise ValueError(
                    f"{path}: run {chosen.number} has scores of another dataset than this one "
                    f"(task {chosen.task!r}, {chosen.states} states): view the one that was scored"
                )
            self.search: dict[str, Any] = {
                name: chosen.settings[name] for name in SEARCHED if name in chosen.settings
            }
            """What another search is told to give the same scores."""
            self.future = chosen.future
            """What they ask of each state's future; None: it is asked about as it is."""
            nodes = f", {self.search['nodes']:,} nodes" if "nodes" in self.search else ""
            ahead = "" if chosen.future is None else f", {chosen.future}"
            self.title = f"{chosen.settings.get('source', 'stored')}{nodes}{ahead}"
            """What a column of them is called."""
            self._scores = chosen.labelled_scores().scores

    def at(self, number: int) -> dict[str, float]:
        """The scores of the state of that number, by metric; NaN is one that is missing."""
        return {metric: float(values[number]) for metric, values in self._scores.items()}

    def along(self, metric: str, first: int, frames: int) -> NDArray[np.float64]:
        """The scores of so many states from number `first` on, NaN where there is none."""
        values = self._scores.get(metric)
        return np.full(frames, np.nan) if values is None else values[first : first + frames].copy()
