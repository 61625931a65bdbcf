"""What `energymargin reproduce all` makes: each piece is a study with its settings for the pages.

A piece has a folder of its name, and blocks of its name in the pages of `docs`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from energymargin_paper import STUDIES, load
from energymargin_paper.study import Study

__all__ = ["PIECES", "QUICK", "Piece"]


@dataclass(frozen=True, eq=False)
class Piece:
    """A study with settings."""

    name: str
    minutes: float
    """Expected, of one processor."""
    study: str = ""
    """Its own name if not given."""
    changes: dict[str, Any] = field(default_factory=dict)
    """Settings that are not the study's own."""
    data: str = ""
    """The folder of --data that it needs, if it does."""

    def load(self) -> Study[Any, Any]:
        """Imports the study."""
        return load(self.study or self.name)

    def settings(self, data: Path | None = None) -> Any:
        """All of its settings."""
        folder = {"data": str(data / self.data) if data else "DIR"} if self.data else {}
        return replace(self.load().settings, **self.changes, **folder)

    @property
    def shows(self) -> str:
        """What it is about."""
        return STUDIES[self.study or self.name]


TABLE1: dict[str, Any] = {"nodes": 50, "continuations": 50}

PIECES = (
    Piece("tosses", 1.1, data="real"),
    Piece("grasps-b", 12, "grasps", {"parts": ("b",), "rollouts": 12}, "grasps"),
    Piece("grasps-c", 3, "grasps", {"parts": ("c",), "every": 20, "rollouts": 4}, "grasps"),
    Piece("contact", 11, changes={"seed": 1000}),
    Piece("foresight", 17, changes={"trajectories": 12, "fresh": 0, "continuations": 6}),
    Piece("published", 15, changes={"nodes": 100, "every": 10}, data="published"),
    Piece("engines", 10, changes={"trajectories": 6, "nodes": 500}),
    Piece("act", 28, changes={"worlds": 50}),
    Piece("policies", 7, changes={"worlds": 100, "questions": 150}),
    Piece("grasps-a", 6, "grasps", {"parts": ("a",), "grasps": 20, "draws": 2}, "grasps"),
    Piece("table1", 9, changes=TABLE1),
    Piece("table1-bullet", 14, "table1", {**TABLE1, "engine": "bullet"}),
    Piece("guard", 4, changes={"episodes": 100}),
    Piece("table2", 6, changes={"nodes": 50}),
    Piece("perturbation", 12, changes={"nodes": 50, "draws": 3}),
)
"""By their worth for who decides: the first ones are made first."""

OF_DATA = {piece.study or piece.name for piece in PIECES if piece.data}
QUICK = tuple(Piece(study, 0.5) for study in STUDIES if study not in OF_DATA)
"""A first picture of each study whose data are here."""
