"""AUC and AP as `evaluate` gives them, as tables of a page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from energymargin.evaluation import Cell, Evaluation
from energymargin.evaluation.labelled import PAPER_HORIZON
from energymargin.evaluation.paper import DASH, paper_text
from energymargin.evaluation.table import ALL_TITLE, ANY_TITLE
from energymargin.metrics import ANY

__all__ = ["Entry", "Table", "tables"]

_AMONG = {"all": "all states", "captured": "states that are captured now"}


@dataclass(frozen=True)
class Entry:
    """One cell: its value, and what is written small below it."""

    value: str
    below: tuple[str, ...] = ()
    columns: int = 1
    """Over how many it goes."""


@dataclass(frozen=True)
class Table:
    """Rows of scores."""

    title: str
    columns: list[str]
    rows: list[tuple[str, list[Entry]]]


def tables(results: Iterable[Evaluation]) -> list[Table]:
    """Of each one table, or two if there are several objects: of all, and of at least one."""
    return [table for result in results for table in _tables(result)]


def _tables(result: Evaluation) -> list[Table]:
    among = _AMONG[result.among]
    paper = result.shows_paper
    columns = [f"h = {horizon}" for horizon in result.horizons]
    columns += [f"paper, h = {PAPER_HORIZON}"] if paper else []
    rows = list(_rows(result, paper))
    of_all = [row for row in rows if not row[0].endswith(ANY)]
    of_any = [row for row in rows if row[0].endswith(ANY)]
    if not of_any:
        return [Table(f"AUC/AP of each score, {among}", columns, of_all)]
    return [
        Table(f"{ALL_TITLE}; {among}", columns, of_all),
        Table(f"{ANY_TITLE}; {among}", columns, of_any),
    ]


def _rows(result: Evaluation, paper: bool) -> Iterator[tuple[str, list[Entry]]]:
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
