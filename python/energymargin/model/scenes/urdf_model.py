"""From a URDF file to a tree of links, their shapes and the joints between them.

Links without mass are frames: what they carry becomes part of the link they are fixed to. Those
that a joint moves get a small mass.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Mimic
from energymargin.model.scenes.additions import GYRATION, NEGLIGIBLE, FileMistakes
from energymargin.model.scenes.poses import Pose
from energymargin.model.scenes.urdf_elements import MIMIC, checked, reached
from energymargin.model.scenes.urdf_parts import Geometry, Joint, Link, MeshFile, joint_of, link_of

AT_THE_END = 1e-3  # share of the robot, mass of a link without one that a joint moves, and no other


@dataclass(eq=False)
class Robot:
    """A tree of links, by name; joints are in the file's order."""

    root: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    free: bool = False
    """Whether its root can move."""
    base: Pose = field(default_factory=lambda: np.eye(4))
    """The root link, in the frame of the file's root link."""
    merged: dict[str, tuple[str, Pose]] = field(default_factory=dict)
    """Frames that are part of another link, and of which."""
    loose: tuple[str, ...] = ()
    """Joints that follow no other, since their <mimic> is left out."""
    left_out: Counter[str] = field(default_factory=Counter)
    """Elements and attributes, by name."""
    moved: list[str] = field(default_factory=list)
    """Links that can move, parents first."""
    stated: dict[str, str] = field(default_factory=dict)
    """By link, the mass or the inertia that the file does not have."""
    opened: set[str] = field(default_factory=set)
    """Links with meshes that are not closed."""
    hulls: set[str] = field(default_factory=set)
    """Links with meshes that are not convex, and collide as their hulls."""

    def meshes(self) -> dict[str, None]:
        """The names of all mesh files."""
        shapes = [shape for link in self.links.values() for shape, _ in link.geometries]
        return {shape.filename: None for shape in shapes if isinstance(shape, MeshFile)}

    def merge_frames(self, mistakes: FileMistakes, *, free: bool, dense: bool) -> None:
        """Merges links without mass into those that carry them.

        A `free` robot whose root has no mass has its base in the link that is fixed to the root, if
        there is one. `dense`: links without a mass have that of their shapes, where they have any.
        Raises TimeoutError or Cancelled at the limit.
        """
        self.free, links = free, self.links.items()
        of_shapes = {name: link for name, link in links if not link.mass and link.geometries}
        if dense:
            self.links |= {name: replace(link, dense=True) for name, link in of_shapes.items()}
        below: dict[str, list[Joint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            below[joint.parent].append(joint)
        joints = list(self.joints.values())
        carriers = self._root_frames(below) if free else {self.root: np.eye(4)}
        places = {name: (self.root, at) for name, at in carriers.items()}
        new = list(places)
        while new:
            above = new.pop()
            carrier, at = places[above]
            for joint in below[above]:
                mistakes.limit.require(f"link {joint.child!r} was placed")
                if joint.child in places:
                    continue
                origin = joint.origin if carrier == above else at @ joint.origin
                new.append(joint.child)
                if joint.type == "fixed" and self.links[joint.child].frame:
                    del self.joints[joint.name]
                    places[joint.child] = (carrier, origin)
                    continue
                self.joints[joint.name] = replace(joint, parent=carrier, origin=origin)
                places[joint.child] = (joint.child, np.eye(4))
        every = (*carriers, *(joint.child for joint in joints))
        frames = [name for name in every if places[name][0] != name]
        self.merged = {name: places[name] for name in frames}
        self._carry(mistakes)
        moved = {joint.child for joint in self.joints.values()} | ({self.root} if free else set())
        self.moved = [name for name in places if name in moved]  # parents first

    def _root_frames(self, below: dict[str, list[Joint]]) -> dict[str, Pose]:
        """Frames of a root without mass, and the link that carries them, which is the root then;
        each with its pose there."""
        places = {self.root: np.eye(4)}
        while self.links[self.root].frame:
            fixed = [joint for joint in below[self.root] if joint.type == "fixed"]
            if len(fixed) != 1:
                break
            joint = self.joints.pop(fixed[0].name)
            back = np.asarray(np.linalg.inv(joint.origin), float)
            places = {name: back @ at for name, at in places.items()} | {joint.child: np.eye(4)}
            self.root, self.base = joint.child, self.base @ joint.origin
        return places

    def _carry(self, mistakes: FileMistakes) -> None:
        """Links carry from now on what frames did, which are poses in them."""
        shapes: dict[str, list[Geometry]] = {}
        for name, (into, at) in self.merged.items():
            frame, link = self.links.pop(name), self.links[into]
            if frame.geometries:
                if (link.geometries or into in shapes) and link.contact != frame.contact:
                    mistakes.add(
                        f"link {name!r} has no mass and is part of {into!r}, which has another "
                        "friction; with a mass it is a body of its own, ignore=('link/contact',) "
                        "and frictions={...} say which one holds"
                    )
                own = shapes.setdefault(into, list(link.geometries))
                own += [Geometry(shape, at @ pose) for shape, pose in frame.geometries]
                self.links[into] = replace(link, contact=frame.contact)
        for name, geometries in shapes.items():
            self.links[name] = replace(self.links[name], geometries=tuple(geometries))

    def weigh(self, masses: Mapping[str, float]) -> None:
        """Gives each link that can move a mass: that of its shapes, `masses`, or a small one."""
        for name, mass in masses.items():
            self.links[name] = replace(self.links[name], mass=mass, dense=mass > 0.0)
        for name in self.moved:
            if self.links[name].mass == 0.0:
                self._state_mass(name)

    def _state_mass(self, name: str) -> None:
        """Gives a link a mass that changes nothing, or little if nothing hangs on it."""
        pairs = [(joint.parent, joint.child) for joint in self.joints.values()]
        hanging = sum(self.links[link].mass for link in reached(name, pairs))
        given = [link.mass for name, link in self.links.items() if name not in self.stated]
        whole = sum(given) or 1.0  # kg
        mass = NEGLIGIBLE * hanging or AT_THE_END * whole
        inertia = mass * GYRATION**2 * np.eye(3)
        self.links[name] = replace(self.links[name], mass=mass, inertia=inertia)
        self.stated[name] = f"{mass:.3g} kg"


def read(path: Path, ignore: Collection[str], mistakes: FileMistakes, subtree: str | None) -> Robot:
    """The model of a file, or of one link and what hangs on it, with its frames.

    What is wrong with links and joints that does not keep the model from being made is in
    `mistakes`; so is what is not simulated.

    Raises FileNotFoundError, ValueError that names all that is wrong, or what is not simulated, and
    TimeoutError or Cancelled at the limit.
    """
    element, left_out, loose = checked(path, ignore, mistakes, subtree)
    links = _by_name("link", link_of, element.findall("link"), mistakes)
    joints = _by_name("joint", joint_of, element.findall("joint"), mistakes)
    mistakes.limit.require(f"{path} was read")
    mistakes.check(features=False)
    root, followed = _root(links, joints, mistakes), _followed(joints, mistakes)
    mistakes.check(features=False)
    return Robot(root, links, followed, loose=loose, left_out=left_out)


def _by_name(
    what: str, make: Callable[[ET.Element], Any], elements: list[ET.Element], mistakes: FileMistakes
) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for element in elements:
        with mistakes.listed():
            item = make(element)
            if item.name in found:
                raise ValueError(f"there are two {what}s {item.name!r}, expected one of each name")
            found[item.name] = item
    return found


def _root(links: dict[str, Link], joints: dict[str, Joint], mistakes: FileMistakes) -> str:
    """The link that no joint carries, if all others hang on it; lists what is wrong."""
    carried: dict[str, str] = {}
    for joint in joints.values():
        for of, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                known = ", ".join(links)
                mistakes.add(f"joint {joint.name!r} has the {of} {link!r}, expected one of {known}")
        if joint.child in carried:
            wrong = f"joints {carried[joint.child]!r} and {joint.name!r} both carry {joint.child!r}"
            mistakes.add(f"{wrong}, expected one: loops are not simulated")
        carried[joint.child] = joint.name
    roots = [name for name in links if name not in carried]
    if len(roots) != 1:
        mistakes.add(f"the robot has {len(roots)} root links, expected one: {roots}")
        return ""
    hanging = reached(roots[0], [(joint.parent, joint.child) for joint in joints.values()])
    for name in links:
        if name not in hanging:
            mistakes.add(f"the joints above link {name!r} form a loop, expected a tree")
    return roots[0]


def _followed(joints: dict[str, Joint], mistakes: FileMistakes) -> dict[str, Joint]:
    """The joints, each mimic joint with the moving joint at the end of its chain."""
    followed = dict(joints)
    for name, joint in joints.items():
        mistakes.limit.require(f"joint {name!r} was read")
        if joint.mimic:
            with mistakes.listed():
                followed[name] = replace(joint, mimic=_source(joint, joints))
    return followed


def _source(joint: Joint, joints: dict[str, Joint]) -> Mimic:
    seen, multiplier, offset, at = {joint.name}, 1.0, 0.0, joint
    if joint.type == "fixed":
        raise ValueError(f"joint {joint.name!r} is fixed, and yet a mimic; expected one of the two")
    while at.mimic is not None:
        name = at.mimic.joint
        offset += multiplier * at.mimic.offset
        multiplier *= at.mimic.multiplier
        if name not in joints or joints[name].type == "fixed" or name in seen:
            raise ValueError(
                f"joint {at.name!r} mimics {name!r}, expected one that moves, without a circle, "
                f"below the root of a subtree; ignore=({MIMIC!r},) makes each one of its own"
            )
        seen.add(name)
        at = joints[name]
    return Mimic(at.name, multiplier, offset)
