"""```{constants} energymargin.plots``` lists a module's public values, which autodoc leaves out."""

from __future__ import annotations

import importlib
import inspect
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

LONGEST = 100  # characters of a value


def constants(module: str) -> dict[str, str]:
    """The values by their names, as Python writes them."""
    inside = importlib.import_module(module)
    public = {name: getattr(inside, name) for name in inside.__all__}
    values = {name: v for name, v in public.items() if not _is_documented_by_autodoc(v)}
    return {name: _written(value) for name, value in values.items()}


def _is_documented_by_autodoc(thing: object) -> bool:
    return inspect.isclass(thing) or inspect.isroutine(thing) or inspect.ismodule(thing)


def _written(value: object) -> str:
    text = repr(value).replace("typing.", "").replace("collections.abc.", "").replace("`", "'")
    text = text.replace("energymargin._core.", "")
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."


class Constants(SphinxDirective):
    """A table of them."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """None, if the module has none."""
        rows = [
            f"| `{name}` | `{text.replace('|', chr(92) + '|')}` |"
            for name, text in constants(self.arguments[0]).items()
        ]
        table = ["| value | |", "| --- | --- |", *rows]
        return self.parse_text_to_nodes("\n".join(table)) if rows else []


def setup(app: Sphinx) -> dict[str, Any]:
    """Adds the directive."""
    app.add_directive("constants", Constants)
    return {"parallel_read_safe": True}
