"""Summaries of results: rows, rendered for a terminal, for a notebook (HTML) and as Markdown.

The rows of each class are in `summaries`, which is imported once one is asked for.
"""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import energymargin._core as compiled
from energymargin._core import Problem
from energymargin.base.calls import explained
from energymargin.base.checks import shown
from energymargin.base.table_text import markdown_table

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

    import energymargin.model.scenes.reports

__all__ = ["MOST_ROWS", "Picture", "Summarized", "Summary", "attach", "html_or_text", "summary"]

MOST_ROWS = 12  # of a long table in a notebook
LONG_CELL, MOST_BROKEN = 16, 8  # characters: a cell of a terminal's table that is broken, to what
CELL = "text-align:left;padding:0.1em 1em 0.1em 0;white-space:pre-wrap"
SIZE = (4.5, 3.2)  # inch, of a picture
RESOLUTION = 80  # dots an inch
UNFINISHED = "Not complete: it was stopped before its end."
COMPILED = (
    *("CaptureProbability", "CaptureScore", "EscapeEffort", "EscapeEnergy", "ForceScore"),
    *("Tree", "Plan", "Problem", "Scene"),
)


class Picture(NamedTuple):
    """A figure of `energymargin.plots` beside a table."""

    plot: str
    """The name of a function there that draws on `ax`."""
    thing: object
    """Its argument."""
    shows: str
    """What it shows, below it and for who cannot see it."""
    options: Mapping[str, Any] = {}


@dataclass(frozen=True, eq=False)
class Summary:
    """What a result says, as a table."""

    title: str
    rows: Sequence[Sequence[object]] = ()
    """Lines: a label and its value or, below a head, a cell for each column. Of a cell with several
    lines the first one counts most."""
    head: Sequence[str] = ()
    notes: Sequence[str] = ()
    """Sentences below the table."""
    lead: str = ""
    """A sentence above it."""
    total: int | None = None
    """How many rows there are, if these are only the first."""
    picture: Picture | None = None
    further: Summary | None = field(default=None, repr=False)
    """Another table below."""

    def to_markdown(self) -> str:
        """Title, table and notes."""
        head = self.head or ("", "")
        rows = [[str(cell) for cell in row] for row in self.rows]
        parts = [
            self.lead,
            f"**{self.title}**" if self.title else "",
            markdown_table(head, rows) if rows else "",
            *self._notes_below(len(rows)),
            "" if self.further is None else self.further.to_markdown().rstrip("\n"),
        ]
        return "\n\n".join(filter(None, parts)) + "\n"

    def _notes_below(self, shown: int) -> list[str]:
        """The notes, with the number of rows that are not shown."""
        more = (len(self.rows) if self.total is None else self.total) - shown
        return [f"and {more} more"] * (more > 0) + [*self.notes]

    def to_html(self) -> str:
        """The table beside its picture; of a long one the first rows."""
        shown = self.rows[:MOST_ROWS] if self.head else self.rows
        lines = [_html_row(self.head, "th")] if self.head else []
        lines += [_html_row(row, "td") for row in shown]
        parts = [
            f"<b>{escape(self.title)}</b>" if self.title else "",
            _small(self.lead),
            f"<table>{''.join(lines)}</table>",
            *map(_small, self._notes_below(len(shown))),
        ]
        table = f"<div>{''.join(parts)}</div>"
        image = None if self.picture is None else _drawn(self.picture)
        if self.picture is not None and image is not None:
            shows = self.picture.shows
            drawn = f'<div><img alt="{shows}" src="{image}"><br>{_small(shows)}</div>'
            table = f'<div style="display:flex;flex-wrap:wrap;gap:1em">{table}{drawn}</div>'
        return table + ("" if self.further is None else self.further.to_html())

    def __rich__(self) -> RenderableType:
        """A table for the terminal, 80 columns wide."""
        from rich.console import Group
        from rich.table import Table
        from rich.text import Text

        parts: list[RenderableType] = [Text(self.lead, "dim"), Text()] if self.lead else []
        headed = bool(self.head)
        below = int(headed and any("\n" in str(cell) for row in self.rows for cell in row))  # lines
        table = Table(box=None, padding=(0, 1, below, 0), pad_edge=False, show_header=headed)
        for k, column in enumerate(self.head or ("", "")):
            lines = (str(row[k]).splitlines() for row in self.rows if k < len(row))
            longest = max((len(line) for cell in lines for line in cell), default=0)
            table.add_column(
                column,
                justify="center" if headed and k else "left",
                no_wrap=headed and longest < LONG_CELL,  # numbers and intervals stay whole
                min_width=MOST_BROKEN if headed and longest >= LONG_CELL else None,
                overflow="fold",
            )
        for label, *cells in self.rows:
            table.add_row(str(label), *(_first_line_bold(str(cell)) for cell in cells))
        parts += [Text(self.title, "bold cyan"), Text(), table] if self.title else [table]
        parts += map(Text, self._notes_below(len(self.rows)))
        parts += [] if self.further is None else [Text(), self.further]
        return Group(*parts)

    __str__ = to_markdown


