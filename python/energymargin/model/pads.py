"""Soft pads of fingertips: layers of rubber, in which what is gripped has a patch and no points."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import pi
from typing import Any

from energymargin._core import Surface
from energymargin.base.checks import check_type, positive_number

OF_DISC = 0.8  # of a parabolic pressure to an even one: radii with the same torque, 8/15 over 2/3


@dataclass(frozen=True)
class Pad:
    """The soft pad of a fingertip.

    It spreads a force over a patch. Friction acts in the middle of the patch, and resists a turn
    about its normal as it does under an even pressure. The patch is what the pad shares with a flat
    face, and with what is round or has an edge at least a disc. That one is of a bed of springs
    (Johnson, Contact Mechanics, 1985, section 4.3) that a sphere presses into:

        radius = .8 (4 curvature load thickness / (pi modulus))^(1/4),

    where .8 is between its parabolic pressure and an even one of the same torque.

    Args:
        thickness: of the rubber [m].
        modulus: Young's modulus [Pa]: silicone rubber of Shore A 30, by Gent, On the relation
            between indentation hardness and Young's modulus (1958).
        load: that presses on it [N].
        curvature: radius of what is round and is gripped [m].

    Raises ValueError on numbers that are not above 0.
    """

    thickness: float = 2e-3
    modulus: float = 1.1e6
    load: float = 20.0
    curvature: float = 0.03

    def __post_init__(self) -> None:
        """Checks all of it."""
        for name in ("thickness", "modulus", "load", "curvature"):
            positive_number(name, getattr(self, name))

    @property
    def radius(self) -> float:
        """Radius of the smallest patch [m]."""
        bed = self.modulus / self.thickness  # pressure by depth, N/m^3
        return float(OF_DISC * (4 * self.curvature * self.load / (pi * bed)) ** 0.25)

    def surface(self, other: Surface | None = None, *, most: float = float("inf")) -> Surface:
        """That of a body, beside what another one says; its patch has at most a radius [m]."""
        names = ("torsional_friction", "rolling_friction", "restitution", "stiffness", "damping")
        own = {name: getattr(other, name) for name in names} if other else {}
        return Surface(**own, patch_radius=min(self.radius, most))


def add_pads(bodies: Iterable[dict[str, Any]], pads: Mapping[str, Pad] | None, prefix: str) -> None:
    """Gives pads to links: keywords of `Scene.add_body`, which have names behind `prefix`.

    Raises ValueError on a link that is not there.
    """
    if pads is None:
        return
    check_type("pads", pads, Mapping, "links and their em.Pad")
    named = {str(keywords["name"]).removeprefix(prefix): keywords for keywords in bodies}
    for link, pad in pads.items():
        check_type(f"pads[{link!r}]", pad, Pad, "an em.Pad")
        own = [named[name] for name in named if name == link or name.startswith(f"{link}/")]
        if not own:
            raise ValueError(f"pads has {link!r}, expected one of {', '.join(named)}")
        for keywords in own:
            keywords["surface"] = pad.surface(keywords.get("surface"))
