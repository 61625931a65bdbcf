"""Checks of a DAE file, which may be a stranger's, before it is read: it stays as small as it is.

XML has entities that stand for others, a DAE file nodes that stand for others, again and again.
"""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from xml.parsers import expat

MOST_INSTANCES = 10_000  # of nodes and geometries, when those that stand for others are written out
INSTANCES = ("instance_node", "instance_geometry", "instance_controller")


def check_collada(path: Path) -> None:
    """Raises ValueError on entities, on counts beyond the file, on nodes that hold themselves, and
    on too many instances."""
    data = path.read_bytes()
    if not data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        raise ValueError("it is no XML, expected a DAE file that is not packed")
    nodes: dict[str, list[str]] = {"": []}  # by node, those and the geometries that it holds
    inner = [""]

    def start(tag: str, attributes: dict[str, str]) -> None:
        count = attributes.get("count", "0")
        if count.isdecimal() and int(count) > len(data):
            raise ValueError(f"<{tag}> has the count {count}, expected at most {len(data)}")
        if tag in INSTANCES and (of := attributes.get("url", "").removeprefix("#")):
            nodes[inner[-1]].append(of)
        if tag == "node":
            name = attributes.get("id") or f"node {len(nodes)}"
            nodes[inner[-1]].append(name)
            nodes.setdefault(name, [])
            inner.append(name)

    def end(tag: str) -> None:
        if tag == "node":
            inner.pop()

    def refuse(*_: object) -> None:
        raise ValueError("it declares a DOCTYPE, expected no entities")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise ValueError(f"it is no whole XML: {error}") from error
    _check_instances(nodes)


def _check_instances(nodes: dict[str, list[str]]) -> None:
    """Raises ValueError if nodes hold themselves, or too much."""
    sizes: dict[str, int] = {}
    try:
        order = list(TopologicalSorter(nodes).static_order())  # those that others hold come first
    except CycleError as error:
        raise ValueError(f"its node {error.args[1][0]!r} holds itself") from error
    for name in order:
        sizes[name] = 1 + sum(sizes[part] for part in nodes.get(name, ()))
        if sizes[name] > MOST_INSTANCES:
            raise ValueError(f"its nodes stand for more than {MOST_INSTANCES} instances")
