"""What `--horizon` and `--plan` ask of recorded states."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from energymargin.datasets import Future
    from energymargin.tasks.base import Following

__all__ = ["chosen_future"]

PLANS: dict[str, Following | None] = {"script": "script", "hold": "hold", "none": None}


def chosen_future(horizon: int | None, plan: str | None) -> Future | None:
    """What is asked of the frames to come, if anything is. Raises ValueError on words that are
    none, and on a plan without a horizon."""
    from energymargin.datasets import Future
    from energymargin.tasks.base import whole_number

    if plan is not None and plan not in PLANS:
        raise ValueError(f"--plan is {plan!r}, expected script, hold or none")
    if horizon is None:
        if plan is not None:
            raise ValueError(
                f"--plan is {plan}, but there is no horizon over which it would be followed: "
                "add --horizon FRAMES, or leave --plan out"
            )
        return None
    return Future(whole_number("--horizon", horizon, 1), PLANS[plan or "script"])
