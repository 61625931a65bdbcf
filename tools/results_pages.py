"""Puts the results of studies into a folder of pages, such as this project's docs/results.

.venv/bin/energymargin reproduce all
.venv/bin/python tools/results_pages.py out/all docs/results
"""

from __future__ import annotations

import re
import shutil
import sys
from datetime import datetime
from importlib.metadata import version
from pathlib import Path

__all__ = ["BEGIN", "END", "put_into"]

BEGIN, END = "<!-- results: energymargin reproduce all -->", "<!-- end of the results -->"


def put_into(pages: Path, folder: Path) -> list[Path]:
    """Replaces what stands between BEGIN and END in each page whose study is in the folder.

    A page belongs to the study of its name: `closed_forms.md` to `closed-forms`. The study's
    own page goes between the lines, and its pictures beside the page. Returns the pages that were
    written; raises ValueError if there are none, and on a page with one of the lines alone.
    """
    around = {page: halves for page in sorted(pages.glob("*.md")) if (halves := _halves(page))}
    if not around:
        raise ValueError(f"{pages} has no page with the lines {BEGIN!r} and {END!r}")
    made = []
    for page, (before, after) in around.items():
        study = folder / page.stem.replace("_", "-")
        if (own := study / page.name).exists():
            pictures = sorted(study.glob("*.png"))
            page.write_text(f"{before}{BEGIN}\n\n{_section(own, pictures)}\n{END}{after}")
            for picture in pictures:
                shutil.copyfile(picture, pages / picture.name)
            made.append(page)
    if not made:
        raise ValueError(f"{folder} has no study of the pages in {pages}")
    return made


def _halves(page: Path) -> tuple[str, str] | None:
    """What stands before and after the results; None of a page without any."""
    text = page.read_text()
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if bool(begin) != bool(end):
        raise ValueError(f"{page} has one of the lines {BEGIN!r} and {END!r}, expected both")
    return (before, after) if begin else None


def _section(own: Path, pictures: list[Path]) -> str:
    """A study's own page without its title, below what made it, and its pictures."""
    study = own.parent.name
    day = datetime.fromtimestamp(own.stat().st_mtime)
    made = f"Version {version('energymargin')}, {day.day} {day:%B %Y}; `energymargin reproduce"
    text = re.sub(r"\A# .*\n+", "", own.read_text()).rstrip()
    shown = [f"![{study}]({picture.name})\n" for picture in pictures]
    return "\n".join([f"{made} {study}`.", "", text, "", *shown])


def main() -> None:
    """Reads the two folders from the command line."""
    if len(sys.argv) != 3:
        raise SystemExit("usage: results_pages.py STUDIES PAGES, such as out/all docs/results")
    try:
        made = put_into(Path(sys.argv[2]), Path(sys.argv[1]))
    except (OSError, ValueError) as error:
        raise SystemExit(f"error: {error}") from error
    print(f"Made anew: {', '.join(map(str, made))}")


if __name__ == "__main__":
    main()
