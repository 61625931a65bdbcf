"""The command `energymargin doctor`."""

from __future__ import annotations

from pathlib import Path

import energymargin as em
from energymargin.cli.terminal import loading, out


def doctor(model: Path, /, *, time: float = 1.0) -> None:
    """Say what is wrong with a MuJoCo scene: what overlaps, moves, creeps, or is too weak.

    The scene is stepped by MuJoCo as it is configured. Exit status 1 if anything is found.

    Example: `energymargin doctor scene.xml`

    Args:
        model: An MJCF file.
        time: For how long it is stepped (s).
    """
    with loading():
        import mujoco

        import energymargin.mujoco  # noqa: F401
    try:
        read = mujoco.MjModel.from_xml_path(str(model))
    except ValueError as error:
        raise ValueError(f"{model} is no model of MuJoCo: {error}") from error
    found = em.mujoco.doctor(read, time=time)
    out.print(em.summary.summary(found))
    if found.findings:
        raise SystemExit(1)
