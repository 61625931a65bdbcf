"""Docstrings of the package as autodoc wants them.

They are plain text with `code` between backticks. What reStructuredText would read as markup in
them is escaped here; and the compiled module's own name is left out, since nobody imports it.
"""

from __future__ import annotations

import builtins
import re
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx

CODE = re.compile(r"(``.+?``|`[^`]+`)")
FENCE = re.compile(r"^(\s*)```(\w*)\s*$")


def _escaped(line: str) -> str:
    """Without markup by chance: `*`, `|` and a trailing `_` are themselves outside of code."""
    parts = CODE.split(line)
    for number, part in enumerate(parts):
        if number % 2 == 0:
            parts[number] = re.sub(r"(\w)_(?!\w)", r"\1\\_", re.sub(r"([*|])", r"\\\1", part))
    return "".join(parts)


BEFORE_NAPOLEON, AFTER_NAPOLEON = 400, 600
MADE_BY_PYTHON = "Create new instance of "  # of a named tuple
_aside: dict[str, list[str]] = {}


def _lay_aside(*event: Any) -> None:
    """Napoleon takes what stands before a colon in the docstring of a value for its type."""
    _app, what, name, _thing, _options, lines = event
    if what in ("attribute", "data", "property"):
        _aside[name] = lines.copy()
        lines.clear()


def _process(*event: Any) -> None:
    """A docstring's lines, in place."""
    _app, _what, name, _thing, _options, lines = event
    found = _aside.pop(name, lines)
    lines[:] = [line for line in found if not line.startswith(MADE_BY_PYTHON)]
    made: list[str] = []
    literal: int | None = None  # the indentation of the literal block that the line belongs to
    fence: str | None = None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if fence is not None:
            if line.strip() == "```":
                fence = None
                made.append("")
            else:
                made.append(f"   {line}")
        elif opened := FENCE.match(line):
            fence = opened[1]
            made += ["", f"{fence}.. code-block:: {opened[2] or 'text'}", ""]
        elif literal is not None and (indent > literal or not line.strip()):
            made.append(line)
        else:
            literal = indent if line.rstrip().endswith("::") else None
            made.append(_escaped(line))
    lines[:] = made


def _signature(*event: Any) -> tuple[str | None, str | None]:
    """With the names that a reader knows."""
    arguments, returned = event[-2:]
    return _short(arguments), _short(returned)


LEFT_OUT = ("energymargin._core.", "collections.abc.", "numpy.typing.", "typing.")
ARRAY_LIKE = re.compile(r"[~\w.]*_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]")
ARRAY = re.compile(r"~?(?:numpy\.)?ndarray\[.*?dtype\[(.*?)\]\]")


def _short(text: str | None) -> str | None:
    if text is None:
        return None
    text = re.sub(r"^\((?:self|cls)(?:: [\w.]+)?(?:, )?", "(", text)
    text = ARRAY_LIKE.sub("ArrayLike", text)
    text = ARRAY.sub(lambda found: f"NDArray[{found[1].lstrip('~').removeprefix('numpy.')}]", text)
    text = re.sub(r"\bobject\b", "Any", text)
    for module in LEFT_OUT:
        text = text.replace(module, "")
    return re.sub(r"<([\w.]+) object at 0x[0-9a-f]+>", r"\1()", text)


def _unlink_builtins(_app: Sphinx, tree: nodes.document) -> None:
    """The `type` of an annotation is Python's, and no member of that name."""
    for link in list(tree.findall(pending_xref)):
        if link["refdomain"] == "py" and hasattr(builtins, link["reftarget"]):
            link.replace_self(nodes.Text(link["reftarget"]))


def setup(app: Sphinx) -> dict[str, Any]:
    """Connects them."""
    app.connect("autodoc-process-docstring", _lay_aside, priority=BEFORE_NAPOLEON)
    app.connect("autodoc-process-docstring", _process, priority=AFTER_NAPOLEON)
    app.connect("autodoc-process-signature", _signature)
    app.connect("doctree-read", _unlink_builtins)
    return {"parallel_read_safe": True}
