"""What a report is about: a run of a file of scores, read once, its dataset, and what is shown."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import datasets
from energymargin.checks import whole_number
from energymargin.closing import Closing
from energymargin.datasets import Dataset, Future
from energymargin.evaluation import LabelledScores
from energymargin.evaluation.bootstrap import DRAWS
from energymargin.evaluation.labelled import FORCE, HORIZON, LAST_FRAMES
from energymargin.metrics import ANY
from energymargin.store import ScoreStore

__all__ = ["Data", "Options", "Subject", "read_data", "read_subject"]

SUFFIX = "-scores"  # of the file of scores that `energymargin score` makes beside a dataset

_LEAST = {"trajectories": 1, "pictures": 0, "last": 1, "draws": 1, "seed": 0}


@dataclass(frozen=True)
class Subject:
    """A run as it was when it was read: others may go on to score it."""

    path: Path
    """The file of scores."""
    number: int
    """Of the run."""
    runs: int
    """How many the file has."""
    digest: str | None
    """Of the dataset; None in a file of an older version."""
    parameters: dict[str, Any] | None
    """Of the task; None in a file of an older version."""
    settings: dict[str, Any]
    future: Future | None
    """What is asked of each state's future; None: it is asked about as it is."""
    algorithm: str
    up_to_date: bool
    seconds: dict[str, float]
    """Computing time of each metric, of all states [s]."""
    labelled: LabelledScores

    @cached_property
    def members(self) -> list[NDArray[np.int64]]:
        """The numbers of the states, one array a trajectory."""
        return self.labelled.by_trajectory()

    @cached_property
    def frames(self) -> NDArray[np.int64]:
        """Which frame of its trajectory each state is, shape (N,)."""
        return np.concatenate([np.arange(len(states)) for states in self.members])

    @cached_property
    def ahead(self) -> NDArray[np.int64]:
        """How many frames of its trajectory were recorded after each state, shape (N,)."""
        return np.concatenate([np.arange(len(states))[::-1] for states in self.members])

    def scores(self, metric: str) -> NDArray[np.float64]:
        """Of a metric as it is named in tables, shape (N,): there one force score is held against
        two labels."""
        name = FORCE if metric == FORCE + ANY else metric
        return self.labelled.scores[name]

    @property
    def metrics(self) -> Sequence[str]:
        """Of which there are scores."""
        return list(self.labelled.scores)

    @property
    def several(self) -> bool:
        """Whether there are labels of at least one of several objects."""
        return self.labelled.captured_any is not None or self.labelled.success_any is not None


@dataclass(frozen=True)
class Data(Closing):
    """The dataset of a run, open: its times and states, which a file of scores does not hold."""

    dataset: Dataset | None
    lacking: str = ""
    """Why there is none."""
    path: Path | None = None

    def close(self) -> None:
        """Closes it."""
        if self.dataset is not None:
            self.dataset.close()


def read_subject(path: str | os.PathLike[str], number: int | None) -> Subject:
    """A run of a file of scores; None is the only one. Raises what ScoreStore does, and ValueError
    if there is no run, or `number` is no whole number."""
    path = Path(path)
    if number is not None:
        whole_number("run", number, 1)
    with ScoreStore(path) as store:
        if not store.runs():
            made = f"energymargin score DATASET -o {path}"
            raise ValueError(f"{path} has no scores yet; `{made}` puts some in")
        run = store.run(number)
        return Subject(
            path=path,
            number=run.number,
            runs=len(store.runs()),
            digest=run.digest,
            parameters=run.parameters,
            settings=run.settings,
            future=run.future,
            algorithm=run.algorithm,
            up_to_date=run.up_to_date,
            seconds=run.times(),
            labelled=run.labelled_scores(),
        )


def read_data(subject: Subject, path: str | os.PathLike[str] | None) -> Data:
    """The dataset of a run, open: that at `path`, or else the one beside the file of scores.

    Raises ValueError if `path` is given and it is another dataset, and what `datasets.open` does.
    """
    if path is not None:
        dataset = datasets.open(path)
        lacking = _other(dataset, subject, Path(path))
        if lacking:
            dataset.close()
            raise ValueError(lacking)
        return Data(dataset, path=Path(path))
    beside = subject.path.with_name(f"{subject.path.stem.removesuffix(SUFFIX)}.h5")
    if not beside.exists():
        return Data(None, f"there is no {beside.name} beside {subject.path.name}")
    try:
        dataset = datasets.open(beside)
        lacking = _other(dataset, subject, Path(beside.name))
    except (ValueError, OSError) as error:
        return Data(None, str(error))
    if lacking:
        dataset.close()
        return Data(None, lacking)
    return Data(dataset, path=beside)


def _other(dataset: Dataset, subject: Subject, path: Path) -> str:
    """Why this is not the run's dataset; empty if it is."""
    if subject.digest is None:
        again = f"`energymargin score {path} -o {subject.path.name}` brings it up"
        return (
            f"{subject.path.name} is of an older version, which does not know its dataset: {again}"
        )
    if subject.digest.startswith(dataset.digest()):  # some experiments name more after it
        return ""
    return f"{path} is not the dataset that run {subject.number} of {subject.path.name} scored"


@dataclass(frozen=True)
class Options:
    """The choices of who writes a report. Raises ValueError on what cannot be."""

    trajectories: int = 30
    """At most so many are shown, half of them those that the scores get most wrong."""
    pictures: int = 2
    """So many states of each score and label, whose searches are grown again."""
    horizon: int | None = None
    """Frames that the label "captured" of curves, histograms and pictures looks ahead; None looks
    as far as the scores do, which is HORIZON for those without one of their own, or as far as the
    longest trajectory goes."""
    last: int = LAST_FRAMES
    """As of `evaluate`; so are the next two."""
    draws: int = DRAWS
    seed: int = 0

    def __post_init__(self) -> None:
        """Checks each of them."""
        for name, least in _LEAST.items():
            whole_number(name, getattr(self, name), least)
        if self.horizon is not None:
            whole_number("horizon", self.horizon, 0)

    def horizon_of(self, ahead: int, scored: int | None = None) -> int:
        """The horizon, where no state has more than `ahead` frames after its own, of scores that
        look `scored` frames ahead. Raises ValueError if it is longer than that."""
        if self.horizon is None:
            return min(HORIZON if scored is None else scored, ahead)
        if self.horizon > ahead:
            raise ValueError(
                f"horizon is {self.horizon}, expected 0 to {ahead}: the longest trajectory has "
                f"{ahead + 1} frames"
            )
        return self.horizon
