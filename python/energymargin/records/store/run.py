"""One dataset with one future and one choice of settings, in a file of scores."""

from __future__ import annotations

import json
import math
import re
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from energymargin.base.aliases import Floats
from energymargin.base.checks import whole_number
from energymargin.base.metrics import METRICS, TIMED
from energymargin.base.summary import Summarized
from energymargin.evaluate.executors.rows import Curve, Row
from energymargin.evaluate.futures import disturbance_in_words
from energymargin.evaluate.searches import algorithm_of
from energymargin.evaluate.store.answer_file import AnswerFile
from energymargin.evaluate.store.schema import NO_FUTURE
from energymargin.model.beliefs.sampling import Sampling
from energymargin.records.datasets import Dataset, Future
from energymargin.records.evaluation import LabelledScores

FLOATS = np.dtype("<f8")
"""Type of the numbers of a curve, as they are packed."""


class ScoredState(NamedTuple):
    """A state of a run, with its labels and its scores."""

    trajectory: int
    frame: int
    captured: int
    """0 or 1, as the labels after it."""
    success: int
    captured_any: int | None
    """None: there is one label for all objects."""
    success_any: int | None
    seconds: float
    """Computing time of all its scores [s]."""
    scores: tuple[float | None, ...]
    """Scores of the run's metrics, in their order; None: not there yet."""


