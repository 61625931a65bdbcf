"""A page: one HTML file with pictures that turn and play, which needs neither server nor network.

The script of the page is `page.html`'s own; three.js, of `three.min.js`, draws. A browser without a
window makes pictures of it (Playwright).
"""

from __future__ import annotations

import io
import json
import os
import re
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from energymargin.base.aliases import AnyPath
from energymargin.base.errors import needs_extra
from energymargin.base.replacing import PAGES, replace_bytes, replace_text, require_suffix
from energymargin.look.viewer.sources import Scored

if TYPE_CHECKING:
    from playwright import sync_api

HEIGHT = 640  # pixels, in a notebook
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# Drawn without a graphics card, so that a picture is the same on all machines; and nothing is asked
# of the network.
OPTIONS = (
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
PATIENCE = 60.0  # s
FRAMES, COLORS = 24, 64  # of a GIF
REST = 1200  # ms, at its end


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

    def save(self, path: AnyPath) -> None:
        """Writes the page; what is there is replaced.

        Raises ValueError on a name without .html or .htm, OSError if it cannot be written.
        """
        path = Path(path)
        require_suffix("path", path, PAGES)
        replace_text(path, self.html)

    def draw(self, path: AnyPath, size: tuple[int, int]) -> None:
        """Draws the page of so many pixels: a picture (.png), or what it plays first, over and over
        (.gif).

        Raises ImportError without a browser or the extra [screenshot], ValueError on a GIF of a
        page that plays nothing, RuntimeError if the browser fails, and OSError if the file cannot
        be written.
        """
        path = Path(path)
        with headless_page(size) as page:
            from playwright.sync_api import Error

            page.set_default_timeout(1e3 * PATIENCE)
            try:
                page.set_content(self.html)
                body = page.locator("body")
                drawn = _played(page) if path.suffix == ".gif" else body.screenshot()
            except Error as error:
                raise RuntimeError(f"the browser gave up: {str(error).splitlines()[0]}") from error
        replace_bytes(path, drawn)

    def __repr__(self) -> str:
        """What it shows."""
        return f"<Page of {self.title}: save('page.html') writes it>"

    def _repr_html_(self) -> str:
        look = f'width="100%" height="{HEIGHT}" style="border:0"'
        return f'<iframe srcdoc="{escape(self.html)}" {look}></iframe>'


@contextmanager
def headless_page(size: tuple[int, int] = (1400, 900)) -> Iterator[sync_api.Page]:
    """An empty page of Chromium, of so many pixels.

    The browser is the one that is installed, or Playwright's own. Raises ImportError if there is
    neither, or no Playwright.
    """
    with needs_extra("a picture of the page", "screenshot"):
        from playwright.sync_api import Error, sync_playwright
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    root = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    with sync_playwright() as playwright:
        try:
            browser = playwright.chromium.launch(executable_path=path, args=[*OPTIONS, *root])
        except Error as error:
            raise ImportError(
                f"there is no browser that starts ({str(error).splitlines()[0]}): "
                "apt install chromium, or playwright install chromium"
            ) from error
        with browser:
            yield browser.new_page(viewport={"width": size[0], "height": size[1]})


def _played(page: sync_api.Page) -> bytes:
    """The scene at moments of the first track, evenly in time, as a GIF."""
    times = page.evaluate("shot.tracks.length ? shot.tracks[0].times : []")
    if len(times) < 2:
        raise ValueError("what is a page that plays nothing, expected one with an escape or a plan")
    moments = np.searchsorted(times, np.linspace(0.0, times[-1], FRAMES + 1)[:-1])
    pictures = []
    for moment in [*moments.tolist(), len(times) - 1]:
        page.evaluate("moment => { byId('moment').value = moment; showMoment(); }", moment)
        image = Image.open(io.BytesIO(page.locator("#picture").screenshot())).convert("RGB")
        pictures.append(image.quantize(COLORS, dither=Image.Dither.NONE))
    each = round(1e3 * times[-1] / FRAMES)
    look: dict[str, Any] = {"duration": [*[each] * FRAMES, REST], "loop": 0, "optimize": True}
    file = io.BytesIO()
    pictures[0].save(file, "gif", save_all=True, append_images=pictures[1:], **look)
    return file.getvalue()
