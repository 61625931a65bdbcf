"""Words that several summaries share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import energymargin as em
from energymargin.base.metrics import unit
from energymargin.base.table_text import DASH

UNFINISHED = "Not complete: it was stopped before its end."


def named(metric: str) -> str:
    """A metric with its unit."""
    return f"{metric} [{unit(metric)}]" if unit(metric) else metric


def parameters_text(values: Mapping[str, Any]) -> str:
    """Parameters in words; None is one that is drawn at random for each trajectory."""
    named = values.items()
    parts = [f"{n} drawn at random" if v is None else f"{n} = {short(v)}" for n, v in named]
    return ", ".join(parts) or "nothing"


def short(value: Any) -> str:
    """A setting's value."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def stacked(cell: em.evaluation.Cell | None) -> str:
    """A value, and below it its intervals."""
    return DASH if cell is None else "\n".join((cell.value(), *cell.intervals()))
