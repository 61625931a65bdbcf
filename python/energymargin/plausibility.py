"""Warnings of values that are legal and look wrong, and of results that say little."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable

MOST_KNOWN = 10_000  # warnings that are remembered, so that each warns once

# Frames of these are not the user's: this package, its commands, and what calls it in between.
HOSTS = {"click", "energymargin", "energymargin_paper", "gymnasium", "typer"}

HOW_TO_IGNORE = 'If it is meant: warnings.filterwarnings("ignore", category=em.PlausibilityWarning)'


class PlausibilityWarning(UserWarning):
    """A value is legal and looks wrong, or a result says less than it seems to."""


_known: set[tuple[str, str]] = set()


def warn(found: Iterable[tuple[str, str]], fingerprint: str) -> None:
    """Issues each warning, a subject and a text, once for each fingerprint.

    `fingerprint` is that of the scene, so that many states of one scene warn once. The warning
    points at the user's line.
    """
    for about, text in found:
        if (fingerprint, about) in _known:
            continue
        sentence = text + (" " if text.endswith(("?", ".")) else ". ")
        level = levels_to_user()
        warnings.warn(sentence + HOW_TO_IGNORE, PlausibilityWarning, stacklevel=level)
        if len(_known) >= MOST_KNOWN:
            _known.clear()
        _known.add((fingerprint, about))  # not before: one that a filter makes an error comes again


def levels_to_user() -> int:
    """The `stacklevel` for the caller of this function that reaches the user's line: the first one
    outside of HOSTS."""
    frame, level = sys._getframe(1), 1
    while frame.f_back and frame.f_globals.get("__name__", "").split(".")[0] in HOSTS:
        frame, level = frame.f_back, level + 1
    return level
