"""A browser without a window, for pictures and tests (Playwright)."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from energymargin.base.errors import needs_extra
from energymargin.base.replacing import replace_bytes

if TYPE_CHECKING:
    from playwright.sync_api import Page

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# Drawn without a graphics card, so that a picture is the same on all machines; and nothing is asked
# of the network.
OPTIONS = (
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
PATIENCE = 60.0  # s


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


def screenshot(html: str, path: Path, size: tuple[int, int]) -> None:
    """A picture (PNG) of a page.

    Raises ImportError without a browser, RuntimeError if the browser fails, and OSError if the file
    cannot be written.
    """
    from playwright.sync_api import Error

    with headless_page(size) as page:
        try:
            page.set_content(html, timeout=1e3 * PATIENCE)
            picture = page.screenshot(timeout=1e3 * PATIENCE)
        except Error as error:
            raise RuntimeError(f"the browser gave up: {str(error).splitlines()[0]}") from error
    replace_bytes(path, picture)
