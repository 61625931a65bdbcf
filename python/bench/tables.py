"""Tables of what was measured, in Markdown, and what it ran on; the blocks of pages with them."""

from __future__ import annotations

import platform
import re
import shlex
import shutil
import sys
from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from importlib.metadata import version
from pathlib import Path

from energymargin.base.table_text import markdown_table
from energymargin_paper.evidence.grasps_data import FOLDER
from energymargin_paper.pages import Head, list_blocks, write_block

__all__ = ["machine", "markdown", "write"]


def machine(*packages: str) -> str:
    """What it ran on, with the versions of these packages beside energymargin's."""
    models = [
        line.split(":")[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    versions = [f"{name} {version(name)}" for name in ("energymargin", *packages)]
    return f"{len(models)} x {models[0]}, Python {platform.python_version()}, {', '.join(versions)}"


def write(out: Path | None, text: str, target: str, pages: Path | None, *pictures: Path) -> None:
    """Writes what `make TARGET` measured: into a file, and into the block of that name of a page.

    A run of some parts (BENCH='--parts error') has a block of its own: bench-error.
    """
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(text)
    if pages is None:
        return
    words = [w for w in _options() if not w.startswith("--quick")]
    parts = words[words.index("--parts") + 1].split(",") if "--parts" in words else []
    given = f" BENCH={shlex.quote(shlex.join(words))}" if words else ""
    compared = ("mujoco", "pybullet", "dask")
    folders = [FOLDER] if "error" in parts else []
    head = Head.of_today(
        f"make {target}{given}", improved=False, packages=compared, folders=folders
    )
    head = replace(head, date=date.today().isoformat())
    shown = [f"![{picture.stem}]({picture.name})" for picture in pictures]
    body = "\n\n".join([re.sub(r"\A# .*\n+", "", text).strip(), *shown])
    name = "-".join([target, *parts])
    for page in sorted(pages.rglob("*.md")):
        if write_block(page, name, head, body):
            for picture in pictures:
                shutil.copyfile(picture, page.parent / picture.name)
    list_blocks(pages)


def _options() -> list[str]:
    """Those of the command line, but for where it writes."""
    words, kept = list(sys.argv[1:]), list[str]()
    while words:
        word = words.pop(0)
        if word in ("--out", "--pages"):
            words.pop(0)
        else:
            kept.append(word)
    return kept


def markdown(headers: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in which all columns but the first are numbers."""
    align = ["left", *["right"] * (len(headers) - 1)]
    return f"{markdown_table(headers, rows, align)}\n"
