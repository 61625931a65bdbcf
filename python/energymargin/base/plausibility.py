"""Warnings of values that are legal and look wrong, and of results that say little."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

MOST_KNOWN = 10_000  # warnings that are remembered, so that each warns once

# Frames of these are not the user's: this package, its commands, and what calls it in between.
HOSTS = {"cyclopts", "energymargin", "energymargin_paper", "gymnasium"}

HOW_TO_IGNORE = 'If it is meant: warnings.filterwarnings("ignore", category=em.PlausibilityWarning)'


class PlausibilityWarning(UserWarning):
    """A value is legal and looks wrong, or a result says less than it seems to."""


_known: set[tuple[str, str]] = set()
Kept = list[tuple[tuple[str, str], str | None]]
"""Warnings, each with its fingerprint, as arguments of `warn`."""
_kept: ContextVar[Kept | None] = ContextVar("kept", default=None)


@contextmanager
def kept_warnings() -> Iterator[Kept]:
    """In the `with` block, and in this thread alone, `warn` puts warnings into this list.

    `warnings.catch_warnings` would change what all threads of the process warn of.
    """
    kept: Kept = []
    token = _kept.set(kept)
    try:
        yield kept
    finally:
        _kept.reset(token)


def warn(found: Iterable[tuple[str, str]], fingerprint: str | None) -> None:
    """Issues each warning, a subject and a text, once for each fingerprint.

    `fingerprint` is that of the scene, so that many states of one scene warn once; with None each
    call warns. The warning points at the user's line.
    """
    kept = _kept.get()
    if kept is not None:
        kept += [(one, fingerprint) for one in found]
        return
    for about, text in found:
        if fingerprint is not None and (fingerprint, about) in _known:
            continue
        sentence = text + (" " if text.endswith(("?", ".")) else ". ")
        level = levels_to_user()
        warnings.warn(sentence + HOW_TO_IGNORE, PlausibilityWarning, stacklevel=level)
        if len(_known) >= MOST_KNOWN:
            _known.clear()
        if fingerprint is not None:  # not before: one that a filter makes an error comes again
            _known.add((fingerprint, about))


def levels_to_user() -> int:
    """The `stacklevel` for the caller of this function that reaches the user's line: the first one
    outside of HOSTS."""
    frame, level = sys._getframe(1), 1
    while frame.f_back and frame.f_globals.get("__name__", "").split(".")[0] in HOSTS:
        frame, level = frame.f_back, level + 1
    return level
