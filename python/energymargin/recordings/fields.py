"""The columns of a recording: their names, their kinds and the units that these may have."""

from __future__ import annotations

import math

__all__ = ["BODIES", "FIELDS", "HEADERS", "UNITS", "kind_of", "of_body"]

BODIES = ("object", "effector")
POSE = ("x", "y", "yaw")
VELOCITY = ("vx", "vy", "yaw_rate")

UNITS = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "angle": {"rad": 1.0, "deg": math.radians(1.0)},
    "time": {"s": 1.0, "ms": 1e-3},
}
"""By kind and unit: what it is in SI units. Velocities are such a length or angle a second."""


def of_body(body: str) -> tuple[list[str], list[str]]:
    """The three columns of a body's pose, and the three of its velocity."""
    return [f"{body}_{axis}" for axis in POSE], [f"{body}_{axis}" for axis in VELOCITY]


FIELDS = ("frame", "time", *(name for body in BODIES for three in of_body(body) for name in three))
"""All columns, in the order of the documented header."""


def kind_of(field: str) -> str | None:
    """ "length", "angle" or "time"; None of the frame's number."""
    if field in ("frame", "time"):
        return "time" if field == "time" else None
    return "angle" if "yaw" in field else "length"


def _headers() -> dict[str, tuple[str, str | None]]:
    found: dict[str, tuple[str, str | None]] = {field: (field, None) for field in FIELDS}
    for field in FIELDS:
        a_second = "_s" if field.rpartition("_")[2] in ("vx", "vy", "rate") else ""
        for unit in UNITS.get(kind_of(field) or "", ()):
            found[f"{field}_{unit}{a_second}"] = (field, unit)
    return found


HEADERS = _headers()
"""By a name in a header, such as "object_yaw_deg" or "object_vx_mm_s": the field and its unit."""
