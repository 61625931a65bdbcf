"""Origins of a URDF file that look misplaced: in degrees or millimetres, or beside what is seen."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from energymargin.plausibility import warn
from energymargin.scenes.poses import Pose, from_rpy

TURN = 6.2832  # rad; a full turn, with room for a rounded 2 pi
FARTHEST = 20.0  # m; no part of a robot is farther from the one before it
# Shapes and pictures that are the same differ by less, in m and rad: files are rounded.
BESIDE = 1e-3
TURNED = 1e-2


def warn_of_origins(path: Path, robot: ET.Element) -> None:
    """Warns of each origin of joints, inertias and collision shapes that looks misplaced.

    An element that is malformed is passed over: it is an error elsewhere.
    """
    warnings = [
        (f"{path}: {about}", f"{path.name}: {about} {text}") for about, text in _warnings(robot)
    ]
    warn(warnings, str(path))


def _warnings(robot: ET.Element) -> Iterator[tuple[str, str]]:
    for link in robot.iterfind("link"):
        name = f"link {link.get('name', '')!r}"
        for inertial in link.iterfind("inertial"):
            yield from _of_units(f"{name}, inertial:", inertial)
        for collision in link.iterfind("collision"):
            yield from _of_units(f"{name}, collision:", collision)
            yield from _beside_visual(name, collision, link.findall("visual"))
    for joint in robot.iterfind("joint"):
        yield from _of_units(f"joint {joint.get('name', '')!r}:", joint)


def _of_units(where: str, element: ET.Element) -> Iterator[tuple[str, str]]:
    origin = element.find("origin")
    xyz, rpy = _numbers(origin, "xyz"), _numbers(origin, "rpy")
    if rpy is not None and max(map(abs, rpy)) > TURN:
        yield (
            f"{where} rpy",
            f"is {_text(rpy)} rad, beyond a full turn: was it meant in degrees?",
        )
    if xyz is not None and max(map(abs, xyz)) > FARTHEST:
        yield f"{where} xyz", f"is {_text(xyz)} m: lengths are in metres; was it in millimetres?"


def _beside_visual(
    name: str, collision: ET.Element, visuals: Sequence[ET.Element]
) -> Iterator[tuple[str, str]]:
    """A collision shape has the same form as what is seen, and yet another place or scale."""
    form, scale = _form(collision)
    same = [visual for visual in visuals if form and _form(visual)[0] == form]
    if not same:
        return
    if all(_form(visual)[1] != scale for visual in same):
        yield (
            f"{name}, collision: scale",
            f"is {scale or '1'}, and that of the same mesh in <visual> {_form(same[0])[1] or '1'}: "
            "the one in <collision> is simulated.",
        )
    pose = _pose(collision)
    others = [other for visual in same if (other := _pose(visual)) is not None]
    if pose is not None and others and not any(_near(pose, other) for other in others):
        origin = collision.find("origin")
        yield (
            f"{name}, collision: origin",
            f"is xyz {_text(_numbers(origin, 'xyz'))} rpy {_text(_numbers(origin, 'rpy'))}, and "
            "the same shape in <visual> is elsewhere: the one in <collision> is simulated.",
        )


def _form(element: ET.Element) -> tuple[tuple[str, ...], str]:
    """What a shape is, and its scale; nothing where the file does not say."""
    for shape in element.iterfind("geometry/*"):
        if shape.tag == "mesh":
            return ("mesh", shape.get("filename", "")), " ".join(shape.get("scale", "").split())
        sizes = (shape.get(key, "") for key in ("size", "radius", "length"))
        return (shape.tag, *(" ".join(size.split()) for size in sizes)), ""
    return (), ""


def _pose(element: ET.Element) -> Pose | None:
    origin = element.find("origin")
    xyz, rpy = _numbers(origin, "xyz"), _numbers(origin, "rpy")
    return None if xyz is None or rpy is None else from_rpy(xyz, rpy)


def _near(a: Pose, b: Pose) -> bool:
    turned = math.sqrt(0.5) * float(np.linalg.norm(a[:3, :3] - b[:3, :3]))  # chord of the angle
    return bool(np.linalg.norm(a[:3, 3] - b[:3, 3]) <= BESIDE and turned <= TURNED)


def _numbers(origin: ET.Element | None, name: str) -> tuple[float, float, float] | None:
    """Three of an origin, 0 where it has none; None if they are malformed."""
    words = ("0 0 0" if origin is None else origin.get(name, "0 0 0")).split()
    try:
        values = [float(word) for word in words]
    except ValueError:
        return None
    if len(values) != 3 or not all(map(math.isfinite, values)):
        return None
    return values[0], values[1], values[2]


def _text(numbers: Sequence[float] | None) -> str:
    return "(" + ", ".join(f"{number:.6g}" for number in numbers or ()) + ")"
