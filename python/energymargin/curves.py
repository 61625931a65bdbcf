"""Moved to `energymargin.evaluation.curves`; the names here go in deprecations.REMOVED_IN."""

from typing import TYPE_CHECKING

from energymargin.deprecations import moved_names

if not TYPE_CHECKING:
    __getattr__ = moved_names(
        __name__,
        {
            name: f"energymargin.evaluation.curves.{name}"
            for name in (
                *("TARGETS", "OneLabelError", "PrecisionRecall", "Roc", "metrics_against"),
                *("precision_recall", "roc", "target_name"),
            )
        },
    )
