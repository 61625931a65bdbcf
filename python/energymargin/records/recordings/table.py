"""The table of a recording: a pandas DataFrame, a row an instant, in SI units.

Its columns are `time`, perhaps `frame`, the camera's number, and of each body its pose and perhaps
its velocity: in the plane BODY_x, BODY_y, BODY_yaw and BODY_vx, BODY_vy, BODY_yaw_rate; in space
BODY_x, BODY_y, BODY_z, BODY_qx, BODY_qy, BODY_qz, BODY_qw, a unit quaternion, and BODY_vx, BODY_vy,
BODY_vz, BODY_wx, BODY_wy, BODY_wz. A pose with a NaN was not seen. The index has the place of each
row in its file, as its line.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from energymargin.base.aliases import Floats, Ints, Mask

PLANAR = (("x", "y", "yaw"), ("vx", "vy", "yaw_rate"))
SPATIAL = (("x", "y", "z", "qx", "qy", "qz", "qw"), ("vx", "vy", "vz", "wx", "wy", "wz"))
BODIES = ("object", "effector")  # where the columns name no others
PLACES = [rf"(.+)_{axis}(_[cm]?m)?" for axis in "xy"]
UNIT = 1e-3  # by so much a quaternion of single precision is not of length one


@dataclass(frozen=True)
class FileSource:
    """Where a table is from, as errors name it."""

    path: Path
    row: str = "line"
    """What one of its rows is called."""
    hint: str = "Are columns swapped, or units others (mm, deg, ms)? columns= says so"
    """What to do about numbers that no camera sees."""

    def error(self, text: str, line: np.integer | int | None = None) -> ValueError:
        """A ValueError that names the file and the line."""
        where = "" if line is None else f", {self.row} {line}"
        return ValueError(f"{self.path}{where}: {text}")

    def require_rising(self, name: str, values: Floats, lines: Ints) -> None:
        """Raises ValueError with the line where these values, shape (R,), do not rise."""
        falls = ~(np.diff(values) > 0)
        if (k := first(falls)) is not None:
            raise self.error(
                f"{name} is {values[k + 1]:.10g} after {values[k]:.10g}, expected it to rise. Are "
                f"these {falls.sum() + 1} episodes, or was the clock set? Cut the recording there",
                lines[k + 1],
            )

    def require_poses(
        self, body: str, poses: Floats, lines: Ints, wrong: Sequence[tuple[Mask, str]] = ()
    ) -> None:
        """Raises ValueError with the line of a pose in space, shape (N, 7), whose quaternion is no
        unit one, or that is wrong for another reason, each a mask (N,) and its words."""
        no_unit = np.abs(np.linalg.norm(poses[:, 3:], axis=1) - 1) > UNIT
        for mask, text in ((no_unit, "has an orientation that is no unit quaternion"), *wrong):
            if (k := first(mask)) is not None:
                shown = ", ".join(f"{number:.4g}" for number in poses[k])
                raise self.error(f"the {body} at ({shown}) {text}", lines[k])


def first(mask: Mask) -> int | None:
    """The first row of a mask; None if there is none."""
    return int(np.argmax(mask)) if mask.any() else None


def columns_of(names: Collection[str]) -> dict[str, tuple[list[str], list[str]]]:
    """By body, the columns of its poses and of its velocities, of a table or header that has these
    names. A body has x and y; without any, they are an object and an effector in the plane."""
    xs, ys = ([m[1] for name in names if (m := re.fullmatch(of, name))] for of in PLACES)
    known = {*xs}.intersection(ys) | {*xs, *ys}.intersection(BODIES) or BODIES
    found = {}
    for body in filter(known.__contains__, dict.fromkeys((*BODIES, *xs))):
        in_space = any(f"{body}_q{axis}" in names for axis in "xyzw")
        poses, rates = SPATIAL if in_space else PLANAR
        found[body] = [f"{body}_{axis}" for axis in poses], [f"{body}_{axis}" for axis in rates]
    return found


def fields_of(names: Collection[str]) -> list[str]:
    """All columns that a table or header with these names may have, in their documented order."""
    bodies = columns_of(names).values()
    return ["frame", "time", *(name for poses, rates in bodies for name in (*poses, *rates))]


def require_whole(what: str, given: Collection[str]) -> None:
    """Raises ValueError unless all poses are there, and of each body all velocities or none."""
    needed = ["time"]
    for poses, rates in columns_of(given).values():
        needed += [*poses, *(rates if not set(rates).isdisjoint(given) else [])]
    missing = [name for name in needed if name not in given]
    if missing:
        text = f"{what} lacks {missing[0]!r}; frame may be missing, and all velocities of a body"
        raise ValueError(text)
