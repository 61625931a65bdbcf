"""Tables as text, in CSV and Markdown, numbers from 0 to 1 in their cells, and notes below."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from typing import Any

DASH = "—"  # a cell without a value
RULES = {"left": "---", "right": "---:"}


def csv_text(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A line for the header and for each row; numbers are in full precision."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


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


def short(value: float, decimals: int = 3) -> str:
    """Rounded, without the leading zero: .981; what rounds to one is 1.00."""
    rounded = f"{value:.{decimals}f}"
    return "1.00" if rounded[0] == "1" else rounded[1:]


def counted(number: int, thing: str) -> str:
    """How many things, as "1 node" or "2,000 nodes"."""
    return f"{number:,} {thing}{'s' * (number != 1)}"


def sentence(text: str) -> str:
    """A note as a sentence: with a capital, and an end."""
    return f"{text[0].upper()}{text[1:]}{'' if text.endswith('?') else '.'}"


def _cell(text: str) -> str:
    return text.replace("|", r"\|").replace("\n", "<br>")
