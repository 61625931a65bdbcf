"""Grippers by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from energymargin.base.checks import one_of
from energymargin.grasps.hands import ParallelGripper

__all__ = ["PRESETS", "preset"]

COLUMNS = ("opening", "pad", "force", "finger", "palm", "thickness", "tip")
ROWS: dict[str, tuple[Any, ...]] = {
    "panda": (0.08, (0.02, 0.02), 40.0, 0.0463, (0.204, 0.063, 0.092), 0.012, 0.0088),
    "robotiq_2f85": (0.085, (0.022, 0.0375), 60.0, 0.07, (0.15, 0.075, 0.09), 0.014),
    # Pads and reach of the model of ros-industrial, force of the maker.
    "robotiq_2f140": (0.14, (0.027, 0.065), 125.0, 0.12, (0.15, 0.075, 0.09), 0.014),
    # Of the model of Drake.
    "wsg_50": (0.11, (0.02, 0.02), 80.0, 0.082, (0.146, 0.05, 0.0725), 0.012),
}
"""By name the COLUMNS of a gripper [m] and [N]; the tip is left out where it is usual."""
PRESETS = {
    name: ParallelGripper(**dict(zip(COLUMNS, row, strict=False))) for name, row in ROWS.items()
}
PANDA = PRESETS["panda"]


def preset(name: str) -> ParallelGripper:
    """A gripper of PRESETS. Raises ValueError on another name."""
    if name not in PRESETS and Path(str(name)).suffix in (".urdf", ".xml"):
        options = "close={'JOINT': (open, closed)}, fingers=['LINK', 'LINK'], frame='LINK'"
        way = f"or of a file em.grasps.HandFile({name!r}, {options})"
        raise ValueError(f"hand is {name!r}, expected one of {', '.join(PRESETS)}, {way}")
    return PRESETS[one_of("hand", name, tuple(PRESETS))]
