"""What the paper reports, to be seen beside what is measured."""

from __future__ import annotations

__all__ = ["DASH", "PAPER", "paper_text"]

DASH = "—"

# AUC and AP of the paper's Table I.
PAPER: dict[str, dict[str, tuple[float, float]]] = {
    "push": {
        "capture": (0.97, 0.99),
        "effort/est": (0.92, 0.98),
        "effort/rrt": (0.92, 0.99),
        "force": (0.86, 0.95),
        "success": (0.98, 0.98),
    },
    "balance": {
        "capture": (0.98, 0.99),
        "effort/est": (0.93, 0.98),
        "effort/rrt": (0.94, 0.98),
        "force": (0.94, 0.96),
        "success": (0.93, 0.95),
    },
    "topple": {
        "capture": (0.94, 0.93),
        "effort/est": (0.93, 0.91),
        "effort/rrt": (0.93, 0.92),
        "force": (0.77, 0.62),
        "success": (0.89, 0.92),
    },
    "grasp": {
        "capture": (1.00, 1.00),
        "effort/est": (0.99, 0.99),
        "effort/rrt": (0.97, 0.99),
        "force": (0.73, 0.88),
        "success": (0.99, 0.99),
    },
}


def paper_text(value: tuple[float, float] | None) -> str:
    """AUC/AP as it is shown; a dash for None."""
    return DASH if value is None else f"{value[0]:.2f}/{value[1]:.2f}".replace("0.", ".")
