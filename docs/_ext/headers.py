"""The C++ interface: ```{headers} search``` writes what the public headers of a folder declare.

Each header is a section: the comment at its top, and then a declaration after another with the
`//!` comment above it as prose. The headers are laid out by clang-format, so a declaration of a
namespace begins in the first column and ends with `;` or with a line that begins with `}`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

FOLDER = Path(__file__).parents[2] / "cpp/include/energymargin"
SKIPPED = re.compile(r"#|namespace\b|}  // namespace|using namespace|(class|struct) \w+;")


@dataclass
class Declaration:
    """Some lines of code, and what the comment above them says."""

    comment: list[str] = field(default_factory=list)
    code: list[str] = field(default_factory=list)


def headers(folder: str) -> list[Path]:
    """Of a folder below include/energymargin; "." is that itself."""
    return sorted((FOLDER / folder).glob("*.hpp"))


def introduction(text: str) -> str:
    """The comment below `#pragma once`."""
    lines = text.splitlines()
    begun = lines.index("#pragma once") + 1
    found = []
    for line in lines[begun:]:
        if not line.startswith("//"):
            break
        found.append(line.removeprefix("//").strip())
    return " ".join(found)


def declarations(text: str) -> Iterator[Declaration]:
    """Those of the namespace, in order; without what is `detail`."""
    body = text[text.index("namespace energymargin") :] if "namespace energymargin" in text else ""
    lines = iter(body.splitlines())
    current = Declaration()
    for line in lines:
        if line.startswith("namespace detail"):
            for hidden in lines:
                if hidden.startswith("}"):
                    break
        elif not line.strip():
            if not current.code:
                current = Declaration()
        elif not current.code and line.startswith("//"):
            current.comment.append(line.lstrip("/!<").strip())
        elif not current.code and SKIPPED.match(line):
            continue
        else:
            current.code.append(line)
            if _ends(current.code):
                yield current
                current = Declaration()


def _ends(code: list[str]) -> bool:
    """Whether a declaration is whole: all that it opens is closed."""
    plain = [re.sub(r"//.*|\"[^\"]*\"", "", line) for line in code]
    depth = sum(line.count(a) for line in plain for a in "({[")
    depth -= sum(line.count(a) for line in plain for a in ")}]")
    last = plain[-1].rstrip()
    return depth == 0 and (last.endswith(";") or last.endswith("}"))


def section(path: Path) -> str:
    """A header as Markdown."""
    text = path.read_text()
    included = path.relative_to(FOLDER.parent)
    lines = [f"## {path.stem}", "", f"`#include <{included}>`", "", _prose(introduction(text)), ""]
    for declaration in declarations(text):
        lines += [_prose(" ".join(declaration.comment)), "", "```cpp", *declaration.code, "```", ""]
    return "\n".join(lines)


def _prose(text: str) -> str:
    """Without markup by chance."""
    parts = re.split(r"(`[^`]*`)", text)
    parts[::2] = [re.sub(r"([*_<>|$\[\]])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


class Headers(SphinxDirective):
    """Parses the sections where it stands."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """A section a header."""
        paths = headers(self.arguments[0])
        for path in paths:
            self.env.note_dependency(str(path))
        text = "\n".join(map(section, paths))
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, Any]:
    """Adds the directive."""
    app.add_directive("headers", Headers)
    return {"parallel_read_safe": True}
