"""Links whose inertia, centre of mass or place contradicts their collision shapes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import LEAST_GYRATION, MOST_GYRATION, Inertial, mass_properties
from energymargin.base.aliases import Floats
from energymargin.base.plausibility import warn
from energymargin.model.scenes.additions import GYRATION, FileMistakes
from energymargin.model.scenes.corners import shape_parts
from energymargin.model.scenes.poses import of_point, place, tensor
from energymargin.model.scenes.urdf_model import Robot
from energymargin.model.scenes.urdf_parts import Link

OUTSIDE = 1.0  # of the shapes' extent, by which a centre of mass may be outside of their box
APART = 10.0  # of the larger of two links, by which a joint may hold them apart
# An inertia that differs by the first is that of the shapes, and from the second on another one.
SAME = 0.1
OTHER = 0.3

# What is wrong with links of a kind; the way out of wrong inertias is inertia='shapes'.
TOO_LARGE = (
    "more inertia than bodies of their mass and size can have: wrong units, or a placeholder"
)
TOO_SMALL = "the inertia of a point beside their size: wrong units, or a mesh in millimetres"
OTHER_AXES = (
    "the inertia of their shapes about other axes: is the rpy of the inertial's origin wrong"
)
ORIGIN = "the inertia of their shapes about the link's origin, expected about the centre of mass"
OUTSIDE_SHAPES = "a centre of mass far outside of their shapes: is an origin wrong"
FAR = "shapes far from their parent's: is the origin of the joint or of the collision wrong"
WAY_OUT = "inertia='shapes' takes the inertias from the shapes"

Found = Iterator[tuple[str, str, str]]
"""A kind of contradiction, a link, and what is wrong with this link."""


def moving_inertials(robot: Robot, mistakes: FileMistakes, inertia: str) -> dict[str, Inertial]:
    """By link that moves and has a mass, its inertia, unless the shapes have it (those of a
    density, and all with `inertia="shapes"`).

    Lists the links whose inertia is missing or impossible. With "shapes" a link without shapes has
    that of a radius of gyration of GYRATION then, and the robot's `stated` says so.
    """
    found, wrong = {}, []
    for name, link in robot.links.items():
        of_shapes = link.dense or (inertia == "shapes" and link.geometries)
        if (name == robot.root and not robot.free) or of_shapes or link.mass == 0.0:
            continue
        try:
            found[name] = _inertial(link, link.inertia)
        except ValueError as error:
            wrong.append(f"link {name!r}: {error}")
            if inertia == "shapes":
                found[name] = _inertial(link, link.mass * GYRATION**2 * np.eye(3))
                robot.stated[name] = f"a radius of gyration of {GYRATION} m"
    if wrong and inertia == "file":
        mistakes.add(f"{', '.join(wrong)}; inertia='shapes' takes it from the collision shapes")
    return found


def _inertial(link: Link, inertia: Any) -> Inertial:
    if inertia is None:
        raise ValueError("it has a mass and no <inertia>")
    frame = place(link.center)
    return Inertial(frame["position"], inertia=inertia, axes=frame["orientation"])


def warn_of_links(path: Path, robot: Robot, bodies: Mapping[str, Mapping[str, Any]]) -> None:
    """Warns once of each kind of contradiction, with the links that have it.

    `bodies`: by link, keywords of `Scene.add_body`. Only what cannot be meant is warned of: a link
    may reach beyond its collision shapes.
    """
    nothing = np.empty((0, 3))
    parts = {name: [nothing, *shape_parts(body["shape"])] for name, body in bodies.items()}
    points = {name: np.concatenate(own) for name, own in parts.items()}
    found: dict[str, list[str]] = {}
    for kind, link, text in (*_of_masses(bodies, points), *_of_places(robot, points)):
        found.setdefault(kind, []).append(f"{link!r} ({text})")
    texts = [
        (f"{path}: {kind}", f"{path.name} has links with {kind}? {', '.join(links)}. {WAY_OUT}.")
        for kind, links in found.items()
    ]
    warn(texts, f"{path} {found}")


def _of_masses(bodies: Mapping[str, Mapping[str, Any]], points: Mapping[str, Floats]) -> Found:
    for name, body in bodies.items():
        inertial, mass = body.get("inertial"), body["mass"]
        if inertial is None or not len(points[name]):
            continue
        center = np.asarray(inertial.center)
        low, high = points[name].min(axis=0), points[name].max(axis=0)
        extent = float((high - low).max())
        away = float(np.linalg.norm(np.maximum(0.0, np.maximum(low - center, center - high))))
        if away > OUTSIDE * extent:
            yield OUTSIDE_SHAPES, name, f"{away:.3g} m away from shapes of {extent:.3g} m"
        gyration = float(np.sqrt(0.5 * np.sum(inertial.moments) / mass))
        reach = float(np.linalg.norm(points[name] - center, axis=1).max())
        if gyration > MOST_GYRATION * reach:
            kind = TOO_LARGE
        elif gyration < LEAST_GYRATION * reach:
            kind = TOO_SMALL
        else:
            kind = _of_other_axes(body["shape"], mass, inertial)
        if kind:
            text = f"radius of gyration {gyration:.3g} m, shapes within {reach:.3g} m"
            yield kind, name, text


def _of_other_axes(shape: Any, mass: float, inertial: Inertial) -> str:
    """The kind of warning about an inertia that is that of the shapes, but for its axes."""
    solid = mass_properties(shape, mass)
    own = tensor(inertial.moments, inertial.axes)
    expected = tensor(solid.moments, solid.axes)
    if not solid.volume > 0.0 or _difference(own, expected) < OTHER:
        return ""
    if _difference(np.sort(inertial.moments), np.sort(solid.moments)) < SAME:
        return OTHER_AXES
    moved = expected + of_point(mass, np.asarray(inertial.center))
    return ORIGIN if _difference(own, moved) < SAME else ""


def _difference(own: Floats, expected: Floats) -> float:
    return float(np.linalg.norm(own - expected) / np.linalg.norm(expected))


def _of_places(robot: Robot, points: Mapping[str, Floats]) -> Found:
    """Links that are far from those they hang on, with all joints at 0."""
    for joint in robot.joints.values():
        child, parent = points[joint.child], points[joint.parent]
        if not len(child) or not len(parent):
            continue
        child = child @ joint.origin[:3, :3].T + joint.origin[:3, 3]
        boxes = [(part.min(axis=0), part.max(axis=0)) for part in (child, parent)]
        (low, high), (other_low, other_high) = boxes
        gap = float(np.linalg.norm(np.maximum(0.0, np.maximum(low - other_high, other_low - high))))
        largest = max(float((high - low).max()) for low, high in boxes)
        if gap > APART * largest:
            text = f"{gap:.3g} m from {joint.parent!r} by joint {joint.name!r}"
            yield FAR, joint.child, text
