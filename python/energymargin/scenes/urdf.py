"""Robots from URDF: links of one primitive shape each, and the joints between them.

A link's body has its frame at the centre of its shape. Inertias follow from the shapes and the
masses, so the file's own have to agree with them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Box, Cylinder, Scene, Sphere

__all__ = ["add_urdf", "data_file"]

JOINT_TYPES = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
}


@dataclass(frozen=True)
class _Pose:
    position: NDArray[np.float64]
    """Shape (3,) [m]."""
    orientation: NDArray[np.float64]
    """Unit quaternion x, y, z, w."""

    def __matmul__(self, inner: _Pose) -> _Pose:
        """A pose in this one's frame, as seen from outside."""
        return _Pose(
            self.position + _turned(self.orientation, inner.position),
            _product(self.orientation, inner.orientation),
        )

    def inverse(self) -> _Pose:
        """The outside as seen from this pose."""
        back = self.orientation * [-1, -1, -1, 1]
        return _Pose(-_turned(back, self.position), back)


@dataclass(frozen=True)
class _Link:
    shape: Box | Cylinder | Sphere
    mass: float
    center: _Pose
    """Of the shape, in the link's frame."""


def data_file(name: str) -> Path:
    """A file of the package's `data` folder.

    Raises FileNotFoundError if there is none of that name.
    """
    package = Path(__file__).parents[1]
    for folder in (package / "data", package.parents[1] / "data"):  # installed, or in a checkout
        if (folder / name).is_file():
            return folder / name
    raise FileNotFoundError(f"energymargin has no data file {name!r}")


def add_urdf(
    scene: Scene,
    path: str | Path,
    *,
    position: Sequence[float] = (0.0, 0.0, 0.0),
    orientation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
    friction: float = 0.5,
    role: str = "none",
    joints: Mapping[str, Mapping[str, Any]] | None = None,
) -> None:
    """Adds a robot to a scene, with its root link fixed.

    Bodies and joints have the names of the file. `position` [m] and `orientation` (unit quaternion
    x, y, z, w) are those of the root link's frame; `friction` and `role` those of all links.
    `joints`: keywords of `Scene.add_joint` by joint, such as stiffness, target or held. Raises
    FileNotFoundError, and ValueError that names what in the file is not understood; a scene that
    the robot does not fit into, for its names or its control, is left with a part of it.
    """
    root = _parse(Path(path))
    links = {name: _link(link) for name, link in _named(root, "link").items()}
    elements = _named(root, "joint")
    unknown = sorted(set(joints or {}) - set(elements))
    if unknown:
        raise ValueError(f"joints has {unknown[0]!r}, expected one of {', '.join(elements)}")
    base = _base(links, elements)
    connections = {name: _joint(element, links) for name, element in elements.items()}
    at = _Pose(_vector("position", position, 3), _vector("orientation", orientation, 4))
    for name, link in links.items():
        place = at @ link.center
        fixed = {"mass": 0.0, "position": place.position, "orientation": place.orientation}
        moving = {"mass": link.mass}
        scene.add_body(
            name, link.shape, **(fixed if name == base else moving), friction=friction, role=role
        )
    for name, keywords in connections.items():
        try:
            scene.add_joint(name, **{**keywords, **(joints or {}).get(name, {})})
        except TypeError as error:
            given = ", ".join((joints or {}).get(name, {}))
            raise ValueError(
                f"joints[{name!r}] has {given}, expected keywords of Scene.add_joint"
            ) from error


def _parse(path: Path) -> ET.Element:
    try:
        root = ET.parse(path).getroot()
    except ET.ParseError as error:
        raise ValueError(f"{path} is no XML file: {error}") from error
    if root.tag != "robot":
        raise ValueError(f"{path} is no URDF file: its root is <{root.tag}>, expected <robot>")
    known = {"link", "joint", "material"}
    for child in root:
        if child.tag not in known:
            raise ValueError(f"{path} has <{child.tag}>, expected only links and joints")
    return root


def _named(root: ET.Element, tag: str) -> dict[str, ET.Element]:
    """The elements of a tag, by name."""
    found: dict[str, ET.Element] = {}
    for element in root.findall(tag):
        name = _name(element)
        if name in found:
            raise ValueError(f"there are two <{tag}> of the name {name!r}, expected one")
        found[name] = element
    return found


def _base(links: Mapping[str, _Link], joints: Mapping[str, ET.Element]) -> str:
    """The link that is no joint's child."""
    children = {_attribute(_child(joint, "child"), "link") for joint in joints.values()}
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise ValueError(f"the robot has {len(roots)} root links, expected one: {roots}")
    return roots[0]


def _link(element: ET.Element) -> _Link:
    name = _name(element)
    collisions = element.findall("collision")
    if len(collisions) != 1:
        raise ValueError(f"link {name!r} has {len(collisions)} collision shapes, expected one")
    center = _pose(collisions[0])
    inertial = _child(element, "inertial")
    mass = _number(_child(inertial, "mass"), "value")
    shape, moments = _shape(_child(collisions[0], "geometry"), name, mass)
    placed = _pose(inertial)
    inertia = _child(inertial, "inertia")
    given = [_number(inertia, i) for i in ("ixx", "iyy", "izz")]
    if any(_number(inertia, i) for i in ("ixy", "ixz", "iyz")):
        raise ValueError(f"link {name!r} has products of inertia, expected 0: none of a primitive")
    same = np.allclose(placed.position, center.position) and np.allclose(
        placed.orientation, center.orientation
    )
    if not (same and np.allclose(given, moments, rtol=1e-3)):
        raise ValueError(
            f"link {name!r} has other inertial properties than its shape of even density: "
            f"moments {given}, expected {[float(f'{m:.4g}') for m in moments]} at the shape's place"
        )
    return _Link(shape, mass, center)


