"""The authors' recorded pushes of Table II, at true scale.

The authors work at ten times the length. Here lengths, masses and velocities are those of the
table; gravity is the same in both, and so are accelerations.
"""

from __future__ import annotations

import functools
import operator
from dataclasses import replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Box, Compound, ConvexHull, Part, Region, Scene
from energymargin.base.checks import one_of
from energymargin.tasks.base import STEP, Params
from energymargin_paper.paper.authors.task import Sweep, SweptTask, Vector

__all__ = ["OBJECTS", "TOOLS", "PublishedRecorded", "outlines", "prism"]

OBJECTS = ("rectangle", "triangle", "convex", "concave", "irregular")
TOOLS = ("jaw", "circle")

GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
FRICTION = 27 / 68  # of every body
HEIGHT = 0.03  # m, of object and tool
MASSES = dict(zip(OBJECTS, (0.048, 0.028, 0.042, 0.043, 0.024), strict=True))  # kg
TOOL_MASS = 0.126  # kg, with the arm's share
OVERLAP = 0.004  # m: by so much tags put the tool into the object, in nine frames of ten at most
CLEARANCE = 0.001  # m, of the tool above the table: the arm carries it
WALL_Y = -0.15  # m, its near side; the push goes towards smaller y
WALL_SIZE = (1.0, 0.1, 0.06)  # m

ACCELERATION = 2.5  # m/s^2, of the object
TURN = 5.0  # rad/s^2; the authors' 0.5 at ten times the length
INERTIA = 0.001  # m^2: of the object, by its mass

# What the observer called a success, as the authors' notes have it. The distances are of the tag to
# the wall where the right side lies at it, from the meshes; at the last frames of the recordings
# these rules give 59 of 60 labels of the even half back, with SLACK for the tag's error.
TOUCHING = {"rectangle": 0.035, "triangle": 0.0288, "convex": 0.0205, "concave": 0.0205}  # m
ALL_WITHIN = 0.06  # m, of the wall: every corner of the irregular object
ALIGNED = {"rectangle": 25.0, "concave": 20.0}  # deg, of a long side with the wall; ours
TURNED = 0.05  # m, that a side counts as farther away which is not aligned
SLACK = dict.fromkeys(OBJECTS, 0.008) | {"rectangle": 0.02, "irregular": 0.015}  # m
BINS = 36  # of the yaw

SCALE = 0.1  # the authors' lengths are ten times as large
THRESHOLD = 0.1  # concavity that a part may keep; the authors' own parts are slabs of half a mm
LEAST_WIDTH = 0.004  # m; thinner parts are slivers, less than the tags' error


