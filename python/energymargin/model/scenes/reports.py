"""What the readers of files left out of a scene, left loose, or stated: its report."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import NamedTuple
from weakref import WeakKeyDictionary

from energymargin._core import Scene

LEFT_OUT = "left out"
UNDRIVEN = "joint undriven"
HOLDS = "joint holds its start"
EFFORT = "effort that does not count"
LOOSE = "body loose"
FRAME = "part of another body"
STATED = "stated"
TOUCHING = "overlap, touching"
APART = "overlap, never colliding"


class ReportRow(NamedTuple):
    """One thing that a reader did with a file."""

    what: str
    """As "left out", "joint undriven", "body loose" or "stated"."""
    name: str
    """Of an element of the file, a joint, a body, or two bodies."""
    value: str = ""
    """How many, how much, or how."""


class FrameRow(ReportRow):
    """A frame that is part of a body."""

    place: tuple[str, tuple[float, ...]]
    """The body, and the pose there: x, y, z [m] and a quaternion x, y, z, w."""

    @classmethod
    def of(cls, name: str, value: str, place: tuple[str, tuple[float, ...]]) -> FrameRow:
        """A row as others, with the place."""
        row = cls(FRAME, name, value)
        row.place = place
        return row


class SceneReport(tuple[ReportRow, ...]):
    """What was left out of a scene, left loose, or stated when files were read: rows of a table."""

    __slots__ = ()

    def names(self, what: str) -> list[str]:
        """What the rows of a kind are about, as the joints of "joint undriven"."""
        return [row.name for row in self if row.what == what]

    def __repr__(self) -> str:
        """The table."""
        return str(import_module("energymargin.base.summary").summary(self)).rstrip()

    def _repr_html_(self) -> str:
        return str(import_module("energymargin.base.summary").html_or_text(self))


_reports: WeakKeyDictionary[Scene, SceneReport] = WeakKeyDictionary()


def report_of(scene: Scene) -> SceneReport:
    """The report of the files that were read into a scene; empty if there were none."""
    return _reports.get(scene, SceneReport())


def add_rows(scene: Scene, rows: Iterable[ReportRow]) -> None:
    """Adds the rows of one file to the report of a scene."""
    _reports[scene] = SceneReport((*report_of(scene), *rows))
