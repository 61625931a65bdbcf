"""A folder of studies as a page: what each found, its picture, its files and its time."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

__all__ = ["Times", "write_index"]

STYLE = """
body { font: 16px/1.5 sans-serif; max-width: 70em; margin: 2em auto; padding: 0 1em; }
table { border-collapse: collapse; font-size: 14px; margin: 1em 0; }
td, th { border: 1px solid #ccc; padding: .2em .6em; vertical-align: top; }
img { max-width: 100%; }
"""


def write_index(folder: Path, studies: Mapping[str, str], times: Times, threads: int) -> None:
    """Writes index.md and index.html in a folder that has one folder a study.

    `studies`: what each shows, by its name; those that are not there are named as such.
    """
    lines = [
        "# The studies of Energy Margin",
        "",
        f"Made by `energymargin reproduce all` with version {version('energymargin')}, "
        f"on {threads} threads.",
        "",
        "| | | time |",
        "| --- | --- | --- |",
    ]
    done = [name for name in studies if any((folder / name).glob("*.md"))]
    for name, shows in studies.items():
        time = _minutes(times.of(name)) if name in done else "not yet"
        link = f"[{name}](#{name})" if name in done else name
        lines.append(f"| {link} | {shows} | {time} |")
    for name in done:
        lines += ["", f'<a id="{name}"></a>', "", *_section(folder, name)]
    text = "\n".join(lines) + "\n"
    (folder / "index.md").write_text(text)
    (folder / "index.html").write_text(_page(text))


def _section(folder: Path, name: str) -> list[str]:
    """A study's own text, one level lower, its pictures and its files."""
    own = folder / name
    lines = []
    for text in sorted(own.glob("*.md")):
        lines += [re.sub(r"(?m)^#", "##", text.read_text().rstrip()), ""]
    for picture in sorted(own.glob("*.png")):
        lines += [f"![{picture.stem}]({name}/{picture.name})", ""]
    files = sorted(path.name for path in own.iterdir() if path.is_file())
    links = ", ".join(f"[{file}]({name}/{file})" for file in files)
    return [*lines, f"Files: {links}. The command: `energymargin reproduce {name}`."]


def _page(text: str) -> str:
    from markdown_it import MarkdownIt

    body = MarkdownIt("commonmark", {"html": True}).enable("table").render(text)
    head = f'<meta charset="utf-8"><title>Energy Margin</title><style>{STYLE}</style>'
    return f"<!doctype html><html><head>{head}</head><body>{body}</body></html>\n"


def _minutes(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"


@dataclass(frozen=True)
class Times:
    """How long each study of a folder took, over all the times that it was started [s]."""

    path: Path

    def of(self, study: str) -> float:
        """0 if it was never run; ValueError if the file holds something else."""
        return self._all().get(study, 0.0)

    def add(self, study: str, seconds: float) -> None:
        """One more time."""
        self.path.write_text(json.dumps({**self._all(), study: self.of(study) + seconds}, indent=1))

    def _all(self) -> dict[str, float]:
        if not self.path.exists():
            return {}
        try:
            times = json.loads(self.path.read_text())
            return {str(name): float(seconds) for name, seconds in times.items()}
        except (ValueError, TypeError, AttributeError) as error:
            raise ValueError(f"{self.path} holds no times of studies: remove it") from error