class PublishedRecorded(SweptTask):
    """Push a printed object to a wall with a printed tool: the authors' recordings."""

    name = "published-recorded"
    duration = 0.3
    rate = 500.0  # 0.05 at ten times the length, where energies are ten thousand times as large
    sweep = Sweep(half_width=0.057, ahead=1.5, ends=0.0057, least_speed=0.03, disc_radius=0.0855)
    search_sweep = replace(sweep, half_width=0.05, disc_radius=0.1)

    def __init__(self, data: str = ".", object: str = "rectangle", tool: str = "jaw") -> None:
        """A combination; raises ValueError on words that are none, OSError on a missing shape.

        `data`: the folder of the published data, which has the shapes.
        """
        self.data = str(data)
        self.object = one_of("object", object, OBJECTS)
        self.tool = one_of("tool", tool, TOOLS)

    @cached_property
    def _scene(self) -> Scene:
        shapes = Path(self.data) / "shapes"
        made = Scene(gravity=GRAVITY, step=STEP)
        made.add_plane("table", friction=FRICTION)
        made.add_body(
            "wall",
            Box(WALL_SIZE),
            mass=0,
            position=(0.0, WALL_Y - WALL_SIZE[1] / 2, WALL_SIZE[2] / 2),
            friction=FRICTION,
        )
        made.add_body(
            "object",
            prism(shapes, f"{self.object}-object", HEIGHT),
            mass=MASSES[self.object],
            position=(0.0, 0.0, HEIGHT / 2),
            friction=FRICTION,
            role="object",
        )
        made.add_body(
            "effector",
            prism(shapes, f"{self.tool}-gripper", HEIGHT, less=OVERLAP),
            mass=TOOL_MASS,
            position=(0.0, 0.2, HEIGHT / 2 + CLEARANCE),
            friction=FRICTION,
            role="effector",
            linear_factor=(1.0, 1.0, 0.0),
            angular_factor=(0.0, 0.0, 1.0),
        )
        made.disable_collisions("effector", "table")
        made.disable_collisions("effector", "wall")
        return made

    def scene(self, params: Params) -> Scene:
        """Table, wall, object and the arm's tool; the same for all recordings."""
        return self._scene

    def margin(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far objects at x, y [m] and yaw [rad], shape (N, 3), are from success by the rule of
        the observer [m], shape (N,): below 0 they are well within it."""
        y, yaw = poses[:, 1], poses[:, 2]
        if self.object == "irregular":
            return y + self._reach(yaw) - (WALL_Y + ALL_WITHIN)
        away = y - (WALL_Y + TOUCHING[self.object])
        if self.object not in ALIGNED:
            return away
        along = np.abs(np.sin(yaw)) if self.object == "rectangle" else np.cos(yaw)
        return away + np.where(along >= np.cos(np.radians(ALIGNED[self.object])), 0.0, TURNED)

    def succeeded(self, params: Params) -> Region:
        """Z_suc: `margin` is at most the SLACK of the object."""
        if self.object == "irregular":
            width = 2 * np.pi / BINS
            return functools.reduce(operator.or_, map(self._within, np.arange(BINS) * width))
        near = _below(WALL_Y + TOUCHING[self.object] + SLACK[self.object])
        if self.object not in ALIGNED:
            return near
        tolerance = np.radians(ALIGNED[self.object])
        axis = (0.0, 1.0, 0.0)
        if self.object == "concave":
            return near & regions.Tilt("object", axis, axis, tolerance)
        sides = [regions.Tilt("object", axis, (side, 0.0, 0.0), tolerance) for side in (1.0, -1.0)]
        return near & (sides[0] | sides[1])

    def _reach(self, yaw: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far the object reaches from its tag along y at each yaw [m], shape (N,)."""
        corners = np.concatenate(outlines(Path(self.data) / "shapes", f"{self.object}-object"))
        along = np.sin(yaw)[:, None] * corners[:, 0] + np.cos(yaw)[:, None] * corners[:, 1]
        return np.asarray(along.max(axis=1))

    def _within(self, yaw: float) -> Region:
        """All of the object is near the wall, at a yaw within half a bin of this [rad]."""
        facing = (np.cos(yaw), np.sin(yaw), 0.0)
        turned = regions.Tilt("object", (1.0, 0.0, 0.0), facing, np.pi / BINS)
        reach = float(self._reach(np.array([yaw]))[0])
        return turned & _below(WALL_Y + ALL_WITHIN + SLACK[self.object] - reach)

    def bounds(self, params: Params) -> tuple[Vector, Vector]:
        """On x and y, and about z."""
        mass = MASSES[self.object]
        force = ACCELERATION * mass
        return (force, force, 0.0), (0.0, 0.0, TURN * INERTIA * mass)

    @property
    def parameters(self) -> dict[str, Any]:
        """The keywords that make this task again."""
        return {"data": self.data, "object": self.object, "tool": self.tool}


def _below(y: float) -> Region:
    """The tag is at most there along y [m]."""
    return regions.HalfSpace("object", (0.0, 1.0, 0.0), y)


@cache
def outlines(folder: Path, name: str) -> tuple[NDArray[np.float64], ...]:
    """Corners of the convex parts of a body, such as "jaw-gripper", seen from above, (N, 2) [m],
    about the tag. Slivers are left out. Errors as `em.mesh`, which needs the extra [urdf]."""
    from energymargin.meshes import mesh

    with np.errstate(divide="ignore", invalid="ignore"):  # of flat faces in the authors' meshes
        solid = mesh(folder / name / f"{name}.obj", scale=SCALE, threshold=THRESHOLD)
    found = [_hull(_corners(part)) for part in solid.parts]
    return tuple(outline for outline in found if _width(outline) >= LEAST_WIDTH)


def prism(folder: Path, name: str, height: float, less: float = 0.0) -> Compound:
    """The body of these outlines, its middle at half of the height [m]; each part is smaller by
    `less` [m] on all sides."""
    parts = []
    for whole in outlines(folder, name):
        outline = _inset(whole, less) if less else whole
        faces = [np.insert(outline, 2, z, axis=1) for z in (-height / 2, height / 2)]
        parts.append(Part(ConvexHull(np.concatenate(faces))))
    return Compound(parts)


def _corners(part: Part) -> NDArray[np.float64]:
    """Corners of a part of a mesh, where the mesh has it, seen from above, (N, 2) [m]."""
    assert isinstance(part.shape, ConvexHull)  # as all parts of a mesh are
    return np.asarray(part.shape.points)[:, :2] + np.asarray(part.position)[:2]


def _hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The corners of the convex hull, counter-clockwise."""
    from scipy.spatial import ConvexHull as Hull

    return np.asarray(points[Hull(points).vertices])


def _inset(corners: NDArray[np.float64], less: float) -> NDArray[np.float64]:
    """A convex outline whose sides are moved inwards."""
    from scipy.spatial import ConvexHull as Hull, HalfspaceIntersection

    sides = Hull(corners).equations + np.array([0.0, 0.0, less])
    return _hull(HalfspaceIntersection(sides, corners.mean(axis=0)).intersections)


def _width(corners: NDArray[np.float64]) -> float:
    """The least distance between two parallel lines that hold a convex outline [m]."""
    sides = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([-sides[:, 1], sides[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return float(np.ptp(corners @ normals.T, axis=0).min())
