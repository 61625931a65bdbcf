"""Where scores are asked for: of one problem in `_core`, of many in `batch`, with `settings`.

A name is imported when it is asked for: executors need the settings, and `batch` the executors.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from energymargin._core import capture_score, escape_effort, escape_energy, force_score

if TYPE_CHECKING:
    from energymargin.scoring.batch import score
    from energymargin.scoring.problem_metrics import metrics_of
    from energymargin.scoring.settings import SearchSettings
    from energymargin.scoring.table import ScoreError, ScoreTable

__all__ = [
    "ScoreError",
    "ScoreTable",
    "SearchSettings",
    "capture_score",
    "escape_effort",
    "escape_energy",
    "force_score",
    "metrics_of",
    "score",
]

HOMES = {
    "batch": ("score",),
    "problem_metrics": ("metrics_of",),
    "settings": ("SearchSettings",),
    "table": ("ScoreError", "ScoreTable"),
}


def _lazy(name: str) -> Any:
    for module, names in HOMES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


if not TYPE_CHECKING:
    __getattr__ = _lazy


def __dir__() -> list[str]:
    return __all__
