"""The command `energymargin view`."""

from __future__ import annotations

import threading
import webbrowser
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from energymargin.cli.fields import whole
from energymargin.cli.options import (
    OverwriteOption,
    ParameterOption,
    RunOption,
    chosen_future,
    parsed,
)
from energymargin.cli.places import require_free
from energymargin.cli.terminal import err, leave, loading, say

if TYPE_CHECKING:
    from energymargin.viewer import Viewer

SERVED = "How the page is served"
DRAWN = "A picture instead"
SIZE = "1400x1250"  # the whole panel is seen


SubjectArgument = Annotated[
    str, typer.Argument(help="A problem file (.json), a dataset (.h5), or a task's name.")
]
TrajectoryOption = Annotated[
    int | None,
    typer.Option(
        help="Which trajectory to begin with, from 0; the first that ends outside of its capture "
        "set if not given, or else the first."
    ),
]
FrameOption = Annotated[
    int | None,
    typer.Option(
        help="Which of its frames, from 0; one a quarter of all before its last loss if not given, "
        "or else the middle one."
    ),
]
TreeNodesOption = Annotated[
    int | None,
    typer.Option(help="Nodes of each search tree, at first: those of --scores, or else 1000."),
]
ViewSeedOption = Annotated[
    int | None,
    typer.Option(help="Of a task's trajectories, and of searches: of --scores, or else 0."),
]
HorizonOption = Annotated[
    int | None,
    typer.Option(
        help="Ask of each state of a dataset or a task whether it stays captured over the next so "
        "many frames; that of --scores if not given.",
        metavar="FRAMES",
    ),
]
PlanOption = Annotated[
    str | None,
    typer.Option(
        help="What the robot does over the horizon: script, as its task's (if not given); hold, it "
        "goes on as it moves; none, it coasts.",
        metavar="script|hold|none",
    ),
]
ScoresOption = Annotated[
    Path | None, typer.Option(help="Scores of the dataset, from `score`, which are shown too.")
]
HostOption = Annotated[
    str,
    typer.Option(
        help="The address to serve at; 0.0.0.0 lets other machines see it, and use it.",
        rich_help_panel=SERVED,
    ),
]
PortOption = Annotated[
    int | None,
    typer.Option(
        help="The port; the first free one from 8080 on if not given.", rich_help_panel=SERVED
    ),
]
OpenOption = Annotated[
    bool, typer.Option("--open", help="Open the page in your browser.", rich_help_panel=SERVED)
]
OutputOption = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="Draw the page into this PNG file instead of serving it.",
        rich_help_panel=DRAWN,
    ),
]
SizeOption = Annotated[
    str, typer.Option(help="Of the picture: WIDTHxHEIGHT in pixels.", rich_help_panel=DRAWN)
]


def view_command(
    *,
    what: SubjectArgument,
    trajectory: TrajectoryOption = None,
    frame: FrameOption = None,
    nodes: TreeNodesOption = None,
    seed: ViewSeedOption = None,
    parameter: ParameterOption = None,
    horizon: HorizonOption = None,
    plan: PlanOption = None,
    scores: ScoresOption = None,
    run: RunOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    open_browser: OpenOption = False,
    output: OutputOption = None,
    size: SizeOption = SIZE,
    overwrite: OverwriteOption = False,
) -> None:
    """See a state with its tree in a browser: move along the trajectory and along the way out, and
    score what you see. Ctrl-C ends it.

    Example: `energymargin view push`, then open the address that it prints

    A picture: `energymargin view push --trajectory 3 --frame 8 -o push.png`

    What is to come: `energymargin view push --horizon 5 --plan script`
    """
    pixels = _size(size)
    if output is not None:
        require_free(output, overwrite=overwrite)
        _check_place(output)
    with loading():
        from energymargin.cli.progress import progress_bar
        from energymargin.viewer import view

    with progress_bar(err, f"Generating {what}", "trajectories") as progress:
        viewer = view(
            what,
            parameters=parsed(parameter or []),
            trajectory=trajectory,
            frame=frame,
            nodes=nodes,
            seed=seed,
            future=chosen_future(horizon, plan),
            scores=scores,
            run=run,
            host=host,
            port=port,
            progress=progress,
        )
    with viewer:
        if output is not None:
            _draw(viewer, output, pixels)
            return
        _serve(viewer, host, open_browser=open_browser)
    leave(0)


def _serve(viewer: Viewer, host: str, *, open_browser: bool) -> None:
    """Serves the page until Ctrl-C."""
    from energymargin.viewer.guard import is_local

    if not is_local(host):
        say(
            f"[yellow]Everyone who reaches {escape(host)} and has the address of this page can "
            "see it and start searches on this machine; the connection is not encrypted.[/]"
        )
    viewer.page.score()
    say(f"Open [bold]{viewer.url}[/] in a browser. Ctrl-C ends it.")
    if open_browser:
        webbrowser.open(viewer.url)
    _until_ctrl_c()


def _draw(viewer: Viewer, path: Path, size: tuple[int, int]) -> None:
    from energymargin.cli.progress import share_bar
    from energymargin.viewer.browser import screenshot

    with share_bar(err) as bar:
        viewer.page.score(lambda share: bar("Scoring", share))
        viewer.page.wait()
    screenshot(viewer.url, path, size)
    say(f"Wrote {escape(str(path))}")


def _until_ctrl_c() -> None:
    """Ctrl-C is the usual way to end it, and so no error."""
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        say("closed")


def _check_place(path: Path) -> None:
    """Raises ValueError unless a picture can be written there, ImportError without a browser's
    driver: before the search, not after it."""
    if path.suffix.lower() != ".png":
        raise ValueError(f"--output is {path}, expected a file that ends in .png")
    if not path.parent.is_dir():
        raise ValueError(f"--output is {path}, but there is no folder {path.parent}")
    if find_spec("playwright") is None:
        raise ImportError("--output draws with Playwright: pip install 'energymargin[screenshot]'")


def _size(text: str) -> tuple[int, int]:
    """Raises ValueError on another text than WIDTHxHEIGHT."""
    width, times, height = text.partition("x")
    if not times:
        raise ValueError(f"--size is {text!r}, expected WIDTHxHEIGHT, such as {SIZE}")
    pixels = whole("--size", width), whole("--size", height)
    if min(pixels) < 100 or max(pixels) > 8192:
        raise ValueError(f"--size is {text!r}, expected 100 to 8192 pixels a side")
    return pixels
