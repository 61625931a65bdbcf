"""The command `energymargin compare`."""

from __future__ import annotations

from pathlib import Path

import energymargin as em
from energymargin.cli.terminal import out


def compare(a: Path, b: Path, /, *, confidence: float = 0.95) -> None:
    """Say whether one of two policies is better, by their evaluations, and since which episode.

    The claim holds however often you look: more episodes may be added until it is sure.

    Example: `energymargin compare baseline/eval_info.json mine/eval_info.json`

    Args:
        a: An `eval_info.json` of LeRobot.
        b: Another one; episodes are paired by their seeds, or else by their order.
        confidence: With which "better" is said.
    """
    out.print(em.summary.summary(em.compare(a, b, confidence=confidence)))
