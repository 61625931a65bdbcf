"""How a mesh becomes convex parts, and the error of one that cannot."""

from __future__ import annotations

from dataclasses import dataclass

from energymargin.base.checks import positive_number
from energymargin.base.errors import EnergyMarginError

THRESHOLD = 0.1  # a duck has five parts, a bunny about twenty
MAX_POINTS = 128  # a ball of them has 95 % of its volume
LEAST_POINTS = 8  # those of a box


class FlatMeshError(EnergyMarginError, ValueError):
    """A mesh has no volume, as that of a sticker."""


@dataclass(frozen=True)
class PartSettings:
    """What the convex parts of a mesh are to be: keywords of `em.mesh`. ValueError on others."""

    decompose: bool = True
    threshold: float = THRESHOLD
    accuracy: float | None = None
    max_points: int = MAX_POINTS
    recenter: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        """Checks the numbers."""
        for name, least, most in (
            ("threshold", 0.01, 1.0),
            ("max_points", LEAST_POINTS, 10_000),
            ("seed", 0, 2**32 - 1),
        ):
            value = getattr(self, name)
            if not least <= value <= most:
                raise ValueError(f"{name} is {value!r}, expected a number from {least} to {most}")
        if self.accuracy is not None:
            positive_number("accuracy", self.accuracy)