class Run(Summarized):
    """The scores of one dataset with one future and one choice of settings, in a store."""

    def __init__(self, store: AnswerFile, number: int) -> None:
        """The run of this number, which is in the store."""
        self.store = store
        self.number = number
        self._database = store.database
        (self.dataset, self.future_number, asks, settings, *of_dataset) = self._database.execute(
            "SELECT dataset, future, asks, settings, task, states, digest, parameters FROM runs "
            "JOIN futures ON future = futures.id JOIN datasets ON dataset = datasets.id "
            "WHERE runs.id = ?",
            (number,),
        ).fetchone()
        self._place = f"dataset = {self.dataset} AND future = {self.future_number}"  # in SQL
        self.task, self.states, self.digest, parameters = of_dataset
        self.parameters: dict[str, Any] | None = parameters and json.loads(parameters)
        self.future = None if asks == NO_FUTURE else Future.from_json(asks)
        """What is asked of each state's future; None: the scores are about the state as it is."""
        self.settings: dict[str, Any] = json.loads(settings)
        self.settings.pop("search", None)  # of files from before 0.15, where metrics now say it
        self.sampling = Sampling.taken_from(self.settings)
        """What is not known of each state's model, and how many particles it has; None: each score
        is of the model as it is. The scores of a belief are means."""

    @cached_property
    def _questions(self) -> list[tuple[str, int, str, str]]:
        """Metric, number, settings (JSON) and algorithm of each, in the order of METRICS."""
        asked = "SELECT metric, id, settings, algorithm FROM asked JOIN questions ON question = id"
        rows: Iterable[tuple[str, int, str, str]]
        rows = self._database.execute(f"{asked} WHERE run = {self.number}")
        order = {metric: place for place, metric in enumerate(METRICS)}
        return sorted(rows, key=lambda row: (order.get(row[0], len(order)), row[0]))

    @cached_property
    def asked(self) -> dict[str, int]:
        """The number of each metric's question, in the order of METRICS."""
        return {metric: number for metric, number, _, _ in self._questions}

    @property
    def metrics(self) -> tuple[str, ...]:
        """The metrics of the run, in the order of METRICS."""
        return tuple(self.asked)

    @property
    def questions(self) -> list[int]:
        """The numbers of its questions, rising."""
        return sorted(self.asked.values())

    @cached_property
    def algorithm(self) -> str:
        """The version of energymargin since which the scores have these bits."""
        return max((algorithm for *_, algorithm in self._questions), key=_numbers)

    @cached_property
    def up_to_date(self) -> bool:
        """Whether this energymargin gives the same scores."""
        return all(algorithm_of(metric) == other for metric, _, _, other in self._questions)

    @property
    def common_settings(self) -> dict[str, Any]:
        """What the scores of runs that stand beside each other share: dataset, belief, settings."""
        belief = {} if self.sampling is None else self.sampling.all()
        return {"dataset": self.dataset, **self.settings, **belief}

    @cached_property
    def several(self) -> bool:
        """Whether there are labels of at least one of several objects."""
        there = "SELECT count(captured_any) + count(success_any) FROM states"
        return bool(self.store.value(f"{there} WHERE dataset = {self.dataset}"))

    def __str__(self) -> str:
        """In one line: number, task, states, metrics and settings."""
        scored, states = self.counts()
        settings = ", ".join(f"{name} {value}" for name, value in self.settings.items())
        asks = [str(one) for one in (self.future, self.sampling) if one is not None]
        asked = "; ".join([*asks, settings, f"algorithm {self.algorithm}"])
        head = f"run {self.number}: {self.task}, {scored} of {states} states"
        return f"{head}, {', '.join(self.metrics)} ({asked})"

    def counts(self) -> tuple[int, int]:
        """How many states have all their scores, and how many there are."""
        missing = int(self.store.value(f"SELECT count(*) FROM {self._lacking}"))
        return self.states - missing, self.states

    def missing(self, first: int = 0, last: int | None = None) -> list[int]:
        """The numbers of the states from `first` on, before `last`, that lack a score; rising."""
        last = self.states if last is None else last
        within = f"states.number >= {first} AND states.number < {last} ORDER BY states.number"
        rows = self._database.execute(f"SELECT states.number FROM {self._lacking} AND {within}")
        return [number for (number,) in rows]

    def pose(self, digests: Mapping[int, bytes]) -> dict[int, tuple[str, ...]]:
        """Says which problems some states make, by their numbers; returns the metrics that each
        lacks in the store."""
        with self.store.transaction():
            return {number: self._pose(number, digest) for number, digest in digests.items()}

    def known_problems(self, numbers: Sequence[int]) -> dict[int, bytes]:
        """Digests of the problems that some states made before, by their numbers, which rise."""
        listed = ", ".join(map(str, numbers))
        known = "SELECT number, digest FROM posed JOIN problems ON problem = problems.id"
        place = f"{self._place} AND number IN ({listed})"
        return dict(self._database.execute(f"{known} WHERE {place} ORDER BY number"))

    def forget_problems(self) -> None:
        """Forgets which problems all states made before."""
        with self.store.transaction():
            self._database.execute(f"DELETE FROM posed WHERE {self._place}")

    def _pose(self, number: int, digest: bytes) -> tuple[str, ...]:
        problem = self.store.number_of("problems", digest=digest)
        self._database.execute(
            "INSERT INTO posed VALUES (?, ?, ?, ?) ON CONFLICT (dataset, future, number) "
            "DO UPDATE SET problem = excluded.problem WHERE problem != excluded.problem",
            (self.dataset, self.future_number, number, problem),
        )
        asked = "SELECT question FROM scores WHERE problem = ? AND stream = ?"
        there = self._database.execute(asked, (problem, number)).fetchall()
        return tuple(metric for metric, question in self.asked.items() if (question,) not in there)

    def add_rows(self, rows: Sequence[Row]) -> None:
        """Inserts the scores of states that were posed, all or none."""
        with self.store.transaction():
            for row in rows:
                posed = f"SELECT problem FROM posed WHERE {self._place} AND number = {row.index}"
                problem = self.store.value(posed)
                for table, values in self._inserted(row):
                    marks = f"VALUES (?, ?{', ?' * len(values)}) ON CONFLICT DO NOTHING"
                    entry = (problem, row.index, *values)
                    self._database.execute(f"INSERT INTO {table} {marks}", entry)

    def _inserted(self, row: Row) -> Iterator[tuple[str, tuple[Any, ...]]]:
        """The table of each value of a row, and its columns from the question on."""
        for metric, value in row.scores.items():
            if metric in self.asked and not math.isnan(value):
                yield "scores", (self.asked[metric], value, row.times.get(metric, 0.0))
        for metric, (times, curve) in row.curves.items():
            if metric in self.asked:
                yield "curves", (self.asked[metric], _packed(times), _packed(curve))
        for metric, values in row.particles.items():
            yield "particles", (self.asked[metric], _packed(values))

    def seconds(self) -> float:
        """Mean computing time of a state that has all its scores [s]; 0 if none has."""
        scored, _ = self.counts()
        return sum(self.times().values()) / scored if scored else 0.0

    def times(self) -> dict[str, float]:
        """Computing time of each metric, of all states [s]; the first of those that share a search
        has all of it."""
        totals = {m: self._answers("scores", "total(seconds)", m).fetchone() for m in self.metrics}
        return {metric: float(total) for metric, (total,) in totals.items()}

    def rows(self) -> Iterator[ScoredState]:
        """All states, in the order of their numbers."""
        scores = "".join(f", max(iif(question = {n}, value, NULL))" for n in self.asked.values())
        rows = self._database.execute(
            "SELECT trajectory, frame, captured, success, captured_any, success_any, "
            f"total(seconds){scores} FROM {self._posed} "
            "LEFT JOIN scores ON scores.problem = posed.problem AND stream = posed.number "
            f"AND question IN ({self._listed}) WHERE states.dataset = {self.dataset} "
            "GROUP BY states.number ORDER BY states.number"
        )
        for row in rows:
            yield ScoredState._make((*row[:7], row[7:]))

    def curve(self, number: int, metric: str = "probability") -> Curve | None:
        """How a probability of the state of this number falls with time; None if it is missing.

        The times [s] from 0 to the horizon, and the probability of being captured throughout until
        each, shape (T,) both. "probability" and "probability/any" have curves; raises ValueError on
        a metric that the run does not have, and on a number that no state has.
        """
        row = self._found("times, curve", "curves", number, metric)
        return None if row is None else (_unpacked(row[0]), _unpacked(row[1]))

    @property
    def has_curves(self) -> bool:
        """Whether there is any curve."""
        return self._answers("curves", "1", more="LIMIT 1").fetchone() is not None

    def particles(self, number: int, metric: str) -> Floats | None:
        """The scores of the particles of a state's belief, shape (N,); None if it is not there.

        Errors: as `curve`.
        """
        row = self._found("scores", "particles", number, metric)
        return None if row is None else _unpacked(row[0])

    def _found(self, columns: str, table: str, number: int, metric: str) -> tuple[Any, ...] | None:
        """What `curves` or `particles` has of a state and a metric; None if it is not there."""
        number = whole_number("number", number, 0, self.states - 1)
        found = self._answers(table, columns, metric, f"AND number = {number}")
        row: tuple[Any, ...] | None = found.fetchone()
        return row

    def _answers(
        self, table: str, columns: str, metric: str | None = None, more: str = ""
    ) -> sqlite3.Cursor:
        """What scores, curves or particles have of the run's states, to one metric or to all.

        Raises ValueError on a metric that the run does not have.
        """
        if metric is not None and metric not in self.asked:
            raise ValueError(f"metric is {metric!r}, expected one of {', '.join(self.metrics)}")
        questions = self._listed if metric is None else self.asked[metric]
        return self._database.execute(
            f"SELECT {columns} FROM states JOIN posed USING (dataset, number) "
            f"JOIN {table} ON {table}.problem = posed.problem AND stream = number "
            f"AND question IN ({questions}) WHERE {self._place} {more}"
        )

    @property
    def with_quantiles(self) -> list[str]:
        """The metrics whose particles have quantiles: none without a belief, and no probability,
        which is a mean of noughts and ones."""
        return [] if self.sampling is None else [m for m in self.metrics if m not in TIMED]

    def quantiles(self, metric: str, shares: Sequence[float]) -> Floats:
        """Quantiles of the scores of each state's particles, shape (N, len(shares)): the lowest
        score below or at which so large a share of them is. NaN where there are no particles.

        Raises ValueError on a metric that the run does not have, and on a probability.
        """
        if metric in TIMED:
            text = f"metric is {metric!r}, whose particles have one rollout each, 1 or 0"
            raise ValueError(f"{text}, expected one without a clock, such as 'capture'")
        found = np.full((self.states, len(shares)), np.nan)
        for number, scores in self._answers("particles", "number, scores", metric):
            found[number] = np.quantile(_unpacked(scores), shares, method="inverted_cdf")
        return found

    def curves(self) -> Iterator[tuple[int, int, str, Curve]]:
        """All curves, in the order of the states: trajectory, frame, metric, and the curve."""
        names = {question: metric for metric, question in self.asked.items()}
        columns = "trajectory, frame, question, times, curve"
        rows = self._answers("curves", columns, more="ORDER BY number, question")
        for trajectory, frame, question, times, curve in rows:
            yield trajectory, frame, names[question], (_unpacked(times), _unpacked(curve))

    def labelled_scores(self) -> LabelledScores:
        """All labels and scores, for an evaluation; a score that is not there yet is NaN."""
        rows = ((row.trajectory, *row[2:6], *row.scores) for row in self.rows())
        kind = np.dtype((float, 5 + len(self.metrics)))
        columns = np.fromiter(rows, kind, self.states).T.copy()  # None becomes NaN
        trajectory, captured, success, *of_any = columns[:5]
        some, any_end = (None if np.isnan(own).any() else own.astype(bool) for own in of_any)
        scores = dict(zip(self.metrics, columns[5:], strict=True))
        labels = trajectory.astype(np.int64), captured.astype(bool), success.astype(bool)
        asks, frames = self._asks(), None if self.future is None else self.future.frames
        return LabelledScores(self.task, *labels, scores, some, any_end, asks, frames)

    def scored(self, dataset: Dataset, name: str, scores: str) -> Dataset:
        """This dataset as the run scored it, in an engine that was asked for; `name` and `scores`
        are those of the two files. Raises ValueError on another dataset."""
        engine = (self.parameters or {}).get("engine")
        for asked in (dataset, *([dataset.in_engine(engine)] if engine else [])):
            if self.digest.startswith(asked.digest()):  # some experiments name more after it
                return asked
        text = f"{name} is not the dataset that run {self.number} of {scores} scored"
        raise ValueError(text)

    def _asks(self) -> str | None:
        """What is asked of the future, with its disturbance; None without a future."""
        if self.future is None:
            return None
        if not set(self.metrics) & set(TIMED):
            return str(self.future)
        return f"{self.future}; probabilities {disturbance_in_words(self.settings)}"

    @property
    def _posed(self) -> str:
        """In SQL: all states, each with its problem if that was made."""
        place = f"posed.future = {self.future_number} AND posed.number = states.number"
        return f"states LEFT JOIN posed ON posed.dataset = states.dataset AND {place}"

    @property
    def _lacking(self) -> str:
        """In SQL: the states that lack a score of the run, of which those without a problem have
        none."""
        of_state = "scores.problem = posed.problem AND stream = posed.number"
        there = f"SELECT count(*) FROM scores WHERE {of_state} AND question IN ({self._listed})"
        states = f"{self._posed} WHERE states.dataset = {self.dataset}"
        return f"{states} AND ({there}) < {len(self.asked)}"

    @cached_property
    def _listed(self) -> str:
        return ", ".join(map(str, self.questions))


def _packed(numbers: Floats) -> bytes:
    return np.asarray(numbers, FLOATS).tobytes()


def _unpacked(numbers: bytes) -> Floats:
    return np.frombuffer(numbers, FLOATS).astype(np.float64)


def _numbers(version: str) -> list[int]:
    """The parts of a version, by which 0.10.0 comes after 0.9.2."""
    return [int(number) for number in re.findall(r"\d+", version)]
