"""Grippers by name."""

from __future__ import annotations

from pathlib import Path

from energymargin.base.checks import one_of
from energymargin.grasps.hands import ParallelGripper

__all__ = ["PRESETS", "preset"]

PANDA = ParallelGripper(
    opening=0.08,
    pad=(0.02, 0.02),
    force=40.0,
    tip=0.0088,
    finger=0.0463,
    palm=(0.204, 0.063, 0.092),
    thickness=0.012,
)
ROBOTIQ_2F85 = ParallelGripper(
    opening=0.085,
    pad=(0.022, 0.0375),
    force=60.0,
    finger=0.07,
    palm=(0.15, 0.075, 0.09),
    thickness=0.014,
)
# Pads and reach of the model of ros-industrial, force of the maker.
ROBOTIQ_2F140 = ParallelGripper(
    opening=0.14,
    pad=(0.027, 0.065),
    force=125.0,
    finger=0.12,
    palm=(0.15, 0.075, 0.09),
    thickness=0.014,
)
# Of the model of Drake.
WSG_50 = ParallelGripper(
    opening=0.11,
    pad=(0.02, 0.02),
    force=80.0,
    finger=0.082,
    palm=(0.146, 0.05, 0.0725),
    thickness=0.012,
)
PRESETS = {
    "panda": PANDA,
    "robotiq_2f85": ROBOTIQ_2F85,
    "robotiq_2f140": ROBOTIQ_2F140,
    "wsg_50": WSG_50,
}


def preset(name: str) -> ParallelGripper:
    """A gripper of PRESETS. Raises ValueError on another name."""
    if name not in PRESETS and Path(str(name)).suffix in (".urdf", ".xml"):
        raise ValueError(
            f"hand is {name!r}, expected one of {', '.join(PRESETS)}, or of a file "
            f"em.grasps.HandFile({name!r}, close={{'JOINT': (open, closed)}}, fingers=['LINK', "
            "'LINK'], frame='LINK')"
        )
    return PRESETS[one_of("hand", name, tuple(PRESETS))]
