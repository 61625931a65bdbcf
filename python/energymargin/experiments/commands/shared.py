"""What the commands of `energymargin reproduce` share."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import typer

__all__ = ["app", "picture"]

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="""The paper's tables and figures, made again, and what its definitions say on paper.

    Example: `energymargin reproduce table1 --quick`
    """,
)


def picture(path: Path, draw: Callable[[], Any]) -> str:
    """Saves the figure that `draw` makes, and gives its name; or says why there is none."""
    if find_spec("matplotlib") is None:
        return "and no picture: it needs pip install energymargin[plots]"
    draw().savefig(path)
    return path.name
