"""Warnings of values that are legal and look wrong, and of results that say little."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable

__all__ = ["PlausibilityWarning", "warn"]

MOST_KNOWN = 10_000  # warnings that are remembered, so that each warns once

HOW_TO_IGNORE = 'If it is meant: warnings.filterwarnings("ignore", category=em.PlausibilityWarning)'


class PlausibilityWarning(UserWarning):
    """A value is legal and looks wrong, or a result says less than it seems to."""


_known: set[tuple[str, str]] = set()


def warn(found: Iterable[tuple[str, str]], fingerprint: str) -> None:
    """Issues each warning, a subject and a text, once for each fingerprint.

    `fingerprint` is that of the scene, so that many states of one scene warn once. The warning
    points at the user's line: the first one outside of this package.
    """
    for about, text in found:
        if (fingerprint, about) in _known:
            continue
        sentence = text + (" " if text.endswith(("?", ".")) else ". ")
        level = _levels_to_user()
        warnings.warn(sentence + HOW_TO_IGNORE, PlausibilityWarning, stacklevel=level)
        if len(_known) >= MOST_KNOWN:
            _known.clear()
        _known.add(
            (fingerprint, about)
        )  # after the warning: one that a filter makes an error comes again


def _levels_to_user() -> int:
    """The `stacklevel` for the caller of this function that reaches the user's line."""
    frame, level = sys._getframe(1), 1
    while frame.f_back and frame.f_globals.get("__name__", "").split(".")[0] == "energymargin":
        frame, level = frame.f_back, level + 1
    return level
