"""The command `energymargin reproduce`: one command a study, and one for all, with an index page.

A study's module is imported when its command is called, so that --help answers at once.
"""

from __future__ import annotations

import os
import re
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter
from rich.markup import escape

from energymargin.base.checks import core_count, positive_number
from energymargin.base.replacing import replace_text
from energymargin.base.table_text import DASH, markdown_table
from energymargin.cli.options import WHERE, split
from energymargin.cli.terminal import MARK, err, out, require_own_folder, say
from energymargin_paper import STUDIES
from energymargin_paper.commands import make, typed
from energymargin_paper.pages import Head, all_blocks, put
from energymargin_paper.pieces import PIECES, QUICK, Piece
from energymargin_paper.study import Study

__all__ = ["app", "everything"]

WHOLE = "whole"
STYLE = """
body { font: 16px/1.5 sans-serif; max-width: 70em; margin: 2em auto; padding: 0 1em; }
table { border-collapse: collapse; font-size: 14px; margin: 1em 0; }
td, th { border: 1px solid #ccc; padding: .2em .6em; vertical-align: top; }
img { max-width: 100%; }
"""


app = App(
    name="reproduce",
    help="""The paper's tables and figures, made again, and what its definitions say on paper.

    Example: `energymargin reproduce table1 --quick`
    """,
)


def everything(
    *,
    only: Annotated[str | None, Parameter(show_default="all whose data are there")] = None,
    minutes: float | None = None,
    threads: Annotated[int | None, Parameter(group=WHERE)] = None,
    data: Path | None = None,
    pages: Path | None = None,
    output: Annotated[
        Path | None,
        Parameter(alias="-o", show_default="out/all, or out/all-quick"),
    ] = None,
    list_them: Annotated[bool, Parameter(name="--list")] = False,
    quick: bool = False,
    overwrite: bool = False,
) -> None:
    """All pages of results in pieces, by their worth, into one folder with an index page.

    A piece is a study with the settings of its page. Each goes into a folder of its own, with its
    numbers and pictures; index.html and index.md are written again after each. Stop it with Ctrl-C
    or by --minutes, or kill it: the same command goes on from there, and leaves out what is whole.
    The table that it prints has the minutes that each piece takes of one processor, how long it
    took, its version and its age; *old* are those whose engine had other bits than this one.

    Example: `energymargin reproduce all --only table1,table2 --minutes 30`

    Args:
        only: Which pieces or studies, separated by commas.
        minutes: Stop after so many minutes; what is done is kept.
        data: Folder with published/ (the authors' data) and grasps/ (grasps of others).
        pages: Folder of pages, as docs, whose blocks of these pieces are written anew.
        output: Folder for all folders.
        list_them: Print that table, of --pages if given, and make nothing.
        quick: A first picture of every study, in some minutes.
        overwrite: Take a folder that has files of others too, and replace those of the same
            names.
        threads: Threads; all cores if not given. Numbers do not depend on it.
    """
    known = QUICK if quick else PIECES
    chosen = _chosen(known, only, data)
    core_count("threads", threads)
    folder = output or Path("out", "all-quick" if quick else "all")
    if minutes is not None:
        positive_number("minutes", minutes)
    if quick and pages is not None:
        raise ValueError(
            f"pages is {pages}, but --quick makes first pictures: leave one of them out"
        )
    if list_them:
        _print(_overview(known, _heads(folder, pages, known), quick=quick))
        return
    require_own_folder(folder, overwrite=overwrite)
    with _at_most(minutes) as (over, start):
        start()
        for number, piece in enumerate(chosen, 1):
            err.print(f"[bold]{piece.name}[/] ({number} of {len(chosen)}): {piece.shows}")
            study, own = piece.load(), folder / piece.name
            settings = study.quick if quick else piece.settings(data)
            if _state(Head.of_folder(own), study, typed(study, settings)) == WHOLE:
                say("It is there.")
            else:
                make(study, settings, own, threads, overwrite=overwrite)
            write_index(folder, known, quick=quick)
            for page in put(pages, piece.name, own) if pages is not None else ():
                say(f"Written: {escape(str(page))}")
    _print(_overview(known, _heads(folder, pages, known), quick=quick))
    if over.is_set():
        say("The time is over: the same command goes on from here.")
    else:
        say(f"In {escape(str(folder))}/: index.html, index.md, and a folder for each piece")


for _number, (_name, _line) in enumerate(STUDIES.items()):
    app.command(f"energymargin_paper.commands:{_name}", name=_name, help=_line, sort_key=_number)
app.command(everything, name="all", sort_key=len(STUDIES))


def _print(table: str) -> None:
    out.print(table, markup=False, highlight=False, soft_wrap=True)


