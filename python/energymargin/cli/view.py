"""The command `energymargin view`."""

from __future__ import annotations

import threading
import webbrowser
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.markup import escape

from energymargin.base.bars import bar
from energymargin.cli.fields import as_number
from energymargin.cli.options import Output, Parameters, PlanWord, chosen_future, panel, parsed
from energymargin.cli.places import require_free
from energymargin.cli.terminal import err, leave, loading, say

if TYPE_CHECKING:
    from energymargin.viewer import Viewer

SIZE = "1400x1250"  # the whole panel is seen
SERVED = panel("How the page is served")
PICTURE = panel("A picture instead")


def view(
    what: str,
    /,
    *,
    trajectory: int | None = None,
    frame: int | None = None,
    nodes: int | None = None,
    seed: int | None = None,
    parameter: Parameters = None,
    frames: int | None = None,
    plan: PlanWord | None = None,
    scores: Path | None = None,
    run: int | None = None,
    port: Annotated[int, SERVED] = 8080,
    open_browser: Annotated[bool, SERVED, Parameter(name="--open")] = False,
    output: Annotated[Output, PICTURE] = None,
    size: Annotated[str, PICTURE] = SIZE,
    overwrite: Annotated[bool, PICTURE] = False,
) -> None:
    """See a state with its tree in a browser: move along the trajectory and along the way out, and
    score what you see. Ctrl-C ends it.

    Example: `energymargin view push`, then open the address that it prints

    A picture: `energymargin view push --trajectory 3 --frame 8 -o push.png`

    What is to come: `energymargin view push --frames 5 --plan script`

    Args:
        what: A problem file (.json), a dataset (.h5), or a task's name.
        trajectory: Which trajectory to begin with, from 0; the first that ends outside of its
            capture set if not given, or else the first.
        frame: Which of its frames, from 0; one a quarter of all before its last loss if not given,
            or else the middle one.
        nodes: Nodes of each search tree, at first: those of --scores, or else 1000.
        seed: Seed of a task's trajectories, and of searches: that of --scores, or else 0.
        parameter: A parameter of the task: NAME=VALUE; may be repeated.
        frames: Ask of each state of a dataset or a task whether it stays captured over the next so
            many frames; that of --scores if not given.
        plan: With --frames, what the robot does meanwhile: script, as its task's (if not given);
            hold, it goes on as it moves; none, it coasts.
        scores: Scores of the dataset, from `score`, which are shown too.
        run: Which run, if there are several; `energymargin export` lists them.
        port: Where this machine finds it; the next free port if that is taken.
        open_browser: Open the page in your browser.
        output: Draw the page into this PNG file instead of serving it.
        size: Size of the picture: WIDTHxHEIGHT in pixels.
        overwrite: Replace the file if it exists.
    """
    pixels = _size(size)
    if output is not None:
        require_free(output, overwrite=overwrite, suffixes=[".png", ".PNG"])
        if find_spec("playwright") is None:  # before the search, not after it
            raise ImportError("-o draws with Playwright: pip install 'energymargin[screenshot]'")
    with loading():
        from energymargin.viewer import view as open_viewer

    with bar(f"Generating {what}", "trajectories") as progress:
        viewer = open_viewer(
            what,
            parameters=parsed(parameter),
            trajectory=trajectory,
            frame=frame,
            nodes=nodes,
            seed=seed,
            future=chosen_future(frames, plan),
            scores=scores,
            run=run,
            port=port,
            progress=progress,
        )
    with viewer:
        if output is None:
            serve(viewer, open_browser=open_browser)
        else:
            _draw(viewer, output, pixels)
            return
    leave(0)


def serve(viewer: Viewer, *, open_browser: bool, score: bool = True) -> None:
    """Serves the page until Ctrl-C, which is the usual way to end it, and so no error; with `score`
    it scores what it shows first."""
    if score:
        viewer.page.score()
    say(f"Open [bold]{viewer.url}[/] in a browser. Ctrl-C ends it.")
    if open_browser:
        webbrowser.open(viewer.url)
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        say("closed")


def _draw(viewer: Viewer, path: Path, size: tuple[int, int]) -> None:
    from energymargin.cli.progress import share_bar
    from energymargin.look.viewer.browser import screenshot

    with share_bar(err) as tell:
        viewer.page.score(lambda share: tell("Scoring", share))
        viewer.page.wait()
    screenshot(viewer.url, path, size)
    say(f"Wrote {escape(str(path))}")


def _size(text: str) -> tuple[int, int]:
    """Raises ValueError on another text than WIDTHxHEIGHT."""
    width, times, height = text.partition("x")
    if not times:
        raise ValueError(f"--size is {text!r}, expected WIDTHxHEIGHT, such as {SIZE}")
    pixels = as_number(int, "--size", width), as_number(int, "--size", height)
    if min(pixels) < 100 or max(pixels) > 8192:
        raise ValueError(f"--size is {text!r}, expected 100 to 8192 pixels a side")
    return pixels
