"""How long the studies of a folder took."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Times"]


@dataclass(frozen=True)
class Times:
    """How long each study of a folder took, over all the times that it was started [s]."""

    path: Path

    def of(self, study: str) -> float:
        """0 if it was never run; ValueError if the file holds something else."""
        return self._all().get(study, 0.0)

    def add(self, study: str, seconds: float) -> None:
        """One more time."""
        self.path.write_text(json.dumps({**self._all(), study: self.of(study) + seconds}, indent=1))

    def _all(self) -> dict[str, float]:
        if not self.path.exists():
            return {}
        try:
            times = json.loads(self.path.read_text())
            return {str(name): float(seconds) for name, seconds in times.items()}
        except (ValueError, TypeError, AttributeError) as error:
            raise ValueError(f"{self.path} holds no times of studies: remove it") from error
