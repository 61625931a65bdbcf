"""`em.rank`: which of several problems holds best, and with what confidence."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from energymargin._core import Cancel, Plan, Problem
from energymargin.act.candidates import Standing, check_alike, named
from energymargin.act.draws import EFFORTS, Disturbance, Draws, Question, Trial, Trials
from energymargin.act.racing import Duel, beaten, beats, duel, looks, mistaken
from energymargin.base.checks import by_name, function_or_none, share, whole_number, yes_or_no
from energymargin.base.limits import Limit
from energymargin.base.summary import Summarized
from energymargin.base.table_text import csv_text
from energymargin.evaluate.executors.choice import Executor
from energymargin.model.beliefs.belief import Belief, CommonParticle, common_particles
from energymargin.model.beliefs.uncertainty import Uncertainty

CONFIDENCE = 0.95
TOLERANCE = 0.05  # of a probability
MOST_NAMED = 4  # in a sentence
MOST_PERCENT = 99.9  # that is said
SHARE_BEFORE_TIE = 0.3  # of all draws: until then those that are as good as the leader race on


@dataclass(frozen=True, eq=False)
class Ranking(Summarized):
    """Candidates from the best to the worst, and what can be said of the first.

    The intervals are of each candidate alone, and of so many draws as if that had been settled
    before. The best is chosen by the draws that it is told with, so its score is a little too high:
    score it again with another seed for figures to publish.
    """

    metric: str
    standings: tuple[Standing, ...]
    """The best first: those that ran to the end, by score; then the others, the last out first."""
    tolerance: float
    level: float
    """Confidence that was asked for, of all comparisons together."""
    complete: bool = True
    """Whether no draw is missing: False if the timeout or the cancel came first."""

    def __len__(self) -> int:
        """How many candidates."""
        return len(self.standings)

    def __iter__(self) -> Iterator[Standing]:
        """From the best to the worst."""
        return iter(self.standings)

    def __getitem__(self, name: str) -> Standing:
        """One candidate, by its name; KeyError if there is none."""
        return by_name(name, {one.name: one for one in self.standings}, "candidate")

    def __repr__(self) -> str:
        """The decision."""
        return f"Ranking({self.decision})"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the candidates, the best first."""
        return tuple(standing.name for standing in self.standings)

    @property
    def best(self) -> str:
        """The name of the first."""
        return self.standings[0].name

    @property
    def steps(self) -> int:
        """Simulation steps of all candidates."""
        return sum(standing.steps for standing in self.standings)

    @cached_property
    def confidence(self) -> float:
        """Confidence, at least, that no other one is better than the best by more than
        `tolerance`; whenever the race ended."""
        return self._confidence(self.tolerance)

    @cached_property
    def regret_bound(self) -> float:
        """By how much another one is better than the best, at most, with the confidence `level`: a
        difference of probabilities, to 0.01; of efforts the share of the searches."""
        short = [k + 1 for k in range(101) if self._confidence(k / 100) < self.level]
        return min(max(short, default=0), 100) / 100

    @property
    def confidence_set(self) -> tuple[str, ...]:
        """Names of the first and of those that may be better, whenever the race ended. The best
        one is among them with the confidence `level`; of efforts the best one beats each other
        one, and there may be none."""
        most = 1.0 - self.level
        return self.best, *(name for name, risk in self._risks.items() if risk > most)

    def left(self, name: str) -> str:
        """Why a candidate left the race: "out", another one is better, or "as good", it is hardly
        better than the one that led; "" if it did not. KeyError if there is none of this name."""
        if self[name].racing:
            return ""
        return "as good" if name in self.confidence_set else "out"

    @property
    def decision(self) -> str:
        """One sentence for people."""
        if len(self) == 1:
            return f"there is but one: {self.best}"
        _, *others = self.confidence_set
        if not others:
            confidence = 1.0 - max(self._risks.values(), default=0.0)
            return f"the best is {self.best}, with {_percent(confidence)} % confidence"
        said, most, confidence = f"choose {self.best}:", self.tolerance, self.confidence
        if confidence < self.level:
            said, most = f"undecided: {self.best} leads, but", self.regret_bound
            confidence = self.level
        of_efforts = self.metric in EFFORTS
        by = f"in at most {most:.0%} of the searches" if of_efforts else f"by at most {most:g}"
        better = f"{_listed(others)} may be better"
        return f"{said} {better}, {by}, with {_percent(confidence)} % confidence"

    def to_csv(self) -> str:
        """A line for each candidate, in full precision."""
        names = ("score", "low", "high", "mean_survival", "draws", "diverged", "steps", "racing")
        rows = [(one.name, *(getattr(one, name) for name in names)) for one in self]
        return csv_text(("candidate", *names), rows)

    def _confidence(self, tolerance: float) -> float:
        """Each of the others is beaten, or the first is as good. Bets that one is beaten win by
        mistake half as often as they are allowed to; the other half of the risk is shared by all
        that may have come first, and are as good."""
        share = 0.5 / mistaken(len(self), circle=self.metric in EFFORTS)
        worse = {name: (1.0 - one.as_good(tolerance)) / share for name, one in self._duels.items()}
        risk = max((min(self._risks[name], worse[name]) for name in worse), default=0.0)
        return 1.0 - min(risk, 1.0)

    @cached_property
    def _risks(self) -> dict[str, float]:
        """One minus the confidence that each of the others is not the best; of efforts, that the
        first beats it."""
        if self.metric in EFFORTS:
            return {name: 1.0 - beats(one, len(self)) for name, one in self._duels.items()}
        return {
            one.name: 1.0 - beaten([duel(s.values, one.values) for s in self if s is not one])
            for one in self.standings[1:]
        }

    @cached_property
    def _duels(self) -> dict[str, Duel]:
        """The best against each of the others."""
        first, *others = self.standings
        return {other.name: duel(first.values, other.values) for other in others}


