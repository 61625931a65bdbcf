"""The command `energymargin tasks`."""

from __future__ import annotations

import json

from rich.markup import escape
from rich.table import Table
from rich.text import Text

import energymargin as em
from energymargin.cli.terminal import out


def tasks() -> None:
    """List the tasks with their parameters.

    Example: `energymargin tasks`
    """
    table = Table(box=None, padding=(0, 2, 0, 0))
    for title in ("task", "what it is", "parameters"):
        table.add_column(title, overflow="fold")
    for entry in em.tasks.overview():
        note = Text(entry.note, "red" if entry.broken else "dim")
        what = Text("\n").join(text for text in (Text(entry.summary), note) if text)
        parameters = (f"{name}={json.dumps(value)}" for name, value in entry.parameters.items())
        table.add_row(entry.name, what, escape(", ".join(parameters)))
    out.print(table)
