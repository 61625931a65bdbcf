"""Pages of results: each block of a page is written by the command in its head, the rest by hand.

    <!-- made: guard
    command: energymargin reproduce guard
    version: 1.0.0
    ...
    -->
    tables and pictures
    <!-- end: guard -->

A study writes its head into its folder too (made.txt), before anything is computed.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from textwrap import wrap
from typing import NamedTuple

from energymargin.base.replacing import replace_text
from energymargin.base.table_text import markdown_table
from energymargin.evaluate.searches import ALGORITHM, ALGORITHM_IMPROVED
from energymargin_paper.bits import bits, engine_bits

__all__ = [
    "FILE",
    "Block",
    "Head",
    "all_blocks",
    "blocks",
    "list_blocks",
    "put",
    "table_of_blocks",
    "write_block",
]

FILE = "made.txt"
WIDTH = 120
BLOCK = re.compile(
    r"<!-- made: (?P<name>\S+)\n(?P<head>.*?)\n-->\n(?P<body>.*?)<!-- end: (?P=name) -->", re.DOTALL
)
TABLE = re.compile(r"(?<=<!-- all blocks -->\n).*?(?=<!-- end of all blocks -->)", re.DOTALL)


@dataclass(frozen=True)
class Head:
    """What made a block; all in words, as they stand in a page."""

    command: str
    version: str
    """Of energymargin."""
    date: str = ""
    """As 2026-11-26; empty until it is whole."""
    algorithm: str = ""
    """Since which version of energymargin the same settings give the same bits."""
    bits: str = ""
    """As of `energymargin_paper.bits`; empty: of an older version."""
    engines: str = ""
    """Those of other engines in it, as of `energymargin_paper.bits.engine_bits`."""
    seed: str = ""
    data: str = ""
    """Variables of the environment that named folders of it."""
    minutes: str = ""
    """Of one processor."""
    machine: str = ""
    packages: str = ""

    @classmethod
    def of_today(
        cls,
        command: str,
        *,
        improved: bool,
        seed: object = "",
        packages: Sequence[str] = (),
        engines: Sequence[str] = (),
        folders: Sequence[str] = (),
    ) -> Head:
        """That of a command which begins now; of the packages those that are installed, and of the
        folders those that are set."""
        names = [name for name in ("numpy", "scipy", *packages) if _is_installed(name)]
        return cls(
            command,
            version("energymargin"),
            algorithm=ALGORITHM_IMPROVED if improved else ALGORITHM,
            bits=bits(improved=improved),
            engines=", ".join(f"{name} {engine_bits(name)}" for name in engines),
            seed=str(seed),
            data=", ".join(name for name in folders if os.environ.get(name)),
            machine=f"{os.cpu_count()} cores, {platform.machine()}",
            packages=", ".join(f"{name} {version(name)}" for name in names),
        )

    @classmethod
    def parse(cls, text: str) -> Head:
        """From lines as `version: 1.0.0`. Raises ValueError on others."""
        words = [line.partition(": ") for line in text.splitlines()]
        try:
            return cls(**{name: value for name, _, value in words})
        except TypeError as error:
            raise ValueError(f"{text!r} is no head of a block: {error}") from error

    @classmethod
    def of_folder(cls, folder: Path) -> Head | None:
        """That of a study's folder; None if it has none."""
        path = folder / FILE
        return cls.parse(path.read_text()) if path.exists() else None

    def lines(self) -> str:
        """What `parse` reads."""
        return "\n".join(f"{name}: {value}" for name, value in asdict(self).items() if value)

    @property
    def every_bit(self) -> str:
        """Of all engines."""
        return ", ".join(filter(None, (self.bits, self.engines)))

    def is_old(self, *, improved: bool) -> bool:
        """Whether an engine of today gives other bits."""
        return self.bits != bits(improved=improved) or self._others_moved()

    @property
    def build(self) -> str:
        """ "earlier" if no search of today's engines gives its bits."""
        return "earlier" if all(self.is_old(improved=one) for one in (False, True)) else ""

    def _others_moved(self) -> bool:
        """Whether an engine that is not ours gives other bits, of those that are there."""
        digits = dict(words.split() for words in self.engines.split(", ") if words)
        there = [name for name in digits if name == "bullet" or _is_installed(name)]
        return any(engine_bits(name) != digits[name] for name in there)

    def sentence(self) -> str:
        """For readers."""
        day = date.fromisoformat(self.date)
        more = [f"seed {self.seed}"] * bool(self.seed)
        more += [f"{self.minutes} minutes of one processor"] * bool(self.minutes)
        more += [f"data of {self.data}"] * bool(self.data)
        more += [word for word in (self.machine, self.packages) if word]
        made = f"`{self.command}`, version {self.version}, {day.day} {day:%B %Y}"
        return "; ".join([made, *more]) + "."


