"""The commands' page: ```{commands}``` writes every command and its options."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

NAME = "energymargin"


def page() -> str:
    """As Markdown, a heading a command."""
    from energymargin.cli import app

    _, *commands = re.split(r"(?m)^(?=##+ )", app.generate_docs())
    text = "".join(part for part in commands if part.split(maxsplit=2)[1] == NAME)
    text = re.sub(rf"(?m)^(#+) {NAME} ", r"\1 ", text)
    return re.sub(r"\[(`[^`]+`)\]\(#[^)]*\)", r"\1", text)  # the lists of a group's commands


class Commands(SphinxDirective):
    """Parses the page where it stands."""

    def run(self) -> list[nodes.Node]:
        """Its sections."""
        return self.parse_text_to_nodes(page(), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, Any]:
    """Adds the directive."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
