"""How smoothly the page of `energymargin view` turns: frame times in a browser.

The browser draws without a graphics card, on the processor's cores, so these are the slowest frames
that a user will see. make bench-view
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import cyclopts
import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray

from energymargin.cli.progress import share_bar
from energymargin.cli.terminal import err, out
from energymargin.look.viewer import view
from energymargin.look.viewer.browser import headless_page
from tables import markdown

if TYPE_CHECKING:
    from playwright.sync_api import Page

SIZE = (1280, 800)
SECONDS = 8.0
# How finely the page is drawn, and the query of its address for that.
LOOKS = {"by default [ms]": "", "at full resolution [ms]": "?fixedDpr=1"}
# Times [ms] between the frames that the browser draws.
WATCH = """() => {
  window.frames = []; window.watching = true;
  const step = (now) => {
    window.frames.push(now);
    if (window.watching) requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}"""
TAKE = "() => { window.watching = false; return window.frames; }"


def main(
    task: Annotated[str, Parameter(help="Whose first trajectory is seen.")] = "push",
    nodes: Annotated[str, Parameter(help="Sizes of trees.")] = "1000,10000,100000",
    out_file: Annotated[Path, Parameter(name="--out", help="The table.")] = Path("out/frames.md"),
) -> None:
    """Turns the scene of a task with the mouse, without a tree and with larger and larger ones.

    The table has the median time between two frames, and that which nine of ten are below.
    """
    rows = []
    with headless_page(SIZE) as page:
        for count in (0, *(int(word) for word in nodes.split(","))):
            with share_bar(err) as bar:
                drawn, frames = _frames(page, task, count, lambda share: bar("Searching", share))
            rows.append([f"{count:,}", drawn, *map(_median_and_tail, frames)])
            out.print(" | ".join(rows[-1]))
    text = markdown(["nodes", "drawn", *LOOKS], rows)
    out_file.parent.mkdir(parents=True, exist_ok=True)
    out_file.write_text(text)
    out.print(text, markup=False)


def _frames(
    page: Page, task: str, nodes: int, progress: Callable[[float], None]
) -> tuple[str, list[NDArray[np.float64]]]:
    """What is drawn of a tree, and of each of LOOKS the times between frames while the scene is
    turned [ms]."""
    with view(task, frame=9, nodes=max(nodes, 10)) as viewer:
        if nodes:
            viewer.page.score(progress)
        viewer.page.wait()
        frames = [_turn(page, viewer.url + look) for look in LOOKS.values()]
        drawn = page.get_by_text("are drawn")
        text = drawn.inner_text().removesuffix(" are drawn") if nodes else "no tree"
        return text, frames


def _median_and_tail(frames: NDArray[np.float64]) -> str:
    median, tail = np.percentile(frames, (50, 90))
    return f"{median:.0f}, {tail:.0f}"


def _turn(page: Page, url: str) -> NDArray[np.float64]:
    page.goto(url)
    page.get_by_role("button", name="Score this state").wait_for(timeout=120e3)
    page.wait_for_timeout(5000)
    page.mouse.move(400, 400)
    page.mouse.down()
    page.evaluate(WATCH)
    end, step = time.monotonic() + SECONDS, 0
    while time.monotonic() < end:
        step += 1
        page.mouse.move(400 + 80 * math.sin(0.15 * step), 400 + 40 * math.cos(0.15 * step))
        time.sleep(0.01)
    page.mouse.up()
    return np.diff(page.evaluate(TAKE))


if __name__ == "__main__":
    cyclopts.run(main)
