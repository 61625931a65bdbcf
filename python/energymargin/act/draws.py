"""What is asked of each draw of a candidate, what came of some, and trials: draws run as one batch.

Draw number j is the same for every candidate: the same disturbance, and with an uncertainty the
same particle (common random numbers). So candidates differ by what they do, not by their luck.

Trials run on threads, in processes, or on a cluster; and in a store. There draws are known by the
digests of their questions: of all that they depend on. So what was run once is read, any ranking or
search may go on with the file, and one that has become another by a changed plan, constraint or
seed runs its own. A function looks like any other in a file, so none is kept there: not as
disturbance, not as set.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin import disturbances
from energymargin._core import Cancel, Cancelled, Problem
from energymargin.base.checks import check_type, function_of, one_of, require, shown
from energymargin.base.errors import DivergedError
from energymargin.base.limits import Limit
from energymargin.base.metrics import KINDS
from energymargin.base.reprs import Record
from energymargin.disturbances import text_of
from energymargin.evaluate.asking import Kept, Pairs, ask
from energymargin.evaluate.divergence import ANY, too_many_diverged
from energymargin.evaluate.executors.choice import Executor, chosen_executor
from energymargin.evaluate.searches import SearchSettings, metric_search
from energymargin.evaluate.store.answer_file import AnswerFile
from energymargin.model.beliefs.belief import CommonParticle
from energymargin.model.beliefs.uncertainty import Uncertainty

EFFORTS = KINDS["effort"].metrics
OBJECTIVES = ("probability", "probability/success", *EFFORTS)

OF_INTERVALS = 0.95
PIECE = 1000  # draws that are made at a time
# They count where they are gathered if they diverge.
OF_ROLLOUTS: dict[str, Any] = {"undisturbed": False, "most_diverged": ANY}

Disturbance = disturbances.Disturbance | Callable[[Any, Any], Any]
"""As of `capture_probability`."""


@dataclass(frozen=True)
class Question:
    """What each draw is asked; raises ValueError on what cannot be."""

    metric: str = "probability"
    """One of OBJECTIVES."""
    disturbance: Disturbance | None = None
    """Disturbance of the probabilities, as in `capture_probability`; None: Uniform()."""
    seed: int = 0
    """Seed of the draws: draw j of a probability is rollout number j with it, of an effort the
    search with the seed stream(seed, j)."""
    nodes: int = 1000
    """Nodes of each search."""
    settings: SearchSettings = field(init=False, repr=False)
    """Those of each draw's search or rollouts."""

    def __post_init__(self) -> None:
        """Checks it."""
        one_of("metric", self.metric, OBJECTIVES)
        check_disturbance(self.disturbance)
        if isinstance(self.disturbance, disturbances.Boltzmann):
            why = "whose draws have weights, expected another model: draws are compared one by one"
            raise ValueError(f"disturbance is {self.disturbance!r}, {why}")
        if self.is_effort and self.disturbance is not None:
            given = f"{shown(self.disturbance)} with the metric {self.metric!r}"
            why = "an effort is the least work within the problem's bounds"
            raise ValueError(f"disturbance is {given}, expected None: {why}")
        object.__setattr__(self, "settings", SearchSettings(nodes=self.nodes, seed=self.seed))

    @property
    def is_effort(self) -> bool:
        """Whether draws are searches, and values efforts [J]."""
        return self.metric in EFFORTS

    def score(self, draws: Draws) -> float:
        """Mean of the values of draws that count, or the median effort [J]."""
        if self.is_effort:  # a lower median: inf where most searches found no way out
            return float(np.quantile(draws.kept, 0.5, method="inverted_cdf"))
        return float(draws.kept.mean())

    def interval(self, draws: Draws) -> tuple[float, float]:
        """(low, high) of the score with 95 % confidence; of efforts two order statistics, or (0,
        inf) where the draws are too few for those."""
        if not self.is_effort:
            return draws.interval()
        from scipy import stats

        count, ordered = len(draws.kept), np.sort(draws.kept).tolist()
        first = int(stats.binom.ppf((1.0 - OF_INTERVALS) / 2, count, 0.5)) - 1
        return (ordered[first], ordered[count - 1 - first]) if first >= 0 else (0.0, np.inf)

    def check(self, name: str, problem: Problem) -> None:
        """Raises ValueError if a problem lacks what the question is about."""
        check_type(name, problem, Problem, "a Problem")
        if not self.is_effort and problem.horizon is None:
            way = "expected one with: problem.replace(horizon=...)"
            raise ValueError(f"{name} is without a horizon, {way}")
        if self.metric == "probability/success" and problem.succeeded is None:
            raise ValueError(f"{name} is without a success set, expected one with: succeeded=...")


