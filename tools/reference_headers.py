"""The C++ interface as Markdown: what the public headers of a folder declare.

Each header is a section: the comment at its top, and then a declaration after another with the
`//!` comment above it as prose. The headers are laid out by clang-format, so a declaration of a
namespace begins in the first column and ends with `;` or with a line that begins with `}`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "cpp/include/energymargin"
MARKUP = re.compile(r"[*<]|(?<!\w)_|_(?!\w)|\[(?=[^\]]*\][(\[])")
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
    lines = [f"## {path.stem}", "", f"`#include <{included}>`", "", prose(introduction(text)), ""]
    for declaration in declarations(text):
        lines += [prose(" ".join(declaration.comment)), "", "```cpp", *declaration.code, "```", ""]
    return "\n".join(lines)


def prose(text: str) -> str:
    """Without markup by chance."""
    parts = re.split(r"(`[^`]*`)", text)
    parts[::2] = [MARKUP.sub(r"\\\g<0>", part) for part in parts[::2]]
    return "".join(parts)