def _is_installed(name: str) -> bool:
    try:
        return bool(version(name))
    except PackageNotFoundError:
        return False


class Block(NamedTuple):
    """A part of a page."""

    name: str
    head: Head


def blocks(page: Path) -> list[Block]:
    """The blocks of a page. Raises ValueError on one without its end, or with a wrong head."""
    text = page.read_text()
    found = [Block(m["name"], Head.parse(m["head"])) for m in BLOCK.finditer(text)]
    if len(found) != text.count("<!-- made: ") or len(found) != text.count("<!-- end: "):
        raise ValueError(f"{page} has a block without its end, or an end without its block")
    return found


def put(pages: Path, name: str, folder: Path) -> list[Path]:
    """Writes a study's tables and pictures into the blocks of that name in all pages of a folder.

    Returns the pages that have one.
    """
    head = Head.of_folder(folder)
    if head is None or not head.date:
        raise ValueError(f"{folder} has no finished study")
    texts = "\n".join(re.sub(r"\A# .*\n+", "", own.read_text()) for own in folder.glob("*.md"))
    pictures = {_picture(name, path.name): path for path in sorted(folder.glob("*.png"))}
    shown = [f"![{_title(picture)}]({picture})" for picture in pictures]
    body = "\n\n".join([texts.strip(), *shown])
    written = [page for page in sorted(pages.rglob("*.md")) if write_block(page, name, head, body)]
    for page in written:
        for picture, path in pictures.items():
            shutil.copyfile(path, page.parent / picture)
    list_blocks(pages)
    return written


def write_block(page: Path, name: str, head: Head, body: str) -> bool:
    """Replaces the block of a page, whose headings go below that before it; False without one."""
    text = page.read_text()
    for match in BLOCK.finditer(text):
        if match["name"] == name:
            above = re.findall(r"(?m)^(#+) ", text[: match.start()])
            deeper = "#" * (len(above[-1]) - 1 if above else 0)
            own = "\n".join(map(_wrapped, re.sub(r"(?m)^(?=##)", deeper, body).splitlines()))
            begin, end = f"<!-- made: {name}\n{head.lines()}\n-->", f"<!-- end: {name} -->"
            block = f"{begin}\n{head.sentence()}\n\n{own}\n\n{end}"
            replace_text(page, text[: match.start()] + block + text[match.end() :])
            return True
    return False


def _picture(name: str, file: str) -> str:
    """That of a page, in which two pieces of one study have pictures of their own."""
    stem = name.replace("-", "_")
    return file if file.startswith(stem) else f"{stem}_{file}"


def _wrapped(line: str) -> str:
    """Words, but for the rows of a table and headings."""
    if line.startswith(("|", "#")):
        return line
    indent = "  " if line.startswith("- ") else ""
    lines = wrap(line, WIDTH, subsequent_indent=indent, break_on_hyphens=False)
    return "\n".join(lines)


def _title(picture: str) -> str:
    return Path(picture).stem.replace("_", " ")


def all_blocks(pages: Path) -> Iterator[tuple[Path, Block]]:
    """All blocks of a folder's pages."""
    for page in sorted(pages.rglob("*.md")):
        for block in blocks(page):
            yield page, block


def list_blocks(pages: Path) -> None:
    """Writes the table of all blocks into each page that has a place for it."""
    for page in sorted(pages.rglob("*.md")):
        text = page.read_text()
        if place := TABLE.search(text):
            table = table_of_blocks(pages, page.parent)
            replace_text(page, f"{text[: place.start()]}{table}\n{text[place.end() :]}")


def table_of_blocks(pages: Path, start: Path) -> str:
    """What made each block, and when; links are from the folder `start`."""
    rows = [
        (
            f"[{block.name}]({Path(os.path.relpath(page, start)).as_posix()})",
            *(block.head.version, block.head.build),
            *(block.head.date, block.head.minutes, f"`{block.head.command}`"),
        )
        for page, block in all_blocks(pages)
    ]
    header = ("block", "version", "build", "date", "minutes", "command")
    return markdown_table(header, rows)
