"""A picture beside a table. It needs matplotlib; without it the table is shown alone."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from energymargin.notebook.tables import note

__all__ = ["beside", "drawn"]

RESOLUTION = 80  # dots an inch


def drawn(draw: Callable[[Any], None], size: tuple[float, float]) -> bytes | None:
    """What `draw` puts on an Axes of so many inches, as a PNG; None without matplotlib, or if it
    cannot be drawn."""
    if find_spec("matplotlib") is None:
        return None
    try:
        from matplotlib.figure import Figure

        figure = Figure(figsize=size, dpi=RESOLUTION, layout="constrained")
        draw(figure.subplots())
        image = io.BytesIO()
        figure.savefig(image, format="png")
    except Exception:  # the table says it all: a picture must not be in its way
        return None
    return image.getvalue()


def beside(table: str, image: bytes | None, shows: str, said: str = "") -> str:
    """A table with a PNG to its right, if there is one, and what is said below that."""
    if image is None:
        return table
    source = f"data:image/png;base64,{base64.b64encode(image).decode()}"
    picture = f'<div><img alt="{shows}" src="{source}"><br>{note(said)}</div>'
    return f'<div style="display:flex;flex-wrap:wrap;gap:1em">{table}{picture}</div>'
