"""Numbers from 0 to 1 in a table, such as an AUC: .981."""

from __future__ import annotations

__all__ = ["short"]


def short(value: float, decimals: int = 3) -> str:
    """Rounded, without the leading zero: .981; what rounds to one is 1.00."""
    rounded = f"{value:.{decimals}f}"
    return "1.00" if rounded[0] == "1" else rounded[1:]
