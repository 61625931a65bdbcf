"""A browser without a window, for pictures and tests (Playwright)."""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from energymargin.base.errors import needs_extra
from energymargin.base.replacing import replace_bytes

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

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


@contextmanager
def headless_page(size: tuple[int, int] = (1400, 900)) -> Iterator[Page]:
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
        try:
            yield browser.new_page(viewport={"width": size[0], "height": size[1]})
        finally:
            browser.close()


def draw_page(html: str, path: Path, size: tuple[int, int]) -> None:
    """A picture of a page (PNG), or of what it plays first, over and over (GIF).

    Raises ImportError without a browser, ValueError on a GIF of a page that plays nothing,
    RuntimeError if the browser fails, and OSError if the file cannot be written.
    """
    from playwright.sync_api import Error

    with headless_page(size) as page:
        try:
            page.set_content(html, timeout=1e3 * PATIENCE)
            drawn = _played(page) if path.suffix == ".gif" else _shown(page.locator("body"))
        except Error as error:
            raise RuntimeError(f"the browser gave up: {str(error).splitlines()[0]}") from error
    replace_bytes(path, drawn)


def _shown(part: Locator) -> bytes:
    return part.screenshot(timeout=1e3 * PATIENCE)


def _played(page: Page) -> bytes:
    """The scene at moments of the first track, evenly in time, as a GIF."""
    times = page.evaluate("shot.tracks.length ? shot.tracks[0].times : []")
    if len(times) < 2:
        raise ValueError("what is a page that plays nothing, expected one with an escape or a plan")
    moments = np.searchsorted(times, np.linspace(0.0, times[-1], FRAMES + 1)[:-1])
    pictures = []
    for moment in [*moments.tolist(), len(times) - 1]:
        page.evaluate("moment => { byId('moment').value = moment; showMoment(); }", moment)
        image = Image.open(io.BytesIO(_shown(page.locator("#picture")))).convert("RGB")
        pictures.append(image.quantize(COLORS, dither=Image.Dither.NONE))
    each = round(1e3 * times[-1] / FRAMES)
    look: dict[str, Any] = {"duration": [*[each] * FRAMES, REST], "loop": 0, "optimize": True}
    file = io.BytesIO()
    pictures[0].save(file, "gif", save_all=True, append_images=pictures[1:], **look)
    return file.getvalue()
