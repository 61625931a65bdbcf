"""What became of a grasp, and a store that keeps it, known by what was asked."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

from energymargin.disturbances import text_of
from energymargin.executors import Kept
from energymargin.grasps.outcomes import Grasp, Outcome
from energymargin.grasps.trials import GraspTrials
from energymargin.store import AnswerFile

OF_TRIALS = ("hand", "object", "protocol", "belief")


@dataclass(frozen=True)
class GraspRow:
    """What a worker found out about a grasp."""

    number: int
    outcomes: tuple[Outcome, ...] = ()
    likely: Outcome | None = None
    effort: float = math.nan
    seconds: float = 0.0
    error: str | None = None


class KeptRows(AnswerFile):
    """A store, and what its rows depend on beside the grasp."""

    def __init__(
        self,
        store: str | Path,
        trials: GraspTrials,
        *more: Any,
        read: Callable[[Grasp, bytes], Any] | None = None,
        written: Callable[[Any], bytes | None] | None = None,
    ) -> None:
        """`more`: what is asked besides. Rows are GraspRows, or what `read` and `written` say.

        Errors: as AnswerFile. Raises ValueError on a disturbance or a belief that cannot be written
        down.
        """
        asked = {name: getattr(trials, name).text for name in OF_TRIALS}
        asked |= {name: getattr(trials, name) for name in ("colliding", "seed", "step")}
        self._asked = json.dumps([asked, text_of(trials.disturbance), *more])
        super().__init__(store, create=True)
        self.rows = Kept[Grasp, Any](self, self._digest, read or _read, written or _written)

    def _digest(self, grasp: Grasp) -> bytes:
        return self.key(self._asked, grasp.opening, grasp.pose.tobytes(), grasp.placed.tobytes())


def _read(grasp: Grasp, content: bytes) -> GraspRow:
    outcomes, likely, *others = json.loads(content)
    made = tuple(Outcome(*one) for one in outcomes)
    return GraspRow(grasp.number, made, Outcome(*likely), *others)


def _written(row: GraspRow) -> bytes | None:
    return None if row.error is not None else json.dumps(astuple(row)[1:]).encode()
