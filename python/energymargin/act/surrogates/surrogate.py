"""A learned score: in microseconds what rollouts would find, and how sure that is."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin import tasks
from energymargin._core import Problem
from energymargin.act.surrogates.facts import Facts, common_facts, facts_of, is_same
from energymargin.act.surrogates.features import FeaturesOf, Layout
from energymargin.act.surrogates.fitting import fitted
from energymargin.act.surrogates.model import Estimates, Model, unmirrored
from energymargin.act.surrogates.quality import Quality, quality_of
from energymargin.base.checks import numbers_of, seed_number, share, shown
from energymargin.base.metrics import is_likelihood
from energymargin.base.replacing import replaced
from energymargin.base.reprs import Record
from energymargin.base.summary import Summarized
from energymargin.evaluate.searches import algorithm
from energymargin.records.datasets import Dataset
from energymargin.records.store import Run

Vector = NDArray[np.float64]

KEPT = ("metric", "names", "given", "coverage", "source", "facts")  # as JSON
FORMAT, VERSION = "energymargin-surrogate", 1
TIME = "time"
PROBABILITY = "probability"
HORIZON = 2  # frames of the labels of the test, of scores without a horizon
SOURCE = ("task", "parameters", "settings", "digest")  # of a run
SAMPLE = 60  # states whose problems tell what never changes


@dataclass(frozen=True, eq=False, repr=False)
class Surrogate(Record, Summarized):
    """A score of a store, learned: `surrogate(states)` takes microseconds a state.

    `Surrogate.learn` makes one; `save` and `load` keep it in a file.
    """

    metric: str
    """The score."""
    names: tuple[str, ...]
    """Features of a state, and after them `given`."""
    given: tuple[str, ...]
    """What has to be given with a state: parameters of its trajectory that differ, and "time"."""
    coverage: float
    """Probability with which the score of a state of a new trajectory is within its interval: of
    probabilities near 0 or 1, and of others, each by themselves."""
    source: dict[str, Any] = field(repr=False)
    """The run: its task, parameters, settings, future, belief, the dataset's digest, the
    algorithm."""
    facts: Facts = field(repr=False)
    """What all problems have in common that it learned from."""
    quality: Quality
    """How good it is on trajectories that it did not learn from."""
    layout: Layout = field(repr=False)
    """Which numbers of a state are whose."""
    model: Model = field(repr=False)
    """What was fitted."""
    features_of: FeaturesOf = field(repr=False)
    """A function of states, shape (N, n), that returns their features."""

    @staticmethod
    def learn(
        run: Run,
        dataset: Dataset,
        metric: str | None = None,
        *,
        features: tuple[FeaturesOf, Sequence[str]] | None = None,
        monotone: Mapping[str, int] | None = None,
        mirrored: Sequence[str] | None = None,
        coverage: float = 0.9,
        seed: int = 0,
    ) -> Surrogate:
        """Learns a score of a run of a store.

        Args:
            run: the scores.
            dataset: that the run scored; it has the states.
            metric: of the run; by default its probability, or else its first one.
            features: a function of states, shape (N, n), that returns F numbers of each, shape (N,
                F), and their F names. By default those of the scene's Layout.
            monotone: by name 1, the score never falls with it, or -1, it never rises. By default
                what the task says: its attribute `monotone`.
            mirrored: names of features that change their signs together without a change of the
                score. By default what the task says: its attribute `mirrored`.
            coverage: of the intervals, below 1.
            seed: of the choice of trajectories. The same seed gives the same bits.

        Of ten trajectories five grow the trees, one calibrates them, two say how wide the intervals
        are, and two are the test, for `quality`. Scores that are missing or infinite are left out.
        Raises ValueError on another dataset, on fewer than 50 trajectories with scores, and on
        names that are not there.
        """
        share("coverage", coverage)
        if why := run.why_not_of(dataset, "dataset", str(run.store.path)):
            raise ValueError(why)
        if not run.up_to_date:
            raise ValueError(
                f"run has scores of algorithm {run.algorithm}, expected those of {algorithm()}, "
                "which this energymargin gives: score the dataset again"
            )
        labelled = run.labelled_scores()
        metric = metric or next(m for m in (PROBABILITY, *run.metrics) if m in run.metrics)
        if metric not in labelled.scores:
            raise ValueError(f"metric is {metric!r}, expected one of {', '.join(run.metrics)}")
        scores = labelled.scores[metric]
        known = np.flatnonzero(np.isfinite(scores))
        sample = known[:: len(known) // SAMPLE + 1].tolist()
        problems = dataset.problems(sample, future=run.future)
        if not problems:
            raise ValueError(f"run has no finite score of {metric!r}, expected some")
        layout = Layout.of(problems[0].scene)
        features_of, own = features or (layout.features, layout.names)
        states, params = _inputs(dataset, timed=getattr(run.future, "plan", None) == "script")
        names = (*own, *params)
        task = tasks.make(dataset.task, **dataset.parameters)
        signs = getattr(task, "monotone", {}) if monotone is None else monotone
        flipped = getattr(task, "mirrored", ()) if mirrored is None else mirrored
        if unknown := [name for name in (*signs, *flipped) if name not in names]:
            raise ValueError(f"{unknown[0]!r} is no feature, expected one of {', '.join(names)}")
        table = _table(features_of, states, names, params)
        model, is_test = fitted(
            table[known],
            scores[known],
            labelled.trajectory[known],
            bounded=is_likelihood(metric),
            monotone=[signs.get(name, 0) for name in names],
            mirrored=[names.index(name) for name in flipped],
            coverage=coverage,
            seed=seed_number(seed),
        )
        held = np.full(len(scores), np.nan)
        held[known[is_test]] = model.value(unmirrored(table[known[is_test]], model.mirrored))
        low, high = model.interval(held)
        return Surrogate(
            metric=metric,
            names=names,
            given=tuple(params),
            coverage=coverage,
            source={
                **{name: getattr(run, name) for name in SOURCE},
                "future": str(run.future),
                "belief": str(run.sampling),
                "algorithm": algorithm(),
            },
            facts=common_facts(problems),
            quality=quality_of(
                labelled,
                metric,
                values=held,
                inside=(low <= scores) & (scores <= high),
                refused=model(table).refused,
                frames=HORIZON if run.future is None else run.future.frames,
            ),
            layout=layout,
            model=model,
            features_of=features_of,
        )

    def __call__(
        self, states: ArrayLike, *, params: Mapping[str, ArrayLike] | None = None, **given: Any
    ) -> Estimates:
        """Of states, shape (N, n), or of one, shape (n,).

        `params`: those of the trajectory that are among `given`, one number each or one a state,
        shape (N,); others are ignored. `time` [s], as a keyword, is that of the state in its
        trajectory. Raises ValueError if one that is needed is missing, and on other shapes.
        """
        own = numbers_of("states", states)
        if own.ndim not in (1, 2) or own.shape[-1] != self.layout.dimension:
            n = self.layout.dimension
            raise ValueError(f"states has shape {own.shape}, expected (N, {n}) or ({n},)")
        if not np.isfinite(own).all():
            raise ValueError(
                "states has numbers that are not finite, expected poses and velocities"
            )
        whole = np.atleast_2d(own)
        known = {**(params or {}), **given}
        columns = {}
        for name in self.given:
            if name not in known:
                way = "time=..." if name == TIME else "params=trajectory.params"
                raise ValueError(f"{name} is missing, which the score depends on: give {way}")
            column = numbers_of(name, known[name])
            if column.shape not in ((), (len(whole),)):
                raise ValueError(f"{name} has shape {column.shape}, expected () or {(len(whole),)}")
            columns[name] = np.broadcast_to(column, len(whole))
        found = self.model(_table(self.features_of, whole, self.names, columns))
        if own.ndim == 2:
            return found
        return Estimates(*(getattr(found, f.name)[0] for f in fields(found)))

    def require(self, problem: Problem) -> None:
        """Raises ValueError unless a problem is of the scene, sets, bounds and horizon that it
        learned from; what differed between them may be anything."""
        own = facts_of(problem)
        for name, value in self.facts.items():
            if not is_same(own.get(name), value):
                raise ValueError(
                    f"problem has {name} = {shown(own.get(name))}, but the surrogate learned from "
                    f"problems with {shown(value)}: learn one for this scene"
                )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file, in one go, of numpy's .npz. Raises OSError if it cannot be written."""
        about = {"format": FORMAT, "version": VERSION, **{n: getattr(self, n) for n in KEPT}}
        about |= {"quality": asdict(self.quality), "layout": asdict(self.layout)}
        text = np.array(json.dumps(about))
        written: dict[str, Any] = {"text": text, **self.model.arrays()}
        with replaced(Path(path)) as file, file.open("wb") as opened:
            np.savez(opened, **written)

    @staticmethod
    def load(path: str | os.PathLike[str], *, features: FeaturesOf | None = None) -> Surrogate:
        """The surrogate in a file.

        `features`: the function of one that learned with features of its own. Raises ValueError on
        another file, on one of another version, or whose scores this energymargin no longer gives,
        and if that function is missing; OSError if it cannot be read.
        """
        content = io.BytesIO(Path(path).read_bytes())
        with _damage_in_words(path), np.load(content, allow_pickle=False) as file:
            arrays = dict(file)
            about = json.loads(str(arrays.pop("text")))
            kind, version = about.pop("format"), about.pop("version")
            learned = about["source"]["algorithm"] if kind == FORMAT else ""
        if (kind, version) != (FORMAT, VERSION):
            raise ValueError(
                f"{path} is {shown(kind)}, version {shown(version)}, expected {FORMAT!r}, version "
                f"{VERSION}: learn again"
            )
        if learned != algorithm():
            raise ValueError(
                f"{path} learned from scores of algorithm {learned}, and this energymargin "
                f"gives those of {algorithm()}: score the dataset and learn again"
            )
        with _damage_in_words(path):
            layout, quality = Layout(**about.pop("layout")), Quality(**about.pop("quality"))
            about |= {name: tuple(about[name]) for name in ("names", "given")}
            own = layout.names
            model = Model(**arrays)
            model(np.zeros((1, len(about["names"]))))  # so all its arrays belong together
        if features is None and about["names"] != (*own, *about["given"]):
            raise ValueError(f"{path} has features of its own: give load(..., features=FUNCTION)")
        parts: dict[str, Any] = {"layout": layout, "quality": quality, "model": model}
        with _damage_in_words(path):
            return Surrogate(**about, **parts, features_of=features or layout.features)


@contextmanager
def _damage_in_words(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turns whatever numpy, zipfile and wrong fields raise into a ValueError that names the
    file."""
    try:
        yield
    except Exception as error:
        text = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path} is no surrogate, or damaged: {text}") from error


def _inputs(dataset: Dataset, *, timed: bool) -> tuple[Vector, dict[str, Vector]]:
    """All states, (N, n), and by name the parameters that differ and the time, (N,) each."""
    states, columns = [], list[dict[str, Vector]]()
    for each in dataset.trajectories:
        states.append(np.asarray(each.states))
        own = {name: np.full(len(each), value) for name, value in each.params.items()}
        columns.append(own | ({TIME: np.asarray(each.times)} if timed else {}))
    params = {name: np.concatenate([one[name] for one in columns]) for name in columns[0]}
    return np.concatenate(states), {n: v for n, v in params.items() if np.ptp(v) > 0}


def _table(
    features_of: FeaturesOf, states: Vector, names: tuple[str, ...], params: Mapping[str, Vector]
) -> Vector:
    """Features and params of states, shape (N, F)."""
    expected = (len(states), len(names) - len(params))
    found = numbers_of("features", features_of(states), f"numbers of shape {expected}", expected)
    return np.column_stack([found, *params.values()])