def _shape(
    geometry: ET.Element, link: str, mass: float
) -> tuple[Box | Cylinder | Sphere, NDArray[np.float64]]:
    """A primitive, and its principal moments of inertia."""
    if len(geometry) != 1:
        raise ValueError(f"link {link!r} has {len(geometry)} shapes in its geometry, expected one")
    (element,) = geometry
    if element.tag == "box":
        size = _numbers(element, "size")
        return Box(size), mass / 12 * ((size**2).sum() - size**2)
    if element.tag == "sphere":
        radius = _number(element, "radius")
        return Sphere(radius), np.full(3, 0.4 * mass * radius**2)
    if element.tag == "cylinder":
        radius, length = (_number(element, of) for of in ("radius", "length"))
        across = mass / 12 * (3 * radius**2 + length**2)
        return Cylinder(radius, length), np.array([across, across, mass / 2 * radius**2])
    raise ValueError(f"link {link!r} is a <{element.tag}>, expected a box, sphere or cylinder")


def _joint(element: ET.Element, links: Mapping[str, _Link]) -> dict[str, Any]:
    """Keywords of `Scene.add_joint`."""
    kind = JOINT_TYPES.get(_attribute(element, "type"))
    if kind is None:
        raise ValueError(
            f"joint {_name(element)!r} is {element.get('type')!r}, "
            f"expected one of {', '.join(JOINT_TYPES)}"
        )
    for tag in ("mimic", "dynamics", "safety_controller"):
        if element.find(tag) is not None:
            raise ValueError(f"joint {_name(element)!r} has <{tag}>, which is not supported")
    parent, child = (_attribute(_child(element, of), "link") for of in ("parent", "child"))
    for of, link in (("parent", parent), ("child", child)):
        if link not in links:
            known = ", ".join(links)
            raise ValueError(f"joint {_name(element)!r} has the {of} {link!r}, expected of {known}")
    in_parent = links[parent].center.inverse() @ _pose(element)
    in_child = links[child].center.inverse()
    keywords: dict[str, Any] = {
        "parent": parent,
        "child": child,
        "type": kind,
        "origin": in_parent.position,
        "orientation": in_parent.orientation,
        "child_origin": in_child.position,
        "child_orientation": in_child.orientation,
    }
    axis = element.find("axis")
    if axis is not None:
        keywords["axis"] = _numbers(axis, "xyz")
    elif kind != "fixed":
        keywords["axis"] = (1.0, 0.0, 0.0)  # URDF's default
    limit = element.find("limit")
    if limit is None and element.get("type") in ("revolute", "prismatic"):
        raise ValueError(f"joint {_name(element)!r} has no <limit>, which its type asks for")
    if limit is not None:
        if element.get("type") != "continuous":
            lower, upper = (_number(limit, of) for of in ("lower", "upper"))
            keywords["limits"] = (lower, upper)
            keywords["start"] = min(max(0.0, lower), upper)
        keywords["torque_limit"] = _number(limit, "effort")
    return keywords


def _pose(element: ET.Element) -> _Pose:
    """That of an element's <origin>."""
    origin = element.find("origin")
    if origin is None:
        return _Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    xyz = _numbers(origin, "xyz") if "xyz" in origin.attrib else np.zeros(3)
    roll, pitch, yaw = (_numbers(origin, "rpy") if "rpy" in origin.attrib else np.zeros(3)) / 2
    about_x = np.array([np.sin(roll), 0.0, 0.0, np.cos(roll)])
    about_y = np.array([0.0, np.sin(pitch), 0.0, np.cos(pitch)])
    about_z = np.array([0.0, 0.0, np.sin(yaw), np.cos(yaw)])
    return _Pose(xyz, _product(about_z, _product(about_y, about_x)))


def _product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternion product: first b, then a."""
    vector = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.append(vector, a[3] * b[3] - a[:3] @ b[:3])


def _turned(turn: NDArray[np.float64], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """A vector, turned by a unit quaternion."""
    twice = 2.0 * np.cross(turn[:3], vector)
    return np.asarray(vector + turn[3] * twice + np.cross(turn[:3], twice))


def _name(element: ET.Element) -> str:
    return _attribute(element, "name")


def _child(element: ET.Element, tag: str) -> ET.Element:
    found = element.find(tag)
    if found is None:
        raise ValueError(f"<{element.tag} name={element.get('name')!r}> has no <{tag}>")
    return found


def _attribute(element: ET.Element, name: str) -> str:
    value = element.get(name)
    if value is None:
        raise ValueError(f"<{element.tag}> has no {name!r}")
    return value


def _number(element: ET.Element, name: str) -> float:
    """A finite number of an attribute."""
    word = _attribute(element, name)
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"<{element.tag} {name}={word!r}> is not a finite number")
    return value


def _vector(name: str, given: Sequence[float], size: int) -> NDArray[np.float64]:
    """An argument of `size` finite numbers."""
    values = np.asarray(given, float)
    if values.shape != (size,) or not np.isfinite(values).all():
        raise ValueError(f"{name} is {given!r}, expected {size} finite numbers")
    return values


def _numbers(element: ET.Element, name: str) -> NDArray[np.float64]:
    """Three numbers of an attribute."""
    words = _attribute(element, name).split()
    try:
        values = np.array([float(word) for word in words])
    except ValueError as error:
        raise ValueError(f"<{element.tag} {name}={words}> is not three numbers") from error
    if values.shape != (3,):
        raise ValueError(f"<{element.tag} {name}={words}> is not three numbers")
    return values
