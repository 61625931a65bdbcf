"""What a problem and its scene look like in a notebook: numbers, and a picture of the state.

The picture needs matplotlib; without it the numbers are shown alone.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

from energymargin._core import Problem, Scene
from energymargin.notebook.tables import Row, grid, note, table

__all__ = ["problem", "scene"]

SIZE = (4.5, 3.2)  # inch, of a picture
DETAIL = 150  # cells of the sets along its longer side, which is quick
COLORS = "object orange, effector green; capture set blue, success set grey with dashed edge"
MOST_NAMES = 4  # of bodies


def problem(asked: Problem) -> str:
    """What is asked, beside a picture of the state."""
    sets = {
        "success set": asked.succeeded,
        "capture set of at least one object": asked.captured_any,
        "bounds of the search": asked.within,
    }
    rows: list[Row] = [
        ("bodies", _bodies_in_words(asked.scene)),
        ("largest force", _vector(asked.force, "N")),
        ("largest torque", _vector(asked.torque, "N m")),
        ("longest edge", f"{asked.duration:g} s"),
        ("effector", {"coast": "coasts", "drive": "is driven"}[asked.effector]),
        ("rate λ", f"{asked.rate:g} 1/J"),
        (
            "sets",
            ", ".join(
                ["capture set", *(name for name, region in sets.items() if region is not None)]
            ),
        ),
    ]
    contacts = asked.contacts
    rows.append(("measured contacts", "none" if contacts is None else len(contacts)))
    return _beside(table("Problem", rows), _picture(asked))


def scene(made: Scene) -> str:
    """Its bodies, a row each."""
    head = ("body", "role", "shape", "mass [kg]", "friction")
    bodies = [
        (
            body.name,
            body.role if body.role != "none" else "",
            type(body.shape).__name__,
            "fixed" if body.fixed else f"{body.mass:.4g}",
            f"{body.friction:.3g}",
        )
        for body in made.bodies
    ]
    more = f"{len(made.joints)} joints, {len(made.springs)} springs, "
    said = f"{more}gravity {_vector(made.gravity, 'm/s²')}, {made.dimension} numbers in a state"
    return grid("Scene", head, bodies, said)


def _vector(values: Any, unit: str) -> str:
    return f"({', '.join(f'{value:.4g}' for value in values)}) {unit}"


def _bodies_in_words(scene: Scene) -> str:
    names: dict[str, list[str]] = {"object": [], "effector": [], "none": []}
    for body in scene.bodies:
        names[body.role].append(body.name)
    parts = [
        f"{role if role != 'none' else 'others'}: {_listed(own)}"
        for role, own in names.items()
        if own
    ]
    return "; ".join(parts)


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more


def _picture(problem: Problem) -> bytes | None:
    """The state, as a PNG; None without matplotlib, or if it cannot be drawn."""
    if find_spec("matplotlib") is None:
        return None
    try:
        from matplotlib.figure import Figure

        from energymargin.plots import plot_state

        figure = Figure(figsize=SIZE, dpi=80, layout="constrained")
        plot_state(problem, ax=figure.subplots(), detail=DETAIL)
        image = io.BytesIO()
        figure.savefig(image, format="png")
    except Exception:  # the table says it all: a picture must not be in its way
        return None
    return image.getvalue()


def _beside(table: str, image: bytes | None) -> str:
    if image is None:
        return table
    source = f"data:image/png;base64,{base64.b64encode(image).decode()}"
    picture = f'<div><img alt="the state" src="{source}"><br>{note(COLORS)}</div>'
    return f'<div style="display:flex;flex-wrap:wrap;gap:1em">{table}{picture}</div>'