def _chosen(known: Sequence[Piece], only: str | None, data: Path | None) -> list[Piece]:
    """The pieces that `only` names by their own names, or by a study that no piece is called."""
    if only is None:
        return [piece for piece in known if data is not None or not piece.data]
    words, names = set(split(only)), [piece.name for piece in known]
    of_studies = words - set(names)
    chosen = [piece for piece in known if piece.name in words or piece.study in of_studies]
    wrong = of_studies - {piece.study for piece in chosen}
    if wrong:
        raise ValueError(f"only has {min(wrong)!r}, expected some of {', '.join(names)}")
    lacking = [piece for piece in chosen if piece.data and data is None]
    if lacking:
        raise ValueError(
            f"only has {lacking[0].name!r}, which needs --data DIR with a folder "
            f"{lacking[0].data!r} in it"
        )
    return chosen


@contextmanager
def _at_most(minutes: float | None) -> Iterator[tuple[threading.Event, Callable[[], None]]]:
    """Ctrl-C so many minutes after a start, which ends the block; the event says that it was not
    the user's. The start is within the block: before it nothing would catch a Ctrl-C."""
    over = threading.Event()

    def stop() -> None:
        over.set()
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(60.0 * (minutes or 0.0), stop)
    try:
        yield over, timer.start if minutes is not None else lambda: None
    except KeyboardInterrupt:
        if not over.is_set():
            raise
    finally:
        timer.cancel()


def _state(head: Head | None, study: Study[Any, Any], words: str) -> str:
    """What there is of a piece that this command makes."""
    if head is None:
        return "not yet"
    if head.is_old(improved=study.improved):
        return "old"
    return WHOLE if head.date and head.command == words else "begun"


def _overview(pieces: Sequence[Piece], heads: Mapping[str, Head], *, quick: bool = False) -> str:
    """A table of all pieces: the minutes that each takes, and what there is of it."""
    rows = []
    for piece in pieces:
        head, study = heads.get(piece.name), piece.load()
        words = typed(study, study.quick if quick else piece.settings())
        made = (head.minutes or DASH, head.version, _age(head)) if head else (DASH,) * 3
        rows.append((piece.name, f"{piece.minutes:g}", *made, _state(head, study, words)))
    left = sum(p.minutes for p, row in zip(pieces, rows, strict=True) if row[-1] != WHOLE)
    rows.append(("**left**", f"{left:.4g}", "", "", "", ""))
    return markdown_table(("piece", "minutes", "took", "version", "age", ""), rows)


def _age(head: Head) -> str:
    if not head.date:
        return DASH
    return f"{(date.today() - date.fromisoformat(head.date)).days} days"


def _heads(folder: Path, pages: Path | None, pieces: Sequence[Piece]) -> dict[str, Head]:
    """By piece: of the pages if there are any, or else of the folder."""
    if pages is not None:
        return {block.name: block.head for _, block in all_blocks(pages)}
    found = {piece.name: Head.of_folder(folder / piece.name) for piece in pieces}
    return {name: head for name, head in found.items() if head is not None}


def write_index(folder: Path, pieces: Sequence[Piece], *, quick: bool) -> None:
    """Writes index.md and index.html in a folder that has one folder a piece."""
    table = _overview(pieces, _heads(folder, None, pieces), quick=quick)
    lines = ["# The studies of Energy Margin", "", table]
    for piece in pieces:
        if any((folder / piece.name).glob("*.md")):
            lines += ["", f'<a id="{piece.name}"></a>', "", *_section(folder, piece.name)]
    text = "\n".join(lines) + "\n"
    replace_text(folder / "index.md", text)
    replace_text(folder / "index.html", _page(text))


def _section(folder: Path, name: str) -> list[str]:
    """A study's own text, one level lower, its pictures and its files."""
    own = folder / name
    lines = []
    for text in sorted(own.glob("*.md")):
        lines += [re.sub(r"(?m)^#", "##", text.read_text().rstrip()), ""]
    for picture in sorted(own.glob("*.png")):
        lines += [f"![{picture.stem}]({name}/{picture.name})", ""]
    files = sorted(path.name for path in own.iterdir() if path.is_file() and path.name != MARK)
    links = ", ".join(f"[{file}]({name}/{file})" for file in files)
    head = Head.of_folder(own)
    made = head.sentence() if head and head.date else "It is not whole yet."
    return [*lines, f"Files: {links}. {made}"]


def _page(text: str) -> str:
    from markdown_it import MarkdownIt

    body = MarkdownIt("commonmark", {"html": True}).enable("table").render(text)
    head = f'<meta charset="utf-8"><title>Energy Margin</title><style>{STYLE}</style>'
    return f"<!doctype html><html><head>{head}</head><body>{body}</body></html>\n"
