"""A learned score: in microseconds what rollouts would find, and how sure that is.

It is of problems that share its facts, by name: a mass, a size, a set, a bound, the horizon.
"""

from __future__ import annotations

import io
import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property, reduce
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from energymargin import Problem, tasks
from energymargin.act.surrogates.model import Estimates, FeaturesOf, Layout, Model, Quality
from energymargin.base.aliases import Floats
from energymargin.base.checks import numbers_of, seed_number, share, shown
from energymargin.base.metrics import is_likelihood
from energymargin.base.replacing import replaced
from energymargin.datasets import Dataset
from energymargin.evaluation import HORIZON, compared_states
from energymargin.searches import algorithm
from energymargin.store import Run
from energymargin.summary import Summarized

KEPT = ("metric", "names", "given", "coverage", "source", "facts")  # as JSON
Params = Mapping[str, Floats]
Facts = dict[str, Any]
"""Values of a problem by their places in its file, as "scene.bodies.object.mass"."""

OTHER = ("format", "version", "state", "contacts", "plan")  # of the file, or of one state
NEAR = 0.01  # of a number: a horizon of frames is rounded to steps
VERSION = 2
SOURCE = ("task", "parameters", "settings", "digest")  # of a run
SAMPLE = 60  # states whose problems tell what never changes


