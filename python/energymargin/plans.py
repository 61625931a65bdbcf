"""Parts of a plan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Plan
from energymargin.checks import positive_number

__all__ = ["rest_of", "whole_steps"]

ROUNDING = 1e-6  # of a step


def whole_steps(name: str, time: float, step: float) -> int:
    """How many steps [s] a time [s] is; ValueError with `name` unless it is one or more whole
    ones."""
    count = positive_number(name, time) / step
    if round(count) < 1 or abs(count - round(count)) > ROUNDING * max(count, 1.0):
        near = max(round(count), 1) * step
        raise ValueError(
            f"{name} is {time!r} s, expected whole steps of {step:.6g} s, such as {near:.6g}"
        )
    return round(count)


def rest_of(plan: Plan, done: int, step: float) -> Plan:
    """What is left of a plan after `done` steps [s] of a scene.

    Its rows stay as they are where it begins with one, and otherwise have the scene's step. Raises
    ValueError if nothing is left.
    """
    each = round(plan.step / step)
    if not 0 <= done < each * plan.rows:
        raise ValueError(f"done is {done}, expected 0 to {each * plan.rows - 1}")
    repeats, first = (1, done // each) if done % each == 0 else (each, done)

    def cut(rows: Mapping[str, Any]) -> dict[str, NDArray[np.float64]]:
        return {name: np.repeat(all_of, repeats, axis=0)[first:] for name, all_of in rows.items()}

    return Plan(
        plan.step if repeats == 1 else step,
        wrenches=cut(plan.wrenches),
        targets=cut(plan.targets),
        velocities=cut(plan.velocities),
        limits=plan.limits,
    )
