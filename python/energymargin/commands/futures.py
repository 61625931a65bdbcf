"""What `--horizon`, `--plan` and the disturbance ask of recorded states."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from energymargin.datasets import Future
    from energymargin.tasks.base import Following

__all__ = ["chosen_future", "given_settings"]

PLANS: dict[str, Following | None] = {"script": "script", "hold": "hold", "none": None}


def chosen_future(
    horizon: int | None,
    plan: str | None,
    check: float | None = None,
    dwell: float | None = None,
) -> Future | None:
    """What is asked of the frames to come, if anything is. Raises ValueError on words that are
    none, and on what needs a horizon where there is none."""
    from energymargin.datasets import Future
    from energymargin.tasks.base import not_negative_number, positive_number, whole_number

    if plan is not None and plan not in PLANS:
        raise ValueError(f"--plan is {plan!r}, expected script, hold or none")
    if horizon is None:
        if plan is not None:
            raise ValueError(
                f"--plan is {plan}, but there is no horizon over which it would be followed: "
                "add --horizon FRAMES, or leave --plan out"
            )
        for name, value in (("check", check), ("dwell", dwell)):
            if value is not None:
                raise ValueError(
                    f"--{name} is {value:g}, but a state as it is has no time at which to look: "
                    f"add --horizon FRAMES, or leave --{name} out"
                )
        return None
    return Future(
        whole_number("--horizon", horizon, 1),
        PLANS[plan or "script"],
        None if check is None else positive_number("--check", check),
        0.0 if dwell is None else not_negative_number("--dwell", dwell),
    )


def given_settings(
    horizon: int | None,
    rollouts: int | None,
    strength: float | None,
    objects: int | None,
    common: bool,
) -> dict[str, Any]:
    """The settings of probabilities that are given. Raises ValueError if there is no horizon, and
    so no probability."""
    options = {"rollouts": rollouts, "strength": strength, "objects": objects}
    given: dict[str, Any] = {name: value for name, value in options.items() if value is not None}
    if horizon is None and (given or common):
        what = next((f"--{name} is {value}" for name, value in given.items()), "--common is given")
        raise ValueError(f"{what}, but no probability is asked for: add --horizon FRAMES")
    return {**given, "common_random_numbers": common}
