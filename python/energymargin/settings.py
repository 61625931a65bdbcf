"""Moved to `energymargin.scoring.settings`; the names here go in deprecations.REMOVED_IN."""

from typing import TYPE_CHECKING

from energymargin.deprecations import moved_names

NAMES = ("ALGORITHM", "ALGORITHM_IMPROVED", "SEARCHES", "algorithm", "algorithm_of")

if not TYPE_CHECKING:
    __getattr__ = moved_names(
        __name__,
        {
            **{name: f"energymargin.scoring.settings.{name}" for name in NAMES},
            "SearchSettings": "energymargin.SearchSettings",
        },
    )
