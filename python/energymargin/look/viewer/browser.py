"""A browser without a window, for pictures and tests (Playwright)."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from energymargin.base.errors import needs_extra
from energymargin.base.replacing import replaced

if TYPE_CHECKING:
    from playwright.sync_api import Page

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# Drawn without a graphics card, so that a picture is the same on all machines; and nothing is asked
# of the network.
OPTIONS = (
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
HIDDEN = "[class*=mantine-Notification] { display: none !important }"  # such as on slow graphics
PATIENCE = 60.0  # s
PAUSE = 400  # ms


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


def screenshot(url: str, path: Path, size: tuple[int, int]) -> None:
    """A picture (PNG) of a page, once it no longer changes.

    Raises ImportError without a browser, TimeoutError if the page does not come to rest,
    RuntimeError if the browser fails, and OSError if the file cannot be written.
    """
    from playwright.sync_api import Error

    with headless_page(size) as page:
        try:
            page.goto(f"{url}?fixedDpr=1")  # else it is drawn coarser where that is slow
            page.wait_for_selector("canvas", timeout=1e3 * PATIENCE)
            page.add_style_tag(content=HIDDEN)
            picture = _at_rest(page)
        except Error as error:
            raise RuntimeError(f"the browser gave up: {str(error).splitlines()[0]}") from error
    with replaced(path) as file:
        file.write_bytes(picture)


def _at_rest(page: Page) -> bytes:
    """The page, when it looks the same twice."""
    end, before = time.monotonic() + PATIENCE, b""
    while time.monotonic() < end:
        page.wait_for_timeout(PAUSE)
        now = page.screenshot(timeout=1e3 * PATIENCE)
        if now == before and page.get_by_text("Connecting").count() == 0:
            return now
        before = now
    raise TimeoutError(f"the page still changes after {PATIENCE:.0f} s")
