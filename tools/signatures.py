"""The public callables with their arguments, units and defaults: docs/api/signatures.md.

`python tools/signatures.py` writes the page; tests/python/house/test_signatures.py holds it to its
rules.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import energymargin as em

PAGE = Path(__file__).parent.parent / "docs" / "api" / "signatures.md"
HEAD = """# Signatures

Every public function with its arguments, their units and defaults; `tools/signatures.py` makes this
page. A `*` stands before arguments that are given by name. Classes are in the
[reference](python.md).

| function | arguments |
| --- | --- |
"""
UNIT = re.compile(r"\[((?:k?g|m|s|N|J|rad|Pa|1|Hz)\b[^\]]{0,12})\]")


def public() -> Iterator[tuple[str, Any]]:
    """Functions of the package and of its modules, by the names that users write."""
    for name in em.__all__:
        found = getattr(em, name)
        if inspect.ismodule(found):
            inside = [(f"em.{name}.{one}", getattr(found, one)) for one in found.__all__]
            yield from (
                (full, one) for full, one in inside if inspect.isfunction(inspect.unwrap(one))
            )
        elif inspect.isfunction(inspect.unwrap(found)):
            yield f"em.{name}", found


def arguments(function: Any) -> str:
    """The arguments as a cell of a table."""
    words, by_name = [], False
    for name, one in inspect.signature(function).parameters.items():
        if one.kind is one.KEYWORD_ONLY and not by_name:
            words.append("`*`")
            by_name = True
        stars = "*" * (one.kind is one.VAR_POSITIONAL) + "**" * (one.kind is one.VAR_KEYWORD)
        by_name |= stars == "*"
        default = "" if one.default is one.empty else f"={shown(one.default)}"
        words.append(f"`{stars}{name}{default}`{unit(function, name)}")
    return ", ".join(words).replace("|", "\\|")


def shown(default: object) -> str:
    """A default value."""
    return repr(default) if not callable(default) else getattr(default, "__name__", "...")


def unit(function: Any, name: str) -> str:
    """The unit that the docstring gives an argument, in brackets; empty if none."""
    text = inspect.getdoc(function) or ""
    found = re.search(rf"^    {re.escape(name)}: (.*(?:\n        .*)*)", text, re.MULTILINE)
    units = UNIT.search(found[1]) if found else None
    return f" [{units[1]}]" if units else ""


def page() -> str:
    """The whole page."""
    rows = [f"| `{name}` | {arguments(function)} |" for name, function in sorted(public())]
    return HEAD + "\n".join(rows) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page())
