"""The page: its template, filled, with all that it needs inside; and its tables of AUC and AP."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files

from jinja2 import Environment, StrictUndefined
from plotly.offline import get_plotlyjs

from energymargin.evaluation import Cell, Evaluation
from energymargin.evaluation.cells import DASH, paper_text
from energymargin.evaluation.labelled import PAPER_HORIZON
from energymargin.evaluation.table import ALL_TITLE, ANY_TITLE
from energymargin.metrics import ANY
from energymargin.report.about import Fact, Notice
from energymargin.report.along import Along
from energymargin.report.plots import Plot
from energymargin.report.worst import Worst

__all__ = ["EvaluationTable", "ReportPage", "rendered", "tables"]

_AMONG = {"all": "all states", "captured": "states that are captured now"}


@dataclass(frozen=True)
class Entry:
    """One cell: its value, and what is written small below it."""

    value: str
    below: tuple[str, ...] = ()
    columns: int = 1
    """Over how many it goes."""


@dataclass(frozen=True)
class EvaluationTable:
    """Rows of scores."""

    title: str
    columns: list[str]
    rows: list[tuple[str, list[Entry]]]


def tables(results: Iterable[Evaluation]) -> list[EvaluationTable]:
    """Of each one table, or two if there are several objects: of all, and of at least one."""
    return [table for result in results for table in _tables(result)]


def _tables(result: Evaluation) -> list[EvaluationTable]:
    among = _AMONG[result.among]
    paper = result.shows_paper
    columns = [f"h = {horizon}" for horizon in result.horizons]
    columns += [f"paper, h = {PAPER_HORIZON}"] if paper else []
    rows = list(_table_rows(result, paper))
    of_all = [row for row in rows if not row[0].endswith(ANY)]
    of_any = [row for row in rows if row[0].endswith(ANY)]
    if not of_any:
        return [EvaluationTable(f"AUC/AP of each score, {among}", columns, of_all)]
    return [
        EvaluationTable(f"{ALL_TITLE}; {among}", columns, of_all),
        EvaluationTable(f"{ANY_TITLE}; {among}", columns, of_any),
    ]


def _table_rows(result: Evaluation, paper: bool) -> Iterator[tuple[str, list[Entry]]]:
    for score, cells in result.states.items():
        yield score, [*map(_entry, cells.values()), *_paper(result, score, paper)]
    for score, cell in result.trajectories.items():
        below = (*cell.intervals(), "of whole trajectories")
        entry = Entry(cell.value(), below, columns=len(result.horizons))
        yield score, [entry, *_paper(result, score, paper)]


def _entry(cell: Cell | None) -> Entry:
    return Entry(DASH) if cell is None else Entry(cell.value(), cell.intervals())


def _paper(result: Evaluation, score: str, paper: bool) -> list[Entry]:
    return [Entry(paper_text(result.paper(score)))] if paper else []


@dataclass(frozen=True)
class ReportPage:
    """What the page says."""

    title: str
    notices: Sequence[Notice]
    facts: Sequence[Fact]
    times: Sequence[Fact]
    versions: Sequence[Fact]
    result: Evaluation
    draws: int
    enough: int
    """Trajectories, below which the page warns of its intervals."""
    target: str
    """What the scores of states are held against, in words."""
    tables: Sequence[EvaluationTable]
    along: Along
    curves: Sequence[Plot]
    distributions: Sequence[Plot]
    pictures: int
    """How many were asked for of each score and label."""
    worst: Worst
    several: bool
    """Whether there are labels of at least one of several objects."""
    timed: bool
    """Whether there are probabilities over a horizon."""
    asks: str | None
    """What the scores ask about each state's future, in words; None: they have no clock."""
    states: int
    unscored: dict[str, int]
    """States without a score, of each metric that has such."""


def rendered(page: ReportPage) -> str:
    """The page as HTML. Whatever comes from files is escaped by the template."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(_text("page.html")).render(
        page=page, style=_text("style.css"), script=_text("page.js"), plotly=get_plotlyjs()
    )


def _text(name: str) -> str:
    return files("energymargin.report").joinpath(name).read_text(encoding="utf-8")
