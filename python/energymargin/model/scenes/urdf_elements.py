"""The elements of a URDF file: parsed, and checked against what the library simulates.

What the library does not simulate is an error that names it; how things look is left out.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn
from energymargin.model.scenes.additions import FileMistakes
from energymargin.model.scenes.files import require_robot

# How many numbers an attribute holds, if not one; words are no numbers.
NUMBERS = {"xyz": (3,), "rpy": (3,), "size": (3,), "scale": (1, 3)}
WORDS = ("name", "version", "type", "link", "joint", "filename")
XACRO = "xacro"  # its elements make others, so they are never left out for want of a declaration
EXPRESSIONS = ("${", "$(")  # of xacro, in attributes
WAY_OUT = "expected a URDF file, which xacro makes of it"
LOOKS = ("visual", "material")
# What moves nothing, whatever it says: of Gazebo, ROS, Drake, MuJoCo, Isaac, and Bullet's solver.
MOVES_NOTHING = (
    *("transmission", "gazebo", "ros2_control", "sensor", "mujoco", "self_collision_checking"),
    *("joint_properties", "safety_controller", "calibration", "hardwareInterface", "verbose"),
    *("link/origin", "link/gravity", "self_collide", "audio_source", "link.type", "link.concave"),
    *("geometry.name", "mesh.name", "collision.concave", "joint.dont_collapse"),
    *("sdf", "geometry.sdf", "collision.sdf"),
    *("friction_anchor", "contact_cfm", "contact_erp", "limit.acceleration", "limit.jerk"),
)
MIMIC = "joint/mimic"
# By the root of a file of another format, the way out.
OTHER_ROOTS = {
    "mujoco": "; em.scenes.from_mjcf reads MJCF",
    "sdf": "; sdformat_urdf makes URDF of SDF",
    "COLLADA": "; em.mesh reads a mesh",
}
# Of Bullet.
SURFACE = ("rolling_friction", "spinning_friction", "restitution", "stiffness", "damping")
CONTACT = ("lateral_friction", "inertia_scaling", *SURFACE)
MAX_DEPTH = 100  # of nested elements; a shape is the fifth
# By attribute of an origin its unit, its most, and the unit in which it was meant if it is more.
UNITS = {
    "rpy": ("rad", 6.2832, "degrees"),  # a full turn, with room for a rounded 2 pi
    "xyz": ("m", 20.0, "millimetres"),  # no part of a robot is farther from the one before it
}


@dataclass(frozen=True)
class _Element:
    """Attributes that an element must and may have, and children: one, at most one, any number."""

    needs: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()
    one: tuple[str, ...] = ()
    maybe: tuple[str, ...] = ()
    many: tuple[str, ...] = ()

    @property
    def children(self) -> tuple[str, ...]:
        return (*self.one, *self.maybe, *self.many)


JOINTED = ("origin", "axis", "limit", "dynamics", "mimic")
GRAMMAR = {
    "robot": _Element(("name",), ("version",), many=("link", "joint")),
    "link": _Element(("name",), maybe=("inertial", "contact"), many=("collision",)),
    "inertial": _Element(one=("mass",), maybe=("origin", "inertia")),
    "mass": _Element(("value",)),
    "inertia": _Element(("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
    "origin": _Element(takes=("xyz", "rpy")),
    "collision": _Element(takes=("name",), one=("geometry",), maybe=("origin",)),
    "geometry": _Element(maybe=("box", "sphere", "cylinder", "mesh")),
    "box": _Element(("size",)),
    "sphere": _Element(("radius",)),
    "cylinder": _Element(("radius", "length")),
    "mesh": _Element(("filename",), ("scale",)),
    "contact": _Element(maybe=CONTACT),
    **dict.fromkeys(CONTACT, _Element(("value",))),
    "joint": _Element(("name", "type"), one=("parent", "child"), maybe=JOINTED),
    "parent": _Element(("link",)),
    "child": _Element(("link",)),
    "axis": _Element(("xyz",)),
    "limit": _Element(takes=("lower", "upper", "effort", "velocity")),
    "dynamics": _Element(takes=("damping", "friction")),
    "mimic": _Element(("joint",), ("multiplier", "offset")),
}


def checked(
    path: Path, ignore: Collection[str], mistakes: FileMistakes, subtree: str | None
) -> tuple[ET.Element, Counter[str], tuple[str, ...]]:
    """The root of a URDF file, without what is not simulated, which `mistakes` counts.

    Beside it what else is left out, by name: what is to be ignored, what moves nothing, and what
    has a namespace that the file does not declare. And the names of the joints whose <mimic> is
    left out. Warns of origins that look misplaced.

    `subtree`: the link that is kept with all that hangs on it; other links and joints are not read.
    `ignore`: elements by tag or by "parent/tag", attributes as "tag.attribute" or
    "parent/tag.attribute"; what is simulated somewhere is ignored with its parent alone.
    Raises FileNotFoundError, ValueError that names all that is wrong or not simulated, and
    TimeoutError or Cancelled at the limit.
    """
    _require_places(ignore)
    require_robot(path)
    root, declared = parsed(path, mistakes.limit)
    if root.tag != "robot":
        way = OTHER_ROOTS.get(root.tag, "")
        raise ValueError(f"{path} is no URDF file: its root is <{root.tag}>, expected <robot>{way}")
    if subtree is not None:
        keep_subtree(root, subtree)
    loose = tuple(joint.get("name", "") for joint in root.iterfind("joint[mimic]"))
    left_out: Counter[str] = Counter()
    _strip(root, "", {*LOOKS, *MOVES_NOTHING, *ignore}, declared, left_out)
    _strip_repeated(root, left_out)
    _walk(root, "robot", mistakes)
    mistakes.check(features=False)
    if mistakes.features:
        _strip(root, "", set(mistakes.features), declared, Counter())
    warn(_units(path, root), str(path))
    return root, left_out, loose if MIMIC in ignore else ()


def _require_places(ignore: Collection[str]) -> None:
    """Raises ValueError on a name without its parent that would leave out what is simulated."""
    for name in ignore:
        tag, _, attribute = name.partition(".")
        rule = GRAMMAR.get(tag)
        if rule is None or (attribute and attribute not in (*rule.needs, *rule.takes)):
            continue
        parents = [f"<{parent}>" for parent, of in GRAMMAR.items() if tag in of.children]
        wrong = f"ignore has {name!r}, which is simulated in {', '.join(parents) or 'each file'}"
        expected = f"expected 'parent/{name}', which leaves it out in that parent alone"
        raise ValueError(f"{wrong}; {expected}")


def _strip(
    element: ET.Element, parent: str, names: set[str], declared: set[str], left_out: Counter[str]
) -> None:
    """Takes out elements and attributes by their names, and those of namespaces that the file does
    not declare, which it counts; and what asks for nothing."""

    def goes(name: str, what: str, place: str) -> bool:
        found = next((one for one in (what, f"{place}/{what}") if one in names), "")
        if not found and _prefix(name) not in declared:
            found = what
        if found and found not in LOOKS:
            left_out[found] += 1
        return bool(found)

    for name, text in list(element.attrib.items()):
        turned = (element.tag, name) != ("axis", "rpy") or any(_floats(text) or "?")
        if goes(name, f"{element.tag}.{name}", parent) or not turned:
            del element.attrib[name]
    for child in list(element):
        shaped = child.tag == "collision" and child.find("geometry/*") is not None
        if goes(child.tag, child.tag, element.tag):
            element.remove(child)
            continue
        _strip(child, element.tag, names, declared, left_out)
        if shaped and child.find("geometry/*") is None:
            element.remove(child)


def _strip_repeated(element: ET.Element, left_out: Counter[str]) -> None:
    """Takes out elements that say again what one before them says, where there is one at most."""
    rule = GRAMMAR.get(element.tag, _Element())
    said: set[bytes] = set()
    for child in list(element):
        text = ET.tostring(child)
        if child.tag in (*rule.one, *rule.maybe) and text in said:
            element.remove(child)
            left_out[f"{element.tag}/{child.tag}"] += 1
            continue
        said.add(text)
        _strip_repeated(child, left_out)


def _prefix(name: str) -> str:
    return name.rpartition(":")[0] or "xml"


def _floats(text: str) -> list[float] | None:
    """The numbers of an attribute; None if one of its words is no number."""
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return None


def _walk(element: ET.Element, where: str, mistakes: FileMistakes) -> None:
    """Lists what is not known below an element, and what is wrong there."""
    rule = GRAMMAR[element.tag]
    for name in rule.needs:
        if name not in element.attrib:
            mistakes.add(f"{where}: <{element.tag}> has no {name!r}")
    for name, text in element.attrib.items():
        if any(mark in text for mark in EXPRESSIONS):
            attribute = f"<{element.tag} {name}={text!r}>"
            mistakes.add(f"{where}: {attribute} is an expression of xacro: {WAY_OUT}")
        elif name not in (*rule.needs, *rule.takes):
            mistakes.features[f"{element.tag}.{name}"] += 1
        elif name not in WORDS:
            _check_numbers(element.tag, name, text, where, mistakes)
    _check_counts(element, rule, where, mistakes)
    for child in element:
        if _prefix(child.tag) == XACRO:
            mistakes.add(f"{where}: <{child.tag}> is of xacro: {WAY_OUT}")
        elif child.tag in rule.children:
            named = child.tag in ("link", "joint")
            _walk(child, f"{child.tag} {child.get('name')!r}" if named else where, mistakes)
        else:
            misplaced = child.tag in GRAMMAR  # the same tag is simulated elsewhere
            mistakes.features[f"{element.tag}/{child.tag}" if misplaced else child.tag] += 1


def _check_counts(element: ET.Element, rule: _Element, where: str, mistakes: FileMistakes) -> None:
    counts = Counter(child.tag for child in element)
    for tag in (*rule.one, *rule.maybe):
        if counts[tag] > 1 or (tag in rule.one and not counts[tag]):
            way = f"; ignore=('{element.tag}/{tag}',) leaves them out" if tag in rule.maybe else ""
            mistakes.add(f"{where}: <{element.tag}> has {counts[tag]} <{tag}>, expected one{way}")
    if element.tag == "geometry" and len(element) != 1:
        mistakes.add(f"{where}: <geometry> has {len(element)} shapes, expected one")


def _check_numbers(tag: str, name: str, text: str, where: str, mistakes: FileMistakes) -> None:
    counts = NUMBERS.get(name, (1,))
    values = _floats(text) or []
    if len(values) not in counts or not all(map(math.isfinite, values)):
        expected = " or ".join({1: "one finite number", 3: "three"}[n] for n in counts)
        mistakes.add(f"{where}: <{tag} {name}={text!r}>, expected {expected}")


def _units(path: Path, robot: ET.Element) -> Iterator[tuple[str, str]]:
    """Yields, for `warn`, each origin that looks like one in degrees or in millimetres."""
    for item in robot:
        for place in item.iter():
            part = "" if place is item else f", {place.tag}"
            where = f"{item.tag} {item.get('name')!r}{part}:"
            for origin in place.findall("origin"):
                for name, (unit, most, other) in UNITS.items():
                    text, about = origin.get(name, "0"), f"{where} {name}"
                    if max(abs(float(word)) for word in text.split()) > most:
                        expected = f"expected at most {most:.4g}: was it meant in {other}?"
                        yield about, f"{path.name}: {about} is '{text}' {unit}, {expected}"


def parsed(path: Path, limit: Limit) -> tuple[ET.Element, set[str]]:
    """The root of a file's elements, with attributes and without text, and the prefixes of the
    namespaces that the file declares. Names keep their prefixes: ElementTree's own parser refuses
    those that are not declared.

    Raises FileNotFoundError, ValueError if the file is no XML or its elements are nested deeper
    than `MAX_DEPTH`, and TimeoutError or Cancelled at the limit.
    """
    builder, parser = ET.TreeBuilder(), expat.ParserCreate()
    declared, depth = {"xml", XACRO}, 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        limit.require(f"{path} was read")
        if depth > MAX_DEPTH:
            raise ValueError(
                f"{path} has elements nested deeper than {MAX_DEPTH} in line "
                f"{parser.CurrentLineNumber}, expected a URDF file: a shape is the fifth"
            )
        depth += 1
        spaces = [key for key in attributes if f"{key}:".startswith("xmlns:")]
        declared.update(key.removeprefix("xmlns:") for key in spaces)
        builder.start(name, {key: attributes[key] for key in attributes if key not in spaces})

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(name)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    try:
        parser.Parse(path.read_bytes().lstrip(), True)
    except (expat.ExpatError, LookupError) as error:  # LookupError: an unknown encoding
        raise ValueError(f"{path} is no XML file: {error}") from error
    return builder.close(), declared


def keep_subtree(robot: ET.Element, root: str) -> None:
    """Takes the links and joints out of a robot that are not below the link `root`.

    A joint that hangs on no link of the file stays, for it is an error wherever it belongs. Raises
    ValueError that lists the links if there is none of that name.
    """
    links = [link.get("name", "") for link in robot.iterfind("link")]
    if root not in links:
        raise ValueError(f"subtree is {root!r}, expected one of the links {', '.join(links)}")
    joints = [(joint, end_of(joint, "parent")) for joint in robot.findall("joint")]
    kept = reached(root, [(parent, end_of(joint, "child")) for joint, parent in joints])
    for link in robot.findall("link"):
        if link.get("name", "") not in kept:
            robot.remove(link)
    for joint, parent in joints:
        if parent in links and parent not in kept:
            robot.remove(joint)


def reached(root: str, pairs: Sequence[tuple[str, str]]) -> set[str]:
    """A link and all that hang on it; `pairs`: the parent and the child of each joint."""
    below: dict[str, list[str]] = {}
    for parent, child in pairs:
        below.setdefault(parent, []).append(child)
    found, new = {root}, [root]
    while new:
        more = set(below.get(new.pop(), ())) - found
        found |= more
        new += more
    return found


def end_of(joint: ET.Element, end: str) -> str:
    """The link that is the "parent" or the "child" of a joint; empty if the file does not say."""
    element = joint.find(end)
    return "" if element is None else element.get("link", "")
