"""The results in a folder of pages, from the files of the studies."""

from __future__ import annotations

import re
import shutil
from datetime import datetime
from importlib.metadata import version
from pathlib import Path

__all__ = ["BEGIN", "END", "check_pages", "put_into"]

BEGIN, END = "<!-- results: energymargin reproduce all -->", "<!-- end of the results -->"


def check_pages(pages: Path) -> None:
    """Raises ValueError on a folder without a page that has the two lines, or a page with one."""
    if not _with_results(pages):
        raise ValueError(f"{pages} has no page with the lines {BEGIN!r} and {END!r}")


def put_into(pages: Path, folder: Path) -> list[Path]:
    """Replaces what stands between BEGIN and END in each page whose study is in the folder.

    A page belongs to the study of its name: `figure_quality.md` to `figure-quality`. The study's
    own page goes between the lines, and its pictures beside the page. Returns the pages that were
    written; raises ValueError if there are none, or as `check_pages`.
    """
    check_pages(pages)
    made = []
    for page in _with_results(pages):
        study = folder / page.stem.replace("_", "-")
        if (own := study / page.name).exists():
            pictures = sorted(study.glob("*.png"))
            before, after = _halves(page)
            page.write_text(f"{before}{BEGIN}\n\n{_section(own, pictures)}\n{END}{after}")
            for picture in pictures:
                shutil.copyfile(picture, pages / picture.name)
            made.append(page)
    if not made:
        raise ValueError(f"{folder} has no study of the pages in {pages}")
    return made


def _with_results(pages: Path) -> list[Path]:
    return [page for page in sorted(pages.glob("*.md")) if _halves(page) != ("", "")]


def _halves(page: Path) -> tuple[str, str]:
    """What stands before and after the results; empty both, of a page without any."""
    text = page.read_text()
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if bool(begin) != bool(end):
        raise ValueError(f"{page} has one of the lines {BEGIN!r} and {END!r}, expected both")
    return (before, after) if begin else ("", "")


def _section(own: Path, pictures: list[Path]) -> str:
    """A study's own page without its title, below what made it, and its pictures."""
    study = own.parent.name
    day = datetime.fromtimestamp(own.stat().st_mtime)
    made = f"Version {version('energymargin')}, {day.day} {day:%B %Y}; `energymargin reproduce"
    text = re.sub(r"\A# .*\n+", "", own.read_text()).rstrip()
    shown = [f"![{study}]({picture.name})\n" for picture in pictures]
    return "\n".join([f"{made} {study}`.", "", text, "", *shown])
