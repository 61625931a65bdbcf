"""Warnings of a command: a line each, without the place in code that is not the user's."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.markup import escape

from energymargin.cli.terminal import say
from energymargin.plausibility import HOW_TO_IGNORE

__all__ = ["shown_warnings"]


@contextmanager
def shown_warnings() -> Iterator[None]:
    """While it lasts, a UserWarning is a line on stderr; others are shown as ever, with their
    place."""
    as_ever = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, UserWarning):
            as_ever(message, category, *place, **more)
            return
        text = " ".join(str(message).removesuffix(HOW_TO_IGNORE).split())
        say(f"[yellow]warning:[/] {escape(text)}")

    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = as_ever
