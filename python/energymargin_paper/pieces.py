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


PIECES = tuple(
    sorted(
        (
            Piece("table1", 25, changes={"nodes": 100}),
            Piece("perturbation", 35),
            Piece(
                *("perturbation-belief", 22, "perturbation"),
                {"trajectories": 20, "levels": (0.0, 0.5), "draws": 2, "belief": True},
            ),
            Piece("table2", 7),
            Piece("foresight", 68, changes={"fresh": 0, "continuations": 10}),
            Piece("early-warning", 12),
            Piece(
                *("early-warning-recorded", 10, "early-warning"),
                {"tasks": ("recordings",)},
                "published",
            ),
            Piece("filter", 3.5),
            Piece("guard", 7),
            Piece("act", 25),
            Piece("policies", 12),
            Piece("bowl", 0.1),
            Piece("audit", 0.9),
            Piece("closed-forms", 12),
            Piece("bounds", 6),
            Piece("least-efforts", 165, changes={"answer_seeds": 20}),
            Piece("contact", 10, changes={"seed": 1000}),
            Piece("rare", 15),
            Piece("models", 6),
            Piece("engines", 8),
            Piece("published", 60, data="published"),
            Piece("grasps-a", 120, "grasps", {"parts": ("a",), "draws": 4}, "grasps"),
            Piece("grasps-b", 60, "grasps", {"parts": ("b",), "rollouts": 8}, "grasps"),
            Piece(
                "grasps-c", 20, "grasps", {"parts": ("c",), "every": 20, "rollouts": 4}, "grasps"
            ),
            Piece(
                *("grasps-d", 120, "grasps"),
                {"parts": ("d",), "noisy_grasps": 8, "trials": 30},
                "grasps",
            ),
        ),
        key=lambda piece: piece.minutes,
    )
)

QUICK = tuple(Piece(study, 0.5) for study in STUDIES if study not in ("published", "grasps"))
"""A first picture of each study whose data are here."""
