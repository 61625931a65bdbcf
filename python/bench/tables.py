"""Tables of what was measured, in Markdown, and what it ran on."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

__all__ = ["machine", "markdown"]


def machine(*packages: str) -> str:
    """What it ran on, with the versions of these packages beside energymargin's."""
    models = [
        line.split(":")[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    versions = [f"{name} {version(name)}" for name in ("energymargin", *packages)]
    return f"{len(models)} x {models[0]}, Python {platform.python_version()}, {', '.join(versions)}"


def markdown(headers: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in which all columns but the first are numbers."""
    widths = [max(map(len, column)) for column in zip(headers, *rows, strict=True)]
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    lines = [
        [cell.rjust(width) if i else cell.ljust(width) for i, (cell, width) in enumerate(row)]
        for row in (list(zip(cells, widths, strict=True)) for cells in (headers, rule, *rows))
    ]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
