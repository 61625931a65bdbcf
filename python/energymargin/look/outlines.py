"""Bodies as outlines in a plane: where their corners are, and what a view has to show.

A plane is named by its two axes, such as ("x", "z"); it is looked at along the third.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.path import Path
from scipy.spatial import ConvexHull as Hull, QhullError
from scipy.spatial.transform import Rotation

from energymargin._core import Plane, Scene
from energymargin.base.aliases import Floats
from energymargin.model.scenes import body_poses, shape_parts

AXES = ("x", "y", "z")
ACROSS = (("y", "z"), ("x", "z"), ("x", "y"))  # the planes across x, y and z
STILL = 1e-6  # m; objects that spread less do not move
PREFERENCE = (1.5, 1.0, 1.2)  # of x, y and z, where it is a close call
COVERED = 0.1  # of the objects' area; a plane in which the robot covers so much more is not taken
GRID = 12  # points along an outline's sides, for its covered area
REACH = 3.0  # of the longest side of what moves freely; a fixed or jointed robot is seen so far
AROUND = 0.1  # of the view's longer side, around what moves

Limits = tuple[tuple[float, float], tuple[float, float]]  # of the plane's two axes [m]
Plan = tuple[str, str]  # the axes of a picture's plane, such as ("x", "z")
Pose = tuple[Floats, Floats]  # position, quaternion


def placed(points: Floats, pose: Pose, plane: Sequence[str]) -> Floats:
    """Points (N, 3) of a body as they are seen in the plane of two axes, shape (N, 2)."""
    position, orientation = pose
    turned = Rotation.from_quat(orientation).apply(points)
    return np.asarray((turned + np.asarray(position))[:, axis_numbers(plane)])


def outlines_of(shape: Any, pose: Pose, plane: Plan) -> list[Floats]:
    """The outline of each convex part of a shape as it is seen in the plane; arrays (N, 2).

    A part that is seen edge-on is a line.
    """
    return [_outline(placed(part, pose, plane)) for part in shape_parts(shape)]


def spring_ends(scene: Scene, poses: Mapping[str, Pose]) -> Floats:
    """Where the springs are fastened [m], shape (N, 2, 3)."""
    ends = []
    for spring in scene.springs:
        ends.append(placed(np.array([spring.point_a]), poses[spring.body_a], AXES))
        ends.append(placed(np.array([spring.point_b]), poses[spring.body_b], AXES))
    return np.reshape(ends, (-1, 2, 3))


def axis_numbers(plane: Sequence[str]) -> list[int]:
    """Which of x, y and z the plane's axes are, as numbers from 0."""
    return [AXES.index(axis) for axis in plane]


def object_centers(scene: Scene, states: Floats, axes: Sequence[str] = AXES) -> Floats:
    """Where the objects' frames are along these axes in states (N, n), shape (N, k, len(axes))."""
    links = {joint.child for joint in scene.joints}
    places = []
    for name in (body.name for body in scene.bodies if body.role == "object"):
        if name in links:
            places.append(np.array([scene.unpack(state)[name]["position"] for state in states]))
        else:
            places.append(states[:, scene.slice(name)][:, :3])
    return np.stack(places, axis=1)[..., axis_numbers(axes)]


def plane_for(scene: Scene, states: Floats) -> Plan:
    """The plane that shows most of these states, shape (N, n).

    If no body can move along one of the axes, the plane across it. Otherwise one in which the robot
    covers little of the objects, as the fingers of a hand and not its palm; of these the one of the
    two axes along which the objects get about most or, where they stay, along which the moving
    bodies are longest.
    """
    moving = [body for body in scene.bodies if not (body.fixed or isinstance(body.shape, Plane))]
    locked = np.array([np.asarray(body.linear_factor) == 0.0 for body in moving]).all(axis=0)
    if locked.sum() == 1:
        return ACROSS[int(locked.argmax())]
    spread = object_centers(scene, states).std(axis=0).max(axis=0)
    if spread.max() < STILL:
        names = {body.name for body in moving if body.role != "none"}
        corners = _corners(scene, states[0], AXES, names)
        spread = np.ptp(np.concatenate(list(corners.values())), axis=0)
    covered = np.array([_covered(scene, states[0], plane) for plane in ACROSS])
    least = np.where(covered <= covered.min() + COVERED, spread * PREFERENCE, np.inf)
    return ACROSS[int(least.argmin())]