def summary(result: Any) -> Summary:
    """What a result of this package says: scores, problems, scenes, plans, datasets, rankings; and
    whether it was stopped before its end.

    Raises ValueError on what has none.
    """
    summaries = import_module("energymargin.look.summaries").SUMMARIES
    kinds = [kind.__name__ for kind in type(result).__mro__[:-1]]  # a Policy is a Plan
    names = [re.sub(r"(?<!^)(?=[A-Z])", "_", kind).lower() for kind in kinds]
    made = next((summaries[name] for name in names if name in summaries), None)
    if made is None:
        raise ValueError(f"result is a {type(result).__name__}, which has no summary")
    found: Summary = made(result)
    whole = getattr(result, "complete", True) or not found.rows  # without rows it says so itself
    return found if whole else replace(found, notes=[*found.notes, UNFINISHED])


def html_or_text(self: Any) -> str:
    """The method `_repr_html_` of a class that has a summary; text if that cannot be made, for no
    cell of a notebook fails for its picture."""
    try:
        return summary(self).to_html()
    except Exception as error:  # a damaged thing is shown as far as it can be
        return f"<pre>{escape(shown(self))}\ncannot be shown: {escape(repr(error))}</pre>"


class Summarized:
    """Base of dataclasses that have a summary, which notebooks show; their repr is short."""

    _repr_html_ = html_or_text

    def __repr__(self) -> str:
        """Its fields: a large array by its shape, a long list by its length."""
        from energymargin.base.reprs import short_repr

        return short_repr(self) if is_dataclass(self) else object.__repr__(self)

    def to_markdown(self) -> str:
        """Its summary in Markdown."""
        return summary(self).to_markdown()


def attach() -> None:
    """Gives the classes of the compiled module what is written in Python: how notebooks and prompts
    show them, what they say of wrong calls, and ways to make them."""
    for name in COMPILED:
        setattr(getattr(compiled, name), "_repr_html_", html_or_text)  # noqa: B010
    setattr(compiled.Scene, "report", property(_report))  # noqa: B010
    setattr(compiled.Problem, "from_mujoco", staticmethod(_from_mujoco))  # noqa: B010
    for kind in vars(compiled).values():
        members = vars(kind) if isinstance(kind, type) else {}
        if "__repr__" not in members and any(isinstance(m, property) for m in members.values()):
            setattr(kind, "__repr__", _text)  # noqa: B010
        for name in members:
            if name == "__init__" or not name.startswith("_"):
                _explain(kind, name)


def _explain(kind: type, name: str) -> None:
    """Lets a compiled method say what a call lacks, and `help` show what a constructor takes."""
    method = getattr(kind, name)
    if not callable(method) or not (method.__doc__ or "").startswith(f"{name}("):
        return  # it takes no arguments
    is_made = name == "__init__"
    call = explained(method, kind.__name__ if is_made else name)
    if is_made and "\n\n" not in (method.__doc__ or "").strip():
        call.__doc__ = f"{method.__doc__}\n{kind.__doc__}"
    setattr(kind, name, staticmethod(call) if isinstance(vars(kind)[name], staticmethod) else call)


def _report(self: Any) -> energymargin.model.scenes.reports.SceneReport:
    """What the readers of files left out of this scene, left loose, or stated; a table."""
    from energymargin.model.scenes.reports import report_of

    return report_of(self)


def _from_mujoco(model: Any, data: Any = None, **question: Any) -> Problem:
    """The question of a `mujoco.MjModel` from its `mujoco.MjData` on, in MuJoCo itself:
    `em.mujoco.problem(model, data, objects=..., captured=..., force=..., horizon=...)`."""
    made: Problem = import_module("energymargin.mujoco").problem(model, data, **question)
    return made


def _text(self: Any) -> str:
    """Name(property=value, ...)"""
    from energymargin.base.reprs import compiled_repr

    return compiled_repr(self)


def _html_row(cells: Sequence[object], tag: str) -> str:
    texts = (f'<{tag} style="{CELL}">{escape(str(cell))}</{tag}>' for cell in cells)
    return f"<tr>{''.join(texts)}</tr>"


def _small(text: str) -> str:
    """A line of small text; nothing for no text."""
    return f"<small>{escape(text)}</small><br>" if text else ""


def _drawn(picture: Picture) -> str | None:
    """A PNG as a data URI; None without matplotlib, or if it cannot be drawn."""
    try:
        from matplotlib.figure import Figure

        figure = Figure(figsize=SIZE, dpi=RESOLUTION, layout="constrained")
        plot = getattr(import_module("energymargin.plots"), picture.plot)
        plot(picture.thing, ax=figure.subplots(), **picture.options)
        image = io.BytesIO()
        figure.savefig(image, format="png")
    except Exception:  # the table says it all: a picture must not be in its way
        return None
    return f"data:image/png;base64,{base64.b64encode(image.getvalue()).decode()}"


def _first_line_bold(cell: str) -> Text:
    """A cell for the terminal."""
    from rich.text import Text

    value, *more = cell.split("\n")
    return Text.assemble((value, "bold"), *((f"\n{line}", "dim") for line in more))
