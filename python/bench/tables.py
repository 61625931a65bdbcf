"""Tables of what was measured, in Markdown, and what it ran on."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from energymargin.table_text import markdown_table

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
    align = ["left", *["right"] * (len(headers) - 1)]
    return f"{markdown_table(headers, rows, align)}\n"
