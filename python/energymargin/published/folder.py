"""What a folder of published data holds."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["RECORDINGS", "SIMULATED", "of_part", "parts"]

SIMULATED = ("push", "balance", "topple", "grasp")
"""The simulated datasets of Table I, in its order."""
RECORDINGS = tuple(
    f"{tool}-pushes-{object}"
    for object in ("rectangle", "triangle", "convex", "concave", "irregular")
    for tool in ("jaw", "circle")
)
"""The combinations of Table II, in its order."""


def parts(folder: str | os.PathLike[str]) -> list[str]:
    """The names of what there is, simulated first: "push", ..., "jaw-pushes-rectangle", ...

    Raises ValueError if there is nothing.
    """
    root = Path(folder)
    found = [name for name in SIMULATED if (root / "simulated" / name).is_dir()]
    found += [name for name in RECORDINGS if (root / "recordings" / name).is_dir()]
    if not found:
        raise ValueError(
            f"{root} has no published data, expected a folder with simulated/push and the like, or "
            "recordings/jaw-pushes-rectangle and the like"
        )
    return found


def of_part(folder: str | os.PathLike[str], part: str) -> Path:
    """The folder of a part. Raises ValueError if there is none."""
    known = parts(folder)
    if part not in known:
        raise ValueError(f"part is {part!r}, expected one of {', '.join(known)}")
    kind = "simulated" if part in SIMULATED else "recordings"
    return Path(folder) / kind / part
