"""How a mesh becomes convex parts, and the error of one that cannot."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from energymargin.base.aliases import Floats
from energymargin.base.checks import positive_number
from energymargin.base.errors import EnergyMarginError

SUFFIXES = (".stl", ".obj", ".dae")
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


def sizes_of(scale: Any) -> Floats:
    """A file's units [m], shape (3,), or ValueError."""
    try:
        sizes = np.broadcast_to(np.asarray(scale, float), 3)
    except (TypeError, ValueError):
        sizes = np.zeros(3)
    if not np.isfinite(sizes).all() or (sizes == 0).any():
        raise ValueError(f"scale is {scale!r}, expected one number that is not 0, or three")
    return sizes


def check_file(path: Path) -> None:
    """Raises ValueError unless the file has a kind that is read, FileNotFoundError on none."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"path is {str(path)!r}, expected a file that ends in {' '.join(SUFFIXES)}: "
            "trimesh.load_mesh(path).export('mesh.stl') makes one of PLY, OFF, GLB or 3MF, and CAD "
            "programs export STL of STEP"
        )
    if not path.is_file():
        raise FileNotFoundError(f"path is {str(path)!r}, and there is no such file")
