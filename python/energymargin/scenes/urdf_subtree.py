"""A part of a URDF file: one link, what hangs on it, and the joints between."""

from __future__ import annotations

import xml.etree.ElementTree as ET

__all__ = ["keep_subtree"]


def keep_subtree(robot: ET.Element, root: str) -> None:
    """Takes the links and joints out of a robot that are not below the link `root`.

    A joint that hangs on no link of the file stays, for it is an error wherever it belongs. Raises
    ValueError that lists the links if there is none of that name.
    """
    links = [link.get("name", "") for link in robot.iterfind("link")]
    if root not in links:
        raise ValueError(f"subtree is {root!r}, expected one of the links {', '.join(links)}")
    kept = _below(root, robot)
    for link in robot.findall("link"):
        if link.get("name", "") not in kept:
            robot.remove(link)
    for joint in robot.findall("joint"):
        parent = _ends(joint)[0]
        if parent in links and parent not in kept:
            robot.remove(joint)


def _below(root: str, robot: ET.Element) -> set[str]:
    """The link and all that hang on it."""
    children: dict[str, list[str]] = {}
    for joint in robot.iterfind("joint"):
        parent, child = _ends(joint)
        children.setdefault(parent, []).append(child)
    reached, new = {root}, [root]
    while new:
        found = [child for child in children.get(new.pop(), []) if child not in reached]
        reached.update(found)
        new += found
    return reached


def _ends(joint: ET.Element) -> tuple[str, str]:
    """The links that a joint connects, parent and child; empty where the file does not say."""
    parent, child = joint.find("parent"), joint.find("child")
    return (
        "" if parent is None else parent.get("link", ""),
        "" if child is None else child.get("link", ""),
    )
