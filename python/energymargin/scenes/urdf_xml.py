"""From an XML file to a tree of elements."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import BinaryIO
from xml.parsers import expat

from energymargin.limits import Limit

__all__ = ["UNDECLARED", "parsed"]

MAX_DEPTH = 100  # of nested elements; a shape is the fifth
# Marks a name whose prefix the file does not declare; no name in XML begins so.
UNDECLARED = "?"
NAMESPACES = {"": "", "xml": "xml"}  # by prefix, where a file declares none


def parsed(path: Path, limit: Limit) -> ET.Element:
    """The root of a file's elements, with attributes and without text.

    A name in a namespace is "namespace:name", or `UNDECLARED` and "prefix:name" where the file
    declares none for its prefix. Raises FileNotFoundError, ValueError if the file is no XML or its
    elements are nested deeper than `MAX_DEPTH`, and TimeoutError or Cancelled at the limit.
    """
    try:
        with open(path, "rb") as file:
            return _Reader(path, limit).read(file)
    except (expat.ExpatError, LookupError) as error:  # LookupError: an unknown encoding
        raise ValueError(f"{path} is no XML file: {error}") from error


class _Reader:
    """Builds the tree as expat reads; expat itself would refuse a prefix without a declaration."""

    def __init__(self, path: Path, limit: Limit) -> None:
        self._path = path
        self._limit = limit
        self._builder = ET.TreeBuilder()
        self._scopes = [NAMESPACES]  # namespaces by prefix, of each element that is open
        self._tags: list[str] = []
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.DefaultHandlerExpand = self._other

    def read(self, file: BinaryIO) -> ET.Element:
        self._parser.ParseFile(file)
        return self._builder.close()

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._limit.require(f"{self._path} was read")
        if len(self._tags) == MAX_DEPTH:
            raise ValueError(
                f"{self._path} has elements nested deeper than {MAX_DEPTH} in line "
                f"{self._parser.CurrentLineNumber}, expected a URDF file: a shape is the fifth"
            )
        declared = {
            key.removeprefix("xmlns").removeprefix(":"): uri
            for key, uri in attributes.items()
            if key == "xmlns" or key.startswith("xmlns:")
        }
        scope = {**self._scopes[-1], **declared} if declared else self._scopes[-1]
        self._scopes.append(scope)
        self._tags.append(_full(name, scope))
        known = {
            _full(key, scope) if ":" in key else key: value
            for key, value in attributes.items()
            if key != "xmlns" and not key.startswith("xmlns:")
        }
        self._builder.start(self._tags[-1], known)

    def _end(self, _: str) -> None:
        self._builder.end(self._tags.pop())
        self._scopes.pop()

    def _other(self, text: str) -> None:
        if text.startswith("&"):  # of a document type that is not read
            raise ValueError(f"{self._path} is no XML file: undefined entity {text}")


def _full(name: str, scope: dict[str, str]) -> str:
    """A name with its namespace in place of its prefix."""
    prefix, _, rest = name.rpartition(":")
    if prefix not in scope:
        return UNDECLARED + name
    return f"{scope[prefix]}:{rest}" if scope[prefix] else rest
