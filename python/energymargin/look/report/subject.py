"""The subject of a report: a run of a file of scores and its dataset, and what is missing with the
command that adds it."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import energymargin as em
from energymargin.base.aliases import AnyPath, Floats, Ints
from energymargin.base.closing import Closing
from energymargin.base.metrics import ANY, METRICS, TIMED, USUAL
from energymargin.base.reprs import Record
from energymargin.base.settings import flag_of
from energymargin.look.plots.trajectories import BAND

SUFFIX = "-scores"  # of the file of scores that `energymargin score` makes beside a dataset


@dataclass(frozen=True, eq=False, repr=False)
class Subject(Record, Closing):
    """A run as it was when it was read: others may go on to score it."""

    path: Path
    """The file of scores."""
    run: em.store.Run
    """What it asks and with which settings. The file is closed: it has no scores any more."""
    runs: int
    """How many the file has."""
    about: em.summary.Summary
    """Rows of the run: its task, what it asked, what it left out."""
    labelled: em.evaluation.LabelledScores
    now: em.evaluation.LabelledScores | None
    """Of scores with a horizon, those of the states as they are beside them, if there are any."""
    bands: dict[str, Floats]
    """By metric, between what the middle of the particles' scores lie, shape (N, 2); empty without
    a belief."""

    dataset: em.datasets.Dataset | None = None
    """The dataset of the run, open: its times and states, which a file of scores does not hold."""
    data_path: Path | None = None
    """Its file."""
    lacking: str = ""
    """Why there is no dataset."""

    def close(self) -> None:
        """Closes the dataset."""
        if self.dataset is not None:
            self.dataset.close()

    @cached_property
    def members(self) -> list[Ints]:
        """The numbers of the states, one array a trajectory."""
        return self.labelled.by_trajectory()

    @cached_property
    def frames(self) -> Ints:
        """Which frame of its trajectory each state is, shape (N,)."""
        return np.concatenate([np.arange(len(states)) for states in self.members])

    @cached_property
    def ahead(self) -> Ints:
        """How many frames of its trajectory were recorded after each state, shape (N,)."""
        return np.concatenate([np.arange(len(states))[::-1] for states in self.members])

    @cached_property
    def scored(self) -> list[int]:
        """Places of the trajectories that have a score."""
        lacks = np.all([np.isnan(values) for values in self.labelled.scores.values()], axis=0)
        return [t for t, own in enumerate(self.members) if not lacks[own].all()]

    def scores(self, metric: str) -> Floats:
        """Scores of a metric as it is named in tables, shape (N,): there one force score is held
        against two labels."""
        return self.labelled.scores["force" if metric == "force" + ANY else metric]

    @property
    def metrics(self) -> Sequence[str]:
        """Metrics of which there are scores."""
        return list(self.labelled.scores)


def read_subject(path: AnyPath, number: int | None, data: AnyPath | None = None) -> Subject:
    """A run of a file of scores, as of `ScoreStore.run`, with its dataset: that at `data`, or else
    the one beside the file of scores.

    Raises what `ScoreStore.run` and `datasets.open` do, and ValueError if there is no run, `number`
    is no whole number, or `data` is another dataset.
    """
    path = Path(path)
    with em.store.ScoreStore(path) as store:
        if not store.runs():
            made = f"energymargin score DATASET -o {path}"
            raise ValueError(f"{path} has no scores yet; `{made}` puts some in")
        run = store.run(number)
        labelled, now = store.labelled_scores(run)
        return Subject(
            path=path,
            run=run,
            runs=len(store.runs()),
            about=em.summary.summary(run),
            labelled=labelled,
            now=now,
            bands={metric: run.quantiles(metric, BAND) for metric in run.with_quantiles},
            **_opened(run, path, data),
        )


def _opened(run: em.store.Run, path: Path, data: AnyPath | None) -> dict[str, Any]:
    """The fields of the dataset."""
    place = Path(data or path.with_name(f"{path.stem.removesuffix(SUFFIX)}.h5"))
    if data is None and not place.exists():
        return {"lacking": f"there is no {place.name} beside {path.name}"}
    try:
        dataset = em.datasets.open(place)
        try:
            dataset = run.scored(dataset, str(place), path.name)
        except ValueError:
            dataset.close()
            raise
    except (ValueError, OSError) as error:
        if data is None:
            return {"lacking": str(error)}
        raise
    return {"dataset": dataset, "data_path": place}


def view_command(subject: Subject) -> str:
    """Opens the dataset in the viewer, beside the scores of this run; empty without a dataset."""
    if subject.data_path is None:
        return ""
    words = ["energymargin", "view", subject.data_path.name, "--scores", subject.path.name]
    words += ["-o", f"{subject.data_path.stem}-state.html"]
    return shlex.join([*words, *(["--run", str(subject.run.number)] if subject.runs > 1 else [])])


class Notice(NamedTuple):
    """One thing that is not there."""

    text: str
    command: str | None = None
    """What would put it there."""


def notices(subject: Subject, output: Path) -> list[Notice]:
    """All that is missing, for the top of the page, which will be at `output`."""
    return [*_about_scores(subject), *_about_files(subject, output)]


def _about_scores(subject: Subject) -> Iterator[Notice]:
    """States that lack a score, and metrics that the run was not asked for."""
    lacks = {metric: np.isnan(values) for metric, values in subject.labelled.scores.items()}
    missing = {metric: int(own.sum()) for metric, own in lacks.items()}
    if any(missing.values()):
        lacking = np.any([*lacks.values()], axis=0)
        text = f"{lacking.sum()} of {len(lacking)} states are not scored yet"
        if len(set(missing.values())) > 1:
            by_metric = ", ".join(f"{count} lack {metric}" for metric, count in missing.items())
            text += f", or not in full: {by_metric}"
        way = ". This command scores them, and of those that cannot be simulated it says why:"
        yield _notice(text, way, _command(subject, subject.metrics))
    asked = USUAL if subject.run.future else [m for m in METRICS if m not in TIMED]
    labelled = subject.labelled
    several = labelled.captured_any is not None or labelled.success_any is not None
    there = [m for m in asked if several or not m.endswith(ANY)]
    unasked = [metric for metric in there if metric not in subject.metrics]
    if unasked:
        way = ". As far as the task has these, this adds a run with all scores, and computes only "
        every = [*subject.metrics, *unasked] if subject.run.future else None
        text = f"This run has no scores of {', '.join(unasked)}"
        yield _notice(text, f"{way}what is new:", _command(subject, every))


def _notice(text: str, way: str, command: str | None) -> Notice:
    """What is missing, and the way to it if there is a command."""
    return Notice(f"{text}." if command is None else text + way, command)


def _about_files(subject: Subject, output: Path) -> Iterator[Notice]:
    """A dataset that is not there, and scores of another version."""
    if subject.dataset is None:
        words = ["energymargin", "report", str(subject.path), "--data", "DATASET.h5"]
        if subject.runs > 1:
            words += ["--run", str(subject.run.number)]
        if output != subject.path.with_suffix(".html"):
            words += ["-o", str(output)]
        text = "Without the dataset there are no pictures of states, and frames instead of times: "
        yield Notice(f"{text}{subject.lacking}. With it:", shlex.join(words))
    if not subject.run.up_to_date:
        text = f"The scores are of algorithm {subject.run.algorithm}, and this energymargin has "
        way = "the trees in the pictures are searched again and may differ."
        yield Notice(f"{text}{em.searches.algorithm()}: {way}")


def _command(subject: Subject, metrics: Sequence[str] | None) -> str | None:
    """That scores the run's dataset with its settings; None if they are not of that command."""
    known = {own.name: own for own in fields(em.searches.SearchSettings)}
    future = subject.run.future
    if not set(subject.run.settings) <= set(known):
        return None
    words = ["energymargin", "score", str(subject.data_path or "DATASET.h5")]
    words += ["-o", str(subject.path)]
    if metrics is not None:
        words += ["--metrics", ",".join(metrics)]
    elif future is None:
        words.append("--paper")
    if future is not None:
        words += ["--frames", str(future.frames), "--plan", future.plan or "none"]
        words += [] if future.check is None else ["--check", str(future.check)]
        words += ["--dwell", str(future.dwell)] if future.dwell else []
    if engine := (subject.run.parameters or {}).get("engine"):
        words += ["--engine", engine]
    for name, value in subject.run.settings.items():
        if value != known[name].default:
            words += [flag_of(known[name]), *([] if value is True else [str(value)])]
    if (sampling := subject.run.sampling) is not None:
        words += ["--belief", sampling.uncertainty.to_json()]
        words += ["--particles", str(sampling.particles)]
    return shlex.join(words)
