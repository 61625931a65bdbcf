"""Values of arguments in errors."""

from __future__ import annotations

__all__ = ["shown"]

LONGEST = 60  # characters of a value in an error


def shown(value: object) -> str:
    """A value in one short line."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # a repr of the user's own
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."