@dataclass(frozen=True, eq=False, repr=False)
class Surrogate(Summarized):
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
    layout: Layout = field(repr=False)
    """Where the numbers of bodies and joints stand in a state."""
    model: Model = field(repr=False)
    """Its trees, and what it learned from."""
    features_of: FeaturesOf = field(repr=False)
    """A function of states, shape (N, n), that returns their features."""

    @cached_property
    def quality(self) -> Quality:
        """How good it is on trajectories that it did not learn from."""
        return self.model.quality()

    @staticmethod
    def learn(
        run: Run,
        dataset: Dataset,
        metric: str | None = None,
        *,
        features: tuple[FeaturesOf, Sequence[str]] | None = None,
        monotone: Mapping[str, int] | None = None,
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
            coverage: of the intervals, below 1.
            seed: of the choice of trajectories. The same seed gives the same bits.

        Of ten trajectories six grow the trees, two say how wide the intervals are, and two are the
        test, for `quality`. Scores that are missing or infinite are left out. Raises ValueError on
        another dataset, on fewer than 50 trajectories with scores, and on names that are not there.
        """
        share("coverage", coverage)
        dataset = run.scored(dataset, "dataset", str(run.store.path))
        if not run.up_to_date:
            of = f"algorithm {run.algorithm}, expected {algorithm()}"
            raise ValueError(f"run has scores of {of}: score the dataset again")
        labelled = run.labelled_scores()
        metric = metric or ("probability" if "probability" in run.metrics else run.metrics[0])
        frames = HORIZON if run.future is None else run.future.frames
        compared = compared_states(labelled, metric, frames, among="captured")
        scores = labelled.scores[metric]
        labels = np.full(len(scores), np.nan)
        labels[compared.number] = compared.labels
        known = np.flatnonzero(np.isfinite(scores))
        sample = known[:: len(known) // SAMPLE + 1].tolist()
        if not (problems := dataset.problems(sample, future=run.future)):
            raise ValueError(f"run has no finite score of {metric!r}, expected some")
        layout = Layout.of(problems[0].scene)
        features_of, own = features or (layout.features, layout.names)
        states, params = _inputs(dataset, timed=getattr(run.future, "plan", None) == "script")
        names = (*own, *params)
        if monotone is None:
            monotone = getattr(tasks.make(dataset.task, **dataset.parameters), "monotone", {})
        if unknown := monotone.keys() - set(names):
            raise ValueError(f"{min(unknown)!r} is no feature, expected one of {', '.join(names)}")
        table = _table(features_of, states, len(names), params)
        signs = np.array([monotone.get(name, 0) for name in names])
        limits = np.array([0, 1] if is_likelihood(metric) else [-np.inf, np.inf])
        arrays = (table[known], scores[known], labelled.trajectory[known], labels[known])
        model = Model(*arrays, limits, signs, coverage, seed_number(seed))
        source = {name: getattr(run, name) for name in SOURCE}
        source |= {"future": str(run.future), "belief": str(run.sampling), "algorithm": algorithm()}
        facts = reduce(same, map(facts_of, problems))
        about = (metric, names, tuple(params), coverage, source, facts)
        return Surrogate(*about, layout, model, features_of)

    def __call__(
        self, states: ArrayLike, *, params: Mapping[str, ArrayLike] | None = None, **given: Any
    ) -> Estimates:
        """Estimates of states, shape (N, n), or of one, shape (n,).

        `params`: those of the trajectory that are among `given`, one number each or one a state,
        shape (N,); others are ignored. `time` [s], as a keyword, is that of the state in its
        trajectory. Raises ValueError if one that is needed is missing, and on other shapes.
        """
        n, known = self.layout.dimension, {**(params or {}), **given}
        shape = (*np.shape(states)[:-1], n)[-2:]
        expected = f"finite numbers, shape (N, {n}) or ({n},)"
        whole = np.atleast_2d(numbers_of("states", states, expected, shape))
        columns = {}
        for name in self.given:
            if name not in known:
                way = "time=..." if name == "time" else "params=trajectory.params"
                raise ValueError(f"{name} is missing, which the score depends on: give {way}")
            one = np.ndim(known[name]) == 0
            column = np.repeat(known[name], len(whole)) if one else known[name]
            columns[name] = numbers_of(name, column, f"one number, or {len(whole)}", (len(whole),))
        found = self.model(_table(self.features_of, whole, len(self.names), columns))
        return found if len(shape) == 2 else Estimates(*(each[0] for each in vars(found).values()))

    def require(self, problem: Problem) -> None:
        """Raises ValueError unless a problem is of the scene, sets, bounds and horizon that it
        learned from; what differed between them may be anything."""
        facts = facts_of(problem)
        for name in self.facts.keys() - same(self.facts, facts).keys():
            learned = f"the surrogate learned from problems with {shown(self.facts[name])}"
            has = f"problem has {name} = {shown(facts.get(name))}"
            raise ValueError(f"{has}, but {learned}: learn one for this scene")

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file, in one go, of numpy's .npz: what it learned from. Raises OSError if it
        cannot be written."""
        about = {name: getattr(self, name) for name in KEPT} | {"layout": asdict(self.layout)}
        arrays: dict[str, Any] = asdict(self.model)
        with replaced(Path(path)) as file, file.open("wb") as opened:
            np.savez(opened, text=json.dumps(about | {"version": VERSION}), **arrays)

    @staticmethod
    def load(path: str | os.PathLike[str], *, features: FeaturesOf | None = None) -> Surrogate:
        """The surrogate in a file, whose trees grow again from what it learned from.

        `features`: the function of one that learned with features of its own. Raises ValueError on
        another file, on one of another version, or whose scores this energymargin no longer gives,
        and if that function is missing; OSError if it cannot be read.
        """
        content = io.BytesIO(Path(path).read_bytes())
        try:
            with np.load(content, allow_pickle=False) as file:
                arrays = dict(file)
            about = json.loads(str(arrays.pop("text")))
            if (version := about.pop("version")) != VERSION:
                raise ValueError(f"it has version {version}, expected {VERSION}: learn it again")
            if (learned := about["source"]["algorithm"]) != algorithm():
                of = f"algorithm {learned}, expected {algorithm()}"
                raise ValueError(f"its scores are of {of}: score the dataset and learn again")
            about |= {name: tuple(about[name]) for name in ("names", "given")}
            about |= {"layout": (layout := Layout(**about["layout"])), "model": Model(**arrays)}
            made = Surrogate(**about, features_of=features or layout.features)
            _ = made.model(np.zeros((1, len(made.names)))), made.quality  # all fits together
            if features is None and made.names != (*layout.names, *made.given):
                raise ValueError("it has features of its own: give load(..., features=FUNCTION)")
            return made
        except Exception as error:  # of numpy, zipfile, scikit-learn, and of wrong fields
            text = " ".join(str(error).split()) or type(error).__name__
            raise ValueError(f"{path} is no surrogate that can be used: {text}") from error


def _inputs(dataset: Dataset, *, timed: bool) -> tuple[Floats, dict[str, Floats]]:
    """All states, (N, n), and by name the parameters that differ and the time, (N,) each."""
    states, columns = [], list[dict[str, Floats]]()
    for each in dataset.trajectories:
        states.append(np.asarray(each.states))
        own = {name: np.full(len(each), value) for name, value in each.params.items()}
        columns.append(own | ({"time": np.asarray(each.times)} if timed else {}))
    params = {name: np.concatenate([one[name] for one in columns]) for name in columns[0]}
    return np.concatenate(states), {n: v for n, v in params.items() if np.ptp(v) > 0}


def _table(features_of: FeaturesOf, states: Floats, count: int, params: Params) -> Floats:
    """Features and params of states, shape (N, F), `count` in all."""
    expected = (len(states), count - len(params))
    found = numbers_of("features", features_of(states), f"numbers of shape {expected}", expected)
    return np.column_stack([found, *params.values()])


def facts_of(problem: Problem) -> Facts:
    """All facts of a problem; if its sets have no file, its bodies and horizon alone."""
    try:
        whole = json.loads(problem.to_json())
    except ValueError:  # a Predicate
        bodies = [{"name": body.name} for body in problem.scene.bodies]
        whole = {"scene": {"bodies": bodies}, "horizon": problem.horizon}
    return _leaves("", {k: v for k, v in whole.items() if k not in OTHER})


def same(first: Facts, second: Facts) -> Facts:
    """The facts of the first that the second shares, numbers to 1 %."""
    return {name: value for name, value in first.items() if _is_near(value, second.get(name))}


def _is_near(first: Any, second: Any) -> bool:
    numbers = isinstance(first, float) and isinstance(second, float)
    return bool(first == second) or (numbers and math.isclose(first, second, rel_tol=NEAR))


def _leaves(place: str, value: Any) -> Facts:
    if isinstance(value, list) and value and isinstance(value[0], dict):
        value = {str(each.get("name", k)): each for k, each in enumerate(value)}
    if not isinstance(value, dict):
        return {place: value}
    inner = (_leaves(f"{place}.{key}".lstrip("."), each) for key, each in value.items())
    return dict(fact for facts in inner for fact in facts.items())
