"""A page: one HTML file with pictures that turn and play, which needs neither server nor network.

The script of the page is `page.html`'s own; three.js, of `three.min.js`, draws.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from energymargin.base.replacing import replace_text
from energymargin.look.viewer.search import Scored

SUFFIXES = (".html", ".htm")
HEIGHT = 640  # pixels, in a notebook


class Page:
    """A page of one or more shots."""

    def __init__(
        self,
        title: str,
        shots: Sequence[dict[str, Any]],
        blobs: Sequence[str],
        *,
        first: int = 0,
        scored: Sequence[Scored | None] = (),
    ) -> None:
        """`first` is the number of the shot that is shown at first."""
        self.title = title
        """What it shows."""
        self.scored = tuple(scored)
        """The scores of each shot with their trees; None of one that has none."""
        content = {"shots": list(shots), "blobs": list(blobs), "first": first}
        # A script ends at the first "</", wherever that is.
        text = json.dumps(content, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")
        here = files("energymargin.look.viewer")
        parts = {"title": escape(title), "data": text}
        parts["three"] = (here / "three.min.js").read_text(encoding="utf-8")
        self.html = (here / "page.html").read_text(encoding="utf-8")
        """The page, as text."""
        self.html = re.sub("%(title|data|three)%", lambda hole: parts[hole[1]], self.html)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the page; what is there is replaced.

        Raises ValueError on a name without .html or .htm, OSError if it cannot be written.
        """
        path = Path(path)
        if path.suffix not in SUFFIXES:
            expected = " or ".join(SUFFIXES)
            raise ValueError(f"path is {str(path)!r}, expected a name with {expected}")
        replace_text(path, self.html)

    def draw(self, path: str | os.PathLike[str], size: tuple[int, int]) -> None:
        """Draws the page of so many pixels: a picture (.png), or what it plays first, over and over
        (.gif).

        Raises ImportError without a browser or the extra [screenshot], OSError if it cannot be
        written.
        """
        from energymargin.look.viewer.browser import draw_page

        draw_page(self.html, Path(path), size)

    def __repr__(self) -> str:
        """What it shows."""
        return f"<Page of {self.title}: save('page.html') writes it>"

    def _repr_html_(self) -> str:
        look = f'width="100%" height="{HEIGHT}" style="border:0"'
        return f'<iframe srcdoc="{escape(self.html)}" {look}></iframe>'
