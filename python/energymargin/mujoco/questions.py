"""A question about a MuJoCo model, in one line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import energymargin as em
from energymargin.mujoco.engine import Engine


def problem(
    model: Any,
    data: Any = None,
    *,
    objects: Sequence[str] | str,
    captured: em.regions.Region,
    effector: Sequence[str] | str = (),
    threads: int | None = None,
    **question: Any,
) -> em.Problem:
    """The question whether objects stay where they are to be, in MuJoCo itself.

    Args:
        model: a `mujoco.MjModel`.
        data: a `mujoco.MjData` that says where all starts, with its controls.
        objects: bodies on which disturbances act, by name.
        captured: the capture set, as of em.Problem.
        effector: bodies of the robot, by name.
        threads: that MuJoCo steps on; None: all cores.
        question: as of em.engines.problem.

    Raises ValueError as em.mujoco.Engine and em.Problem do.
    """
    engine = Engine(model, data, objects=objects, effector=effector, threads=threads)
    return em.engines.problem(engine, captured=captured, **question)
