"""What a problem, its scene and its plan look like in a notebook: numbers, and the state drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from energymargin._core import Plan, Problem, Scene
from energymargin.future_text import future_rows, plan_rows
from energymargin.notebook.tables import NamedValue, beside, drawn, grid, table

__all__ = ["plan", "problem", "scene"]

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
    rows: list[NamedValue] = [
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
    rows += future_rows(asked)
    return beside(table("Problem", rows), _picture(asked), "the state", COLORS)


def plan(of_robot: Plan) -> str:
    """What the robot does, and how long."""
    return table("Plan", plan_rows(of_robot))


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
    def draw(ax: Any) -> None:
        from energymargin.plots import plot_state

        plot_state(problem, ax=ax, detail=DETAIL)

    return drawn(draw, SIZE)
