"""The environments' names in gymnasium."""

from __future__ import annotations

import gymnasium

from energymargin.gym.channels import CHANNELS

__all__ = ["register_environments"]


def register_environments() -> None:
    """`EnergyMarginPush-v0` and the others, one for each task with channels; once."""
    for name in CHANNELS:
        identifier = f"EnergyMargin{name.title().replace('-', '')}-v0"
        if identifier not in gymnasium.registry:
            gymnasium.register(
                identifier,
                entry_point="energymargin.gym.environment:TaskEnv",
                kwargs={"task": name},
            )
