"""A table of text for people: on the terminal and in Markdown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import RenderableType

__all__ = ["Sheet"]


@dataclass(frozen=True)
class Sheet:
    """A title, a table and what there is to say about it."""

    title: str
    header: list[str]
    """Of every column but the first, which names the rows."""
    rows: list[list[str]]
    """A cell has lines: the first is what counts, the others say more about it."""
    notes: list[str]

    def render(self) -> RenderableType:
        """For the terminal."""
        from rich.console import Group
        from rich.table import Table
        from rich.text import Text

        table = Table(box=None, padding=(0, 1, 1, 0), pad_edge=False)
        table.add_column("")
        for name in self.header:
            table.add_column(name, justify="center", no_wrap=True)
        for row in self.rows:
            lines = [cell.partition("\n") for cell in row]
            table.add_row(
                *(
                    Text.assemble((first, "bold"), (newline + more, "dim"))
                    for first, newline, more in lines
                )
            )
        notes = [Text(f"  {note}", "dim") for note in self.notes]
        return Group(Text(self.title, "bold cyan"), Text(), table, *notes, Text())

    def to_markdown(self) -> str:
        """A section of a Markdown file."""
        lines = [["", *self.header], ["---"] * (1 + len(self.header)), *self.rows]
        table = [f"| {' | '.join(line).replace(chr(10), '<br>')} |" for line in lines]
        notes = [f"- {note}" for note in self.notes]
        return "\n".join([f"## {self.title}", "", *table, "", *notes, *([""] if notes else [])])
