"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

__all__ = ["markdown_table"]

RULES = {"left": "---", "right": "---:"}


def markdown_table(
    header: Sequence[str], rows: Iterable[Sequence[str]], align: Sequence[str] | None = None
) -> str:
    """A table, without a newline at its end; a cell may have several lines.

    `align` is "left" or "right" for each column, None is "left" for all. Raises ValueError on a row
    that has not as many cells as the header.
    """
    rules = [RULES[side] for side in align or ["left"] * len(header)]
    lines = [header, rules, *rows]
    for line in lines:
        if len(line) != len(header):
            raise ValueError(f"a row has {len(line)} cells, expected {len(header)}: {list(line)}")
    return "\n".join(f"| {' | '.join(map(_cell, line))} |" for line in lines)


def _cell(text: str) -> str:
    return text.replace("|", r"\|").replace("\n", "<br>")
