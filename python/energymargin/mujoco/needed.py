"""MuJoCo, which is imported when it is first needed: it comes with the extra `mujoco`."""

from __future__ import annotations

from typing import Any

__all__ = ["needed"]


def needed() -> Any:
    """The module `mujoco`; ImportError that names the extra."""
    try:
        import mujoco
    except ImportError as error:
        raise ImportError("MuJoCo is missing: pip install 'energymargin[mujoco]'") from error
    return mujoco
