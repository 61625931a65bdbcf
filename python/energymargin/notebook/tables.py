"""Small tables in HTML; all text is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

__all__ = ["MOST_ROWS", "Row", "grid", "note", "table"]

Row = tuple[str, object]
MOST_ROWS = 12  # of a long table
CELL = "text-align:left;padding:0.1em 1em 0.1em 0"


def table(title: str, rows: Iterable[Row], said: str = "") -> str:
    """Names and values, a line each, and what is said below."""
    lines = "".join(
        f'<tr><th style="{CELL};font-weight:normal">{escape(name)}</th>'
        f'<td style="{CELL}">{escape(str(value))}</td></tr>'
        for name, value in rows
    )
    return f"<div><b>{escape(title)}</b><table>{lines}</table>{note(said)}</div>"


def grid(
    title: str,
    head: Sequence[str],
    rows: Sequence[Sequence[object]],
    said: str = "",
    total: int | None = None,
) -> str:
    """A table with a head; of a long one the first rows, and how many of `total` are not shown."""
    shown = rows[:MOST_ROWS]
    more = (len(rows) if total is None else total) - len(shown)
    top = "".join(f'<th style="{CELL}">{escape(name)}</th>' for name in head)
    lines = "".join(
        "<tr>"
        + "".join(f'<td style="{CELL};white-space:pre">{escape(str(cell))}</td>' for cell in row)
        + "</tr>"
        for row in shown
    )
    rest = note(f"and {more} more") if more > 0 else ""
    body = f"<table><tr>{top}</tr>{lines}</table>{rest}{note(said)}"
    return f"<div><b>{escape(title)}</b>{body}</div>"


def note(text: str) -> str:
    """A line of small text; nothing for no text."""
    return f"<small>{escape(text)}</small><br>" if text else ""
