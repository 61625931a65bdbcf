"""The page: its template, filled, with all that it needs inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

from jinja2 import Environment, StrictUndefined
from plotly.offline import get_plotlyjs

from energymargin.evaluation import Evaluation
from energymargin.report.about import Fact
from energymargin.report.along import Along
from energymargin.report.missing import Notice
from energymargin.report.plots import Plot
from energymargin.report.tables import Table
from energymargin.report.worst import Worst

__all__ = ["Page", "rendered"]


@dataclass(frozen=True)
class Page:
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
    tables: Sequence[Table]
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


def rendered(page: Page) -> str:
    """The page as HTML. Whatever comes from files is escaped by the template."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(_text("page.html")).render(
        page=page, style=_text("style.css"), script=_text("page.js"), plotly=get_plotlyjs()
    )


def _text(name: str) -> str:
    return files("energymargin.report").joinpath(name).read_text(encoding="utf-8")
