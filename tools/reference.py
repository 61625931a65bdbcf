"""The reference, in pages that can be read in a checkout: `python tools/reference.py` writes what
stands in them between `<!-- reference: ... -->` and `<!-- end of reference -->`.

A mark asks for `commands`, `headers FOLDER`, `problem-schema`, names of a module, as
`energymargin: rank, improve`, or a whole module but for some names, as `energymargin.actions but
rank, improve`. tests/python/house/test_reference.py holds the pages to be current.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import reference_headers
import reference_python
import reference_schema

DOCS = Path(__file__).parent.parent / "docs"
END = "<!-- end of reference -->"
BLOCK = re.compile(rf"<!-- reference: ([^>]*?) -->\n.*?{END}", re.DOTALL)


def pages() -> Iterator[Path]:
    """Those with marks."""
    return (page for page in sorted(DOCS.rglob("*.md")) if BLOCK.search(page.read_text()))


def current(page: Path) -> str:
    """A page with its blocks made anew."""
    text = page.read_text()

    def made(found: re.Match[str]) -> str:
        above = BLOCK.sub("", text[: found.start()])  # without the headings of other blocks
        level = 1 + len(re.findall(r"^#+", above, re.MULTILINE)[-1])
        return f"<!-- reference: {found[1]} -->\n\n{block(found[1], level).strip()}\n\n{END}"

    return BLOCK.sub(made, text)


def block(asked: str, level: int) -> str:
    """What a mark asks for, under headings of this level."""
    if asked == "commands":
        return commands()
    if asked == "problem-schema":
        return reference_schema.page()
    if asked.startswith("headers "):
        return "\n".join(map(reference_headers.section, reference_headers.headers(asked[8:])))
    module, colon, names = asked.partition(": ")
    if colon:
        return reference_python.of_names(module, names.split(", "), level)
    module, _, left_out = asked.partition(" but ")
    return reference_python.of_module(module, left_out.split(", "), level)


def commands() -> str:
    """All commands with their options, a heading a command."""
    from energymargin.cli import app

    _, *parts = re.split(r"(?m)^(?=##+ )", app.generate_docs())
    text = "".join(part for part in parts if part.split(maxsplit=2)[1] == "energymargin")
    text = re.sub(r"(?m)^(#+) energymargin ", r"\1 ", text)
    text = re.sub(r"(?m)^(energymargin .*) -m \S+ \[OPTIONS", r"\1 [OPTIONS", text)  # who runs this
    return re.sub(r"\[(`[^`]+`)\]\(#[^)]*\)", r"\1", text)  # the lists of a group's commands


if __name__ == "__main__":
    for page in pages():
        page.write_text(current(page))
