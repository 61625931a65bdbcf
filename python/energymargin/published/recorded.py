"""The authors' recorded pushes of Table II, at true scale.

The authors work at ten times the length. Here lengths, masses and velocities are those of the table,
and gravity is 9.81 m/s^2 in both, so accelerations are theirs.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Box, Contact, Plan, Problem, Region, Scene
from energymargin.published.planar import between, swept
from energymargin.published.shapes import outline, prism
from energymargin.tasks.base import STEP, Params, Trajectory, one_of

__all__ = ["OBJECTS", "TOOLS", "PublishedRecorded"]

OBJECTS = ("rectangle", "triangle", "convex", "concave", "irregular")
TOOLS = ("jaw", "circle")

GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
FRICTION = 27 / 68  # of every body
HEIGHT = 0.03  # m, of object and tool
MASSES = {"rectangle": 0.048, "triangle": 0.028, "convex": 0.042, "concave": 0.043}  # kg
MASSES |= {"irregular": 0.024}
TOOL_MASS = 0.126  # kg, with the arm's share
CLEARANCE = 0.001  # m, of the tool above the table: the arm carries it
WALL_Y = -0.15  # m, its near side; the push goes towards smaller y
WALL_SIZE = (1.0, 0.1, 0.06)  # m

FORCE_BOUND, TORQUE_BOUND = 2.5, 0.005  # m/s^2 times the mass; rad/s^2 m^2 times the mass
LONGEST_EDGE = 0.3  # s
RATE = 0.05 * 1e4  # 1/J: 0.05 at ten times the length, where energies are ten thousand times as large
HALF_WIDTH, AHEAD, ENDS, LEAST_SPEED = 0.057, 1.5, 0.0057, 0.03  # m, s, m, m/s; of the labels
DISC = 0.0855  # m

# What counts as success, by eye, as each readme.md has it; see `succeeded`.
NEAR = {"convex": 0.02, "triangle": 0.02 * 2**0.5}  # m, of the tag to the wall
WITHIN = 0.06  # m: all of the irregular object is so near to the wall
ALIGNED = np.radians(15.0)  # of a long side with the wall; ours, since the eye has no number
TOUCHING = 0.01  # m, of that side to the wall; ours