def rank(
    problems: Problem | Sequence[Problem] | Mapping[str, Problem],
    plans: Sequence[Plan] | Mapping[str, Plan] | None = None,
    *,
    metric: str = "probability",
    rollouts: int = 200,
    disturbance: Disturbance | None = None,
    uncertainty: Uncertainty | None = None,
    confidence: float = CONFIDENCE,
    tolerance: float = TOLERANCE,
    race: bool = True,
    seed: int = 0,
    nodes: int = 1000,
    store: str | Path | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Ranking:
    """Which of several problems holds best: plans, grasps, pushes, tools.

    All candidates meet the same disturbances, draw by draw. In a race they are compared after 16,
    24, 36, ... draws: who is beaten with the `confidence` is out, and later who is better than the
    leader by at most the `tolerance` leaves too. The race ends once one is left. The best effort is
    that of the one that beats each other one in most of the searches in which they differ.

    Args:
        problems: the candidates, with the same step, objects, bounds and duration, and the same
            horizon unless success is asked; a dict gives them names, else they are "0", "1", ...
        plans: of a single problem: each makes a candidate of it, `problem.replace(plan=plan)`.
        metric: "probability" of staying captured, "probability/success", or an effort of escape,
            "effort", "effort/est" or "effort/rrt".
        rollouts: the most draws of each candidate; of an effort, searches.
        disturbance: as of `em.capture_probability`, but Boltzmann; None: Uniform(). Not of efforts.
        uncertainty: how well friction, masses, poses and velocities are known: draw j has the same
            particle of it for every candidate. Draws are independent; one that a candidate cannot
            have is made again for all.
        confidence: of all comparisons together, whenever the race ends.
        tolerance: a difference of probabilities that does not matter; of efforts, a share of the
            searches in which another one may be better. 0: only better is better.
        race: False scores every candidate to the end.
        seed: the same seed draws the same, on any number of threads and on any executor.
        nodes: nodes of each search, as in `em.escape_effort`.
        store: a file where draws are kept, as of `em.improve`: the same call goes on from there.
        threads: None takes all cores.
        executor: in place of threads, as of `em.score`.
        progress: progress(done, total) counts draws; a race does not need them all.
        timeout: after so many seconds the draws count that all racing candidates have.
        cancel: ends the race as a timeout does, once it is set.

    Without a race the probability of a candidate is that of `em.capture_probability`, to the bit.
    Rollouts that diverge do not count, and the table says how many. Ctrl-C stops within 0.2 s.
    Raises ValueError on bad arguments, DivergedError if more than one rollout of a candidate and
    more than 1 % of them diverge, and TimeoutError or Cancelled if the limit comes before the first
    comparison.
    """
    limit = Limit(timeout, cancel)
    question = Question(metric, disturbance, seed, nodes)
    most = whole_number("rollouts", rollouts, 1)
    confidence, tolerance = share("confidence", confidence), share("tolerance", tolerance)
    yes_or_no("race", race)
    field = named(problems, plans)
    function_or_none("progress", progress, "done", "total")
    called = {f"problems[{name!r}]": problem for name, problem in field.items()}
    for name, problem in called.items():
        question.check(name, problem)
    check_alike(question.metric, called)
    asked = (most, confidence, tolerance)
    with Trials(question, uncertainty, store=store, executor=executor, threads=threads) as trials:
        comparison = Race(field, uncertainty, question)
        return comparison.run(trials, limit, *asked, race=race, progress=progress)


class Race:
    """Problems that are compared, and the draws that they have so far. With an uncertainty draw j
    of each has particle j of it."""

    def __init__(
        self, field: Mapping[str, Problem], uncertainty: Uncertainty | None, question: Question
    ) -> None:
        """No draws yet. Raises ValueError on an uncertainty that names what a problem does not
        have, or that is of other bodies in each."""
        self._names, self._problems, self._question = list(field), list(field.values()), question
        self.draws = [Draws.joined([]) for _ in field]
        """Draws of each problem, in their order."""
        self._racing = list(range(len(field)))
        self._out: list[int] = []
        self._count = 0  # draws of those that race
        self._particles: list[CommonParticle] = []
        self._more: Iterator[CommonParticle | None] | None = None
        if uncertainty is not None and field:
            beliefs = [Belief(problem, uncertainty=uncertainty) for problem in self._problems]
            self._more = common_particles(beliefs, question.seed)

    def trial(self, candidate: int, first: int, count: int) -> Trial:
        """So many draws of a candidate from number `first` on."""
        self._prepare(first + count, Limit())
        numbers = range(first, first + count)
        particles = None if self._more is None else self._particles
        return Trial(candidate, numbers, self._problems[candidate], particles)

    def _prepare(self, count: int, limit: Limit) -> bool:
        """Draws so many particles, if there is an uncertainty; False if the limit came."""
        while self._more is not None and len(self._particles) < count:
            if limit.reached:
                return False
            particle = next(self._more)
            self._particles += [] if particle is None else [particle]
        return True

    def draw(self, wanted: int, trials: Trials, limit: Limit) -> bool:
        """Takes the draws up to number `wanted` of those that race; False if the limit came."""
        first = self._count
        if not self._prepare(wanted, limit):
            return False
        asked = [self.trial(i, first, wanted - first) for i in self._racing]
        found = [one for one in trials.run(self._question, asked, limit) if one is not None]
        if len(found) < len(asked):
            return False
        for i, more in zip(self._racing, found, strict=True):
            self.draws[i] = Draws.joined([self.draws[i], more])
        self._count = wanted
        return True

    def run(
        self,
        trials: Trials,
        limit: Limit,
        most: int,
        confidence: float = CONFIDENCE,
        tolerance: float = TOLERANCE,
        *,
        race: bool = True,
        progress: Callable[[int, int], None] | None = None,
    ) -> Ranking:
        """The race to its end, `most` draws of each candidate, or to the limit; other arguments and
        errors as of `rank`."""
        tell = (lambda done, total: None) if progress is None else progress
        for wanted in looks(most):
            if not (complete := self.draw(wanted, trials, limit)):
                break
            self._require_few_diverged(most)
            tell(self._done, most * len(self.draws))
            races = race and len(self._racing) > 1 and wanted < most
            if races and self._is_decided(most, confidence, tolerance):
                break
        if complete:
            tell(self._done, self._done)  # a race does not need them all
        if not self._count:
            limit.require("the candidates were compared")
        self._require_few_diverged()
        racing = sorted(self._racing, key=self._place)
        standings = tuple(self._standing(i) for i in [*racing, *reversed(self._out)])
        return Ranking(self._question.metric, standings, tolerance, confidence, complete)

    @property
    def _done(self) -> int:
        """Draws of all candidates."""
        return sum(len(draws.values) for draws in self.draws)

    def _standing(self, candidate: int) -> Standing:
        draws, question = self.draws[candidate], self._question
        drawn = (self._names[candidate], draws.values, draws.mean_survival)
        score = (question.score(draws), *question.interval(draws))
        return Standing(*drawn, *score, draws.steps, candidate in self._racing)

    def _require_few_diverged(self, rollouts: int | None = None) -> None:
        for name, draws in zip(self._names, self.draws, strict=True):
            draws.require_few_diverged(name, rollouts)

    def _is_decided(self, most: int, confidence: float, tolerance: float) -> bool:
        """Whether one is left, after those have gone that are beaten, and later those that the
        leader is as good as."""
        risk = 1.0 - confidence
        leader, *others = sorted(self._racing, key=self._place)
        leaving = {i for i in others if 1.0 - self._beaten(i) <= risk}
        if self._done / (most * len(self.draws)) >= SHARE_BEFORE_TIE:
            risk *= 0.5 / mistaken(len(self.draws), circle=self._question.is_effort)
            as_good = {i: self._duel(leader, i).as_good(tolerance) for i in others}
            leaving |= {i for i, sure in as_good.items() if 1.0 - sure <= risk}
        self._out += sorted(leaving, key=self._place, reverse=True)
        self._racing = [i for i in self._racing if i not in leaving]
        return len(self._racing) == 1

    def _beaten(self, candidate: int) -> float:
        """Confidence that it is not the best; of efforts, that each of those that race beats it."""
        effort, count = self._question.is_effort, len(self.draws)
        others = self._racing if effort else range(count)
        duels = [self._duel(i, candidate) for i in others if i != candidate]
        return min(beats(one, count) for one in duels) if effort else beaten(duels)

    def _duel(self, first: int, second: int) -> Duel:
        return duel(self.draws[first].values, self.draws[second].values)

    def _place(self, candidate: int) -> tuple[float, float, int]:
        """Sorts the best first; of equal ones that which stays longer, then the first given."""
        draws = self.draws[candidate]
        return -self._question.score(draws), -draws.mean_survival, candidate


def _percent(share: float) -> str:
    """Rounded down, so that it does not claim more, and never all."""
    return f"{min(np.floor(1000 * share) / 10, MOST_PERCENT):g}"


def _listed(names: Sequence[str]) -> str:
    if len(names) > MOST_NAMED:
        names = [*names[: MOST_NAMED - 1], f"{len(names) - MOST_NAMED + 1} others"]
    *some, last = names
    return f"{', '.join(some)} and {last}" if some else last
