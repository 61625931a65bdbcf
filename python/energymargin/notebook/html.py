"""Small tables in HTML, beside a picture if matplotlib is there; all text is escaped."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterable, Sequence
from html import escape
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["MOST_ROWS", "NamedValue", "beside", "drawn", "grid", "table"]

NamedValue = tuple[str, object]
MOST_ROWS = 12  # of a long table
CELL = "text-align:left;padding:0.1em 1em 0.1em 0"

RESOLUTION = 80  # dots an inch


def table(title: str, rows: Iterable[NamedValue], note: str = "") -> str:
    """Names and values, a line each, and a note below."""
    lines = "".join(
        f'<tr><th style="{CELL};font-weight:normal">{escape(name)}</th>'
        f'<td style="{CELL}">{escape(str(value))}</td></tr>'
        for name, value in rows
    )
    return f"<div><b>{escape(title)}</b><table>{lines}</table>{_small(note)}</div>"


def grid(
    title: str,
    head: Sequence[str],
    rows: Sequence[Sequence[object]],
    note: str = "",
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
    rest = _small(f"and {more} more") if more > 0 else ""
    body = f"<table><tr>{top}</tr>{lines}</table>{rest}{_small(note)}"
    return f"<div><b>{escape(title)}</b>{body}</div>"


def _small(text: str) -> str:
    """A line of small text; nothing for no text."""
    return f"<small>{escape(text)}</small><br>" if text else ""


def drawn(draw: Callable[[Axes], None], size: tuple[float, float]) -> bytes | None:
    """What `draw` puts on an Axes of so many inches, as a PNG; None without matplotlib, or if it
    cannot be drawn."""
    if find_spec("matplotlib") is None:
        return None
    try:
        from matplotlib.figure import Figure

        figure = Figure(figsize=size, dpi=RESOLUTION, layout="constrained")
        draw(figure.subplots())
        image = io.BytesIO()
        figure.savefig(image, format="png")
    except Exception:  # the table says it all: a picture must not be in its way
        return None
    return image.getvalue()


def beside(table: str, image: bytes | None, shows: str, note: str = "") -> str:
    """A table with a PNG to its right, if there is one, and a note below that."""
    if image is None:
        return table
    source = f"data:image/png;base64,{base64.b64encode(image).decode()}"
    picture = f'<div><img alt="{shows}" src="{source}"><br>{_small(note)}</div>'
    return f'<div style="display:flex;flex-wrap:wrap;gap:1em">{table}{picture}</div>'
