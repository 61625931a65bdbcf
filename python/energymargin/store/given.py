"""Scores that were computed elsewhere, as a run of a store."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.datasets import Dataset
from energymargin.store.claims import Scorer
from energymargin.store.file import ScoreStore
from energymargin.store.known import adopt
from energymargin.store.schema import state_digest

__all__ = ["GivenRow", "add_scores"]

BLOCK = 1000  # states that are written at a time


@dataclass(frozen=True)
class GivenRow:
    """The scores of one state, as a store takes them."""

    index: int
    seconds: float
    """That all of them took."""
    scores: dict[str, float]
    error: str | None = None

    @property
    def times(self) -> dict[str, float]:
        """All of the time is that of the first score."""
        return {next(iter(self.scores)): self.seconds}

    @property
    def curves(self) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """There are none."""
        return {}


def add_scores(
    path: str | os.PathLike[str],
    dataset: Dataset,
    scores: Mapping[str, ArrayLike],
    settings: Mapping[str, Any],
) -> int:
    """Puts scores of all states of a dataset into the store at `path`, which is made if there is
    none, as a run of their own; returns its number.

    `scores`: by metric, shape (N,), one a state in the order of the dataset; inf ranks above all
    else, NaN is a score that is not there. `settings` say where they come from, as
    {"source": "published"}: with others they are another run. The same call again changes nothing.
    `evaluate`, reports and the viewer show such a run as any other. Raises ValueError on another
    number of scores, or none; errors else as ScoreStore.
    """
    columns = {name: np.asarray(values, dtype=np.float64) for name, values in scores.items()}
    for name, values in columns.items():
        if values.shape != (dataset.size,):
            raise ValueError(
                f"scores of {name!r} have shape {values.shape}, expected ({dataset.size},): one a "
                "state"
            )
    if not columns or not settings:
        raise ValueError(f"scores and settings are {sorted(columns)} and {settings}, expected some")
    questions = {metric: dict(settings) for metric in columns}
    with ScoreStore(path, create=True) as store:
        run = store.begin(dataset, settings, questions, known_by=" by place")
        adopt(store, run, lambda numbers: {n: state_digest(run.digest, n) for n in numbers})
        with Scorer(store, run) as scorer:
            for first in range(0, dataset.size, BLOCK):
                numbers = range(first, min(first + BLOCK, dataset.size))
                scorer.claim({n: state_digest(run.digest, n) for n in numbers})
                of_states = [{name: float(v[n]) for name, v in columns.items()} for n in numbers]
                scorer.add(
                    [GivenRow(n, 0.0, own) for n, own in zip(numbers, of_states, strict=True)]
                )
        return run.number