def check_disturbance(disturbance: Any) -> None:
    """Raises ValueError unless it is a model, a function (random, times), or None."""
    if disturbance is None or isinstance(disturbance, disturbances.Disturbance):
        return
    right = callable(disturbance) and not isinstance(disturbance, type)
    expected = "a model of em.disturbances, a function (random, times), or None"
    require(right, "disturbance", disturbance, expected)
    function_of("disturbance", disturbance, "random", "times")


def check_uncertainty(uncertainty: Uncertainty | None) -> None:
    """Raises ValueError on another thing."""
    check_type("uncertainty", uncertainty, Uncertainty | None, "an em.beliefs.Uncertainty or None")


class Draw(NamedTuple):
    """One draw of a candidate."""

    candidate: int
    number: int
    problem: Problem
    particle: int | None = None
    """With an uncertainty the number of its particle."""


@dataclass(frozen=True, eq=False)
class Trial:
    """Draws of one candidate in a row. There may be many, so they are made when asked for."""

    candidate: int
    numbers: range
    problem: Problem
    """Of every draw without an uncertainty."""
    particles: Sequence[CommonParticle] | None = None
    """With one, by the number of the draw."""

    def __len__(self) -> int:
        """How many."""
        return len(self.numbers)

    def draws(self) -> Iterator[list[Draw]]:
        """All of them, some at a time."""
        for k in range(0, len(self), PIECE):
            yield list(map(self.draw, self.numbers[k : k + PIECE]))

    def draw(self, number: int) -> Draw:
        """The draw of this number."""
        if self.particles is None:
            return Draw(self.candidate, number, self.problem)
        one = self.particles[number]
        return Draw(self.candidate, number, one.problems[self.candidate], one.number)


@dataclass(frozen=True, eq=False, repr=False)
class Draws(Record):
    """What came of N draws."""

    values: NDArray[np.float64]
    """Values of the draws, shape (N,): 1 or 0 of a probability, or efforts [J]; NaN of a rollout
    that diverged."""
    times: NDArray[np.float64]
    """For how long each stayed captured, as a share of its horizon, shape (N,); of an effort 1 if
    the search found no escape, else 0; NaN of a rollout that diverged."""
    steps: int
    """Simulation steps."""

    @property
    def diverged(self) -> int:
        """Rollouts that diverged, which do not count."""
        return int(np.isnan(self.values).sum())

    @property
    def kept(self) -> NDArray[np.float64]:
        """The values of those that did not diverge, shape (N - diverged,)."""
        return self.values[~np.isnan(self.values)]

    def require_few_diverged(self, subject: str, most: int | None = None) -> None:
        """Raises DivergedError if too many of them diverged, or of so many (`most`) that they may
        come to, or if no other is left."""
        count = len(self.values)
        if too_many_diverged(self.diverged, most or count) or self.diverged == count:
            raise DivergedError(subject, self.diverged, count)

    def interval(self, confidence: float = OF_INTERVALS) -> tuple[float, float]:
        """(low, high) of the probability whose draws they are (Clopper and Pearson)."""
        from scipy import stats

        test = stats.binomtest(round(float(self.kept.sum())), len(self.kept))
        found = test.proportion_ci(confidence)
        return float(found.low), float(found.high)

    @property
    def mean_survival(self) -> float:
        """Mean of the times."""
        return float(np.nanmean(self.times))

    @staticmethod
    def joined(parts: Sequence[Draws]) -> Draws:
        """All of them, in this order."""
        values = np.concatenate([np.zeros(0), *(part.values for part in parts)])
        times = np.concatenate([np.zeros(0), *(part.times for part in parts)])
        return Draws(values, times, sum(part.steps for part in parts))


