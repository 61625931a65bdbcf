"""Warnings of what is legal and looks wrong."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

__all__ = ["PlausibilityWarning", "warn"]

MOST_KNOWN = 10_000  # doubts that were warned of

HOW_TO_IGNORE = 'If it is meant: warnings.filterwarnings("ignore", category=em.PlausibilityWarning)'


class PlausibilityWarning(UserWarning):
    """A value is legal and looks wrong: another unit, another order, a set elsewhere."""


_known: set[tuple[str, str]] = set()


def warn(doubts: Iterable[tuple[str, str]], fingerprint: str, *, stacklevel: int = 1) -> None:
    """Warns of each doubt, what it is about and its text, once for a fingerprint.

    `fingerprint` is that of the scene, so that many states of one scene warn once. `stacklevel` is
    how many functions stand between this one and the user's line.
    """
    for about, text in doubts:
        if (fingerprint, about) in _known:
            continue
        sentence = text + (" " if text.endswith(("?", ".")) else ". ")
        warnings.warn(sentence + HOW_TO_IGNORE, PlausibilityWarning, stacklevel=stacklevel + 1)
        if len(_known) >= MOST_KNOWN:
            _known.clear()
        _known.add((fingerprint, about))  # not if a filter makes it an error: it comes again