def _covered(scene: Scene, state: Floats, plane: Plan) -> float:
    """How much of the objects' area the robot covers, or is covered by, in a plane: 0 to 1."""
    poses = body_poses(scene, state)
    outlines: dict[str, list[Floats]] = {"object": [], "effector": []}
    for body in scene.bodies:
        if body.role != "none" and not isinstance(body.shape, Plane):
            outlines[body.role] += outlines_of(body.shape, poses[body.name], plane)
    shares = (np.arange(GRID) + 0.5) / GRID
    grid = np.stack(np.meshgrid(shares, shares), axis=-1).reshape(-1, 2)
    points = np.empty((0, 2))
    for outline in outlines["object"]:
        filled = grid * np.ptp(outline, axis=0) + outline.min(axis=0)
        points = np.concatenate([points, filled[Path(outline).contains_points(filled)]])
    hidden = [Path(outline).contains_points(points) for outline in outlines["effector"]]
    return float(np.any(hidden, axis=0).mean()) if hidden and len(points) else 0.0


def view_of(scene: Scene, states: Floats, plane: Plan, around: float = AROUND) -> Limits:
    """A view of all that moves in these states, shape (N, n), and `around` it, in its lengths."""
    points = seen_corners(scene, states, plane)
    low, high = points.min(axis=0), points.max(axis=0)
    more = around * float((high - low).max())
    (x0, y0), (x1, y1) = low - more, high + more
    return (float(x0), float(x1)), (float(y0), float(y1))


def seen_corners(scene: Scene, states: Iterable[Floats], axes: Sequence[str]) -> Floats:
    """Corners of what a view of these states has to show, along k axes; shape (N, k).

    Objects and free effectors are shown whole. Fixed and jointed ones, such as a mast or an arm,
    are cut off where they reach far beyond those, and left out where they are far away.
    """
    links = {joint.child for joint in scene.joints}
    robot = {body.name for body in scene.bodies if body.role == "effector"}
    held = robot & (links | {body.name for body in scene.bodies if body.fixed})
    shown = {body.name for body in scene.bodies if body.role != "none"}
    of_states = [_corners(scene, state, axes, shown) for state in states]
    corners = {name: np.concatenate([of[name] for of in of_states]) for name in of_states[0]}
    whole = np.concatenate([points for name, points in corners.items() if name not in held])
    low, high = whole.min(axis=0), whole.max(axis=0)
    reach = REACH * float((high - low).max())
    cut = [np.clip(corners[name], low - reach, high + reach) for name in corners if name in held]
    near = [points for points in cut if (np.ptp(points, axis=0) > 0).all()]
    return np.asarray(np.concatenate([whole, *near]))


def _corners(
    scene: Scene, state: Floats, axes: Sequence[str], names: Collection[str]
) -> dict[str, Floats]:
    """Those of some bodies in a state, and their centres, along k axes; shapes (N, k)."""
    poses, corners = body_poses(scene, state), {}
    for body in scene.bodies:
        if body.name in names and not isinstance(body.shape, Plane):
            points = np.concatenate([np.zeros((1, 3)), *shape_parts(body.shape)])
            corners[body.name] = placed(points, poses[body.name], axes)
    return corners


def _outline(points: Floats) -> Floats:
    """The hull of points (N, 2), or the line that they are on."""
    try:
        return np.asarray(points[Hull(points).vertices])
    except QhullError:
        along = points - points.mean(axis=0)
        far = along @ along[np.linalg.norm(along, axis=1).argmax()]
        return points[[far.argmin(), far.argmax()]]
