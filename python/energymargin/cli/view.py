"""The command `energymargin view`."""

from __future__ import annotations

import webbrowser
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

import energymargin as em
from energymargin.base.bars import bar
from energymargin.base.replacing import PAGES
from energymargin.cli.options import Parameters, PlanWord, as_number, chosen_future, panel, parsed
from energymargin.cli.terminal import loading, require_free, say_written, share_bar

PICTURES = (".png", ".gif")
PICTURE = panel("A picture instead of a page")
SIZE = "1400x900"


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
    every: int | None = None,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    open_browser: Annotated[bool, Parameter(name="--open")] = False,
    size: Annotated[str, PICTURE] = SIZE,
    overwrite: bool = False,
) -> None:
    """Make a page of a state with its scores, tree, sets and escape: one file that turns and plays
    in any browser, without a server.

    Example: `energymargin view push -o push.html --open`

    A picture, and one that moves: `energymargin view push --trajectory 3 --frame 8 -o push.png`,
    `energymargin view push --size 900x500 -o push.gif`

    What is to come: `energymargin view push --frames 5 --plan script -o push.html`

    Args:
        what: A problem file (.json), a dataset (.h5), or a task's name.
        trajectory: Which trajectory, from 0; the first that ends outside of its capture set if not
            given, or else the first.
        frame: Which of its frames, from 0; one a quarter of all before its last loss if not given,
            or else the middle one.
        nodes: Nodes of each search tree: those of --scores, or else 1000.
        seed: Seed of a task's trajectories, and of searches: that of --scores, or else 0.
        parameter: A parameter of the task: NAME=VALUE; may be repeated.
        frames: Ask of each state of a dataset or a task whether it stays captured over the next so
            many frames; that of --scores if not given.
        plan: With --frames, what the robot does meanwhile: script, as its task's (if not given);
            hold, it goes on as it moves; none, it coasts.
        scores: Scores of the dataset, from `score`, which are shown too.
        run: Which run, if there are several; `energymargin export` lists them.
        every: Also every so many frames of the trajectory, to choose from on the page.
        output: The page (.html), a picture of it (.png), or what it plays first (.gif).
        open_browser: Open the page in your browser.
        size: Size of the picture: WIDTHxHEIGHT in pixels.
        overwrite: Replace the file if it exists.
    """
    pixels = _size(size)
    require_free(output, overwrite=overwrite, suffixes=[*PAGES, *PICTURES])
    if output.suffix in PICTURES and find_spec("playwright") is None:  # before the search
        needs = "needs Playwright: pip install 'energymargin[screenshot]'"
        raise ImportError(f"a {output.suffix} {needs}")
    with loading():
        import energymargin.viewer  # noqa: F401

    with bar(f"Generating {what}", "trajectories") as progress, share_bar() as tell:
        page = em.viewer.view(
            what,
            parameters=parsed(parameter),
            trajectory=trajectory,
            frame=frame,
            every=every,
            nodes=nodes,
            seed=seed,
            future=chosen_future(frames, plan),
            scores=scores,
            run=run,
            progress=progress,
            scoring=lambda share: tell("Scoring", share),
        )
    if output.suffix in PICTURES:
        page.draw(output, pixels)
    else:
        page.save(output)
    say_written([output])
    if open_browser:
        webbrowser.open(output.resolve().as_uri())


def _size(text: str) -> tuple[int, int]:
    """Raises ValueError on another text than WIDTHxHEIGHT."""
    width, times, height = text.partition("x")
    if not times:
        raise ValueError(f"--size is {text!r}, expected WIDTHxHEIGHT, such as {SIZE}")
    pixels = as_number(int, "--size", width), as_number(int, "--size", height)
    if min(pixels) < 100 or max(pixels) > 8192:
        raise ValueError(f"--size is {text!r}, expected 100 to 8192 pixels a side")
    return pixels
