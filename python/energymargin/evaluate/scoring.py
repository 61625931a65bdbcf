"""Scores of many problems on any executor, as a table. If it stops early, it has those that are
finished."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin._core import Cancel, Problem, warn_of_steps
from energymargin.base.aliases import Floats, Ints
from energymargin.base.checks import shown, whole_number
from energymargin.base.errors import EnergyMarginError, ExecutorError
from energymargin.base.limits import Limit
from energymargin.base.reprs import Record
from energymargin.base.summary import Summarized
from energymargin.evaluate import searches
from energymargin.evaluate.asking import Pairs, ask
from energymargin.evaluate.executors.choice import Executor
from energymargin.evaluate.executors.rows import Row, Work, score_chunk

if TYPE_CHECKING:
    from typing_extensions import Unpack

MOST_INDEX = 2**63 - 1  # of a problem's stream, as a table and a store hold it
FEW = 16  # problems below which workers share the searches of each: else some would be idle


def score(
    problems: Sequence[Problem],
    metrics: Sequence[str] | None = None,
    *,
    settings: searches.SearchSettings | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    on_rows: Callable[[list[Row]], None] | None = None,
    indices: Sequence[int] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    **loose: Unpack[searches.LooseSettings],
) -> ScoreTable:
    """Scores of every problem: the same bits for any number of threads, and on any executor.

    Args:
        problems: those that are scored.
        metrics: of METRICS; None takes all that every problem has.
        settings: of the searches and probabilities; None is SearchSettings().
        threads: None takes all cores that this process may use.
        executor: in place of threads, of `em.executors`: Processes, or Dask.
        progress: progress(done, total) is called as scores come in.
        on_rows: on_rows(rows) likewise; `row.curves` has the curves of the probabilities.
        indices: the problems' stream indices, by default 0 to N-1: a part of the problems with
            their own indices gets the scores it has in the whole. Each index has a stream of its
            own: `capture_score(problem, seed=stream(seed, index))` grows the tree of that problem.
        timeout: after so many seconds the table has the rows that are finished, each with the
            scores that it has in the whole; the others are missing.
        cancel: the same once it is set.
        loose: the fields of SearchSettings by name, as nodes=100, in place of `settings`.

    Ctrl-C stops within 0.2 s: `on_rows` has then got everything that was finished, and
    KeyboardInterrupt is raised. Raises ValueError on a bad problem or argument before anything is
    computed, and ScoreError at the end, with the table of the others, if the simulation of a
    problem failed, or its executor broke. Warns, as PlausibilityWarning, if more than 1 % of all
    steps did not converge, or of their time is lost; `warnings` of the table has what speaks
    against each problem's scores.
    """
    limit = Limit(timeout, cancel)
    if isinstance(problems, (Problem, Mapping)) or not hasattr(problems, "__getitem__"):
        raise TypeError(f"problems is {shown(problems)}, expected a list of Problems")
    settings = searches.chosen_settings(settings, **loose)
    metrics = searches.chosen_metrics(problems, metrics, settings)
    done: list[Row] = []
    errors: dict[int, str] = {}

    def note(answers: Pairs[Work, Row]) -> None:
        rows = [row for _, row in answers]
        errors.update({row.index: row.error for row in rows if row.error})
        good = [row for row in rows if not row.error]
        done.extend(good)
        if on_rows is not None and good:
            on_rows(good)
        if progress is not None:
            progress(len(done) + len(errors), len(work))

    numbers = _indices(indices, len(problems))
    work = [Work(n, one, tuple(metrics)) for n, one in zip(numbers, problems, strict=True)]
    try:
        complete = ask(
            *([work], partial(score_chunk, settings), note),
            split=Work.searches if len(work) < FEW else None,
            join=Work.row if len(work) < FEW else None,
            threads=threads,
            executor=executor,
            **limit.rest(),
        )
    except ExecutorError as error:
        complete, there = False, {row.index for row in done} | set(errors)
        errors.update({index: str(error) for index in numbers if index not in there})
    table = _score_table(done, metrics, complete=complete)
    _warn_of_steps(table, dict(zip(numbers, problems, strict=True)))
    if errors:
        raise ScoreError(errors, len(problems), table)
    return table


def _warn_of_steps(table: ScoreTable, problems: Mapping[int, Problem]) -> None:
    """Warns of the steps of all problems together, a warning for each length of a step."""
    if not (table.unconverged.any() or table.lost_time.any()):
        return
    lengths = np.array([problems[index].scene.step for index in table.index.tolist()])
    for rows in (lengths == length for length in np.unique(lengths)):
        counts = int(table.steps[rows].sum()), int(table.unconverged[rows].sum())
        lost_time = float(table.lost_time[rows].sum())
        warn_of_steps(*counts, lost_time, problems[int(table.index[rows][0])].scene)


def _indices(indices: Sequence[int] | None, problems: int) -> Sequence[int]:
    if indices is None:
        return range(problems)
    if len(indices) != problems:
        raise ValueError(f"indices has {len(indices)} numbers, expected one for each problem")
    return [whole_number("indices", index, 0, MOST_INDEX) for index in indices]


COLUMNS: dict[str, type] = {
    "index": np.int64,
    "seconds": float,
    "steps": np.int64,
    "unconverged": np.int64,
    "lost_time": float,
}
"""Columns of a row besides its scores."""


@dataclass(frozen=True, eq=False, repr=False)
class ScoreTable(Record, Summarized):
    """One row a problem: `table["capture"]` is the capture score of each, shape (N,)."""

    index: Ints
    """Number of the problem of each row, shape (N,), rising."""
    seconds: Floats
    """Computing time of each, that of its searches on their threads added up [s], shape (N,)."""
    scores: dict[str, Floats]
    """Scores by metric, shape (N,): capture, success in 0..1; effort [J], inf without an escape;
    force."""
    steps: Ints
    """Simulation steps of each problem, shape (N,)."""
    unconverged: Ints
    """Simulation steps whose contact solver did not converge, shape (N,)."""
    lost_time: Floats
    """Time of each in which nothing moved, as bodies would have passed through each other [s],
    shape (N,)."""
    warnings: dict[int, tuple[str, ...]] = field(default_factory=dict)
    """What speaks against the scores of a problem, by its index."""
    complete: bool = True
    """Whether every problem is there: False if the timeout or the cancel came first."""

    def __len__(self) -> int:
        """How many problems."""
        return len(self.index)

    def __getitem__(self, metric: str) -> Floats:
        """The scores of one metric, shape (N,); KeyError if it was not computed."""
        if metric not in self.scores:
            raise KeyError(f"{metric!r} was not computed; there are: {', '.join(self.scores)}")
        return self.scores[metric]

    def to_rows(self) -> list[dict[str, float]]:
        """One dictionary a problem: index, seconds, the counts of steps, and each metric."""
        columns = {name: getattr(self, name) for name in COLUMNS} | self.scores
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return [dict(zip(columns, row, strict=True)) for row in rows]


class ScoreError(EnergyMarginError, ValueError):
    """Some problems could not be scored."""

    def __init__(self, errors: dict[int, str], problems: int, table: ScoreTable | None = None):
        """`errors`: what went wrong, by the problem's index; `table`: those that could, if there
        is no store that has them."""
        first = min(errors)
        many = f"{len(errors)} of {problems} problems could not be scored"
        super().__init__(f"{many}; problem {first}: {errors[first]}")
        self.errors = errors
        self.table = table


def _score_table(rows: Iterable[Row], metrics: Sequence[str], *, complete: bool) -> ScoreTable:
    """The table of these rows, by rising index."""
    rows = sorted(rows, key=lambda row: row.index)
    of_rows = {name: [getattr(row, name) for row in rows] for name in COLUMNS}
    columns: dict[str, Any] = {name: np.array(of_rows[name], own) for name, own in COLUMNS.items()}
    scores = {m: np.array([row.scores[m] for row in rows], dtype=float) for m in metrics}
    warnings = {row.index: row.warnings for row in rows if row.warnings}
    return ScoreTable(**columns, scores=scores, warnings=warnings, complete=complete)