class Trials(ExitStack):
    """The workers of an executor and a store, for one batch of trials after the other."""

    def __init__(
        self,
        question: Question,
        uncertainty: Uncertainty | None = None,
        *,
        store: str | Path | None = None,
        executor: Executor | None = None,
        threads: int | None = None,
        on_draws: Callable[[Draws], None] = lambda _: None,
    ) -> None:
        """Opens them.

        `store`: trials that are whole go there, and are not run again. `threads`: in place of an
        executor; None takes all cores. `on_draws`: called with draws as they come in, or are read.
        Raises ValueError on another thing than an Uncertainty, if executor and threads are given,
        and on a disturbance that a file cannot tell from another; else as AnswerFile.
        """
        super().__init__()
        check_uncertainty(uncertainty)
        self._on_draws, on = on_draws, chosen_executor(executor, threads)
        self._uncertainty = uncertainty
        check_type("store", store, str | Path | None, "the name of a file, or None")
        self._file: AnswerFile | None = None
        with ExitStack() as opened:
            if store is not None:
                _disturbance_text(question.disturbance)
                self._file = opened.enter_context(AnswerFile(store, create=True))
            self._workers = opened.enter_context(on.workers())
            self.push(opened.pop_all())

    def run(self, question: Question, trials: Sequence[Trial], limit: Limit) -> list[Draws | None]:
        """What came of each; None of those that the limit left unfinished.

        Raises KeyboardInterrupt after Ctrl-C, within 0.2 s, and what a trial raised.
        """
        found: dict[int, Draws] = {}

        def note(answers: Pairs[Trial, Draws]) -> None:
            for trial, draws in answers:
                found[trial.candidate] = draws
                self._on_draws(draws)

        ask(
            *([trials], partial(draw_chunk, question), note),
            split=Trial.draws,
            join=lambda _, parts: Draws.joined(parts),
            kept=self._kept(question),
            executor=self._workers,
            **limit.rest(),
        )
        return [found.get(trial.candidate) for trial in trials]

    def _kept(self, question: Question) -> Kept[Trial, Draws] | None:
        """The trials of a question in the store. Raises ValueError on what a file cannot tell from
        another."""
        if self._file is None:
            return None
        file = self._file
        known = None if self._uncertainty is None else self._uncertainty.to_json()
        asked = (known, question.metric, question.seed, question.nodes)
        pushed = _disturbance_text(question.disturbance)

        def digest(trial: Trial) -> bytes:
            """The particles of a candidate follow from the first one and their numbers."""
            first = trial.draw(trial.numbers[0])
            own = [] if trial.particles is None else [trial.particles[k] for k in trial.numbers]
            particles = tuple(one.number for one in own)
            text = _problem_text(first.problem)
            return file.key(*asked, pushed, first.number, len(trial), particles, text)

        return Kept(file, digest, _read, _written)


def draw_chunk(question: Question, draws: Sequence[Draw], cancel: Cancel) -> list[Draws | None]:
    """On a worker: what came of draws; those of one problem that follow each other together, at the
    first of them. Draws that a lost worker leaves come again behind later ones."""

    def together(place: int) -> tuple[int, int, int]:
        draw = draws[place]
        run = place if question.is_effort else draw.number - place
        return draw.candidate, id(draw.problem), run

    results: list[Draws | None] = []
    for _, group in groupby(range(len(draws)), together):
        first, *others = (draws[place] for place in group)
        settings = replace(question.settings, rollouts=1 + len(others))
        number = first.number if question.is_effort else None
        which: Any = {} if question.is_effort else OF_ROLLOUTS | {"first": first.number}
        which |= {"disturbance": _disturbance_of(question, first.problem), "cancel": cancel}
        found = metric_search(first.problem, question.metric, settings, number, **which)
        if not found.complete:
            raise Cancelled("cancelled within a trial")
        results += [_draws_of(question, found, first.problem), *(None for _ in others)]
    return results


def _disturbance_of(question: Question, problem: Problem) -> Any:
    """That of a problem, for a disturbance that depends on its masses."""
    of_problem = getattr(question.disturbance, "of_problem", None)
    return question.disturbance if of_problem is None else of_problem(problem)


def _draws_of(question: Question, found: Any, problem: Problem) -> Draws:
    """What came of so many rollouts of a problem, or of one search."""
    if question.is_effort:
        steps = round(float(np.sum(found.tree.durations)) / problem.scene.step)
        return Draws(np.array([found.effort]), np.array([float(np.isinf(found.effort))]), steps)
    shares = np.minimum(found.exit_times, found.times[-1]) / found.times[-1]
    success = question.metric == "probability/success"
    values = found.successes if success else np.isinf(found.exit_times)
    return Draws(np.where(np.isnan(shares), np.nan, values.astype(float)), shares, found.steps)


def _read(_: Trial, content: bytes) -> Draws:
    values, times, steps = json.loads(content)
    return Draws(np.array(values), np.array(times), steps)


def _written(draws: Draws) -> bytes:
    return json.dumps([draws.values.tolist(), draws.times.tolist(), draws.steps]).encode()


def _disturbance_text(disturbance: Any) -> str | None:
    if disturbance is None:
        return None
    if not isinstance(disturbance, disturbances.Disturbance):
        why = "which a store cannot tell from another function"
        way = "use a model of em.disturbances, or leave store out"
        raise ValueError(f"disturbance is {shown(disturbance)}, {why}: {way}")
    return text_of(disturbance)


def _problem_text(problem: Problem) -> str:
    try:
        return problem.to_json()
    except ValueError as error:
        why = "store keeps draws by the text of their problems"
        raise ValueError(f"{why}: {error}, or leave store out") from error
