"""What results look like in a notebook: a small table in HTML, for some beside a picture. And at a
prompt, where the compiled module does not say it.

A result that cannot be shown so is shown as text: no cell of a notebook fails for its picture.
"""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from importlib import import_module
from typing import Any

import energymargin._core as compiled
from energymargin._core import (
    CaptureProbability,
    CaptureScore,
    EscapeEffort,
    EscapeEnergy,
    ForceScore,
    Plan,
    Problem,
    Scene,
    Tree,
)

__all__ = ["attach", "shown_by"]

METHOD = "_repr_html_"  # which a notebook asks for
TEXT = "__repr__"  # which a prompt asks for
VIEWS: dict[type, str] = {
    CaptureProbability: "capture_probability",
    CaptureScore: "capture_score",
    EscapeEffort: "escape_effort",
    EscapeEnergy: "escape_energy",
    ForceScore: "force_score",
    Tree: "tree",
    Plan: "plan",
    Problem: "problem",
    Scene: "scene",
}


def attach() -> None:
    """Lets notebooks and prompts show the classes of the compiled module."""
    for kind, view in VIEWS.items():
        setattr(kind, METHOD, shown_by(view))
    for kind in vars(compiled).values():
        if isinstance(kind, type) and TEXT not in vars(kind) and _has_properties(kind):
            setattr(kind, TEXT, _text)


def _has_properties(kind: type) -> bool:
    return any(isinstance(member, property) for member in vars(kind).values())


def _text(self: Any) -> str:
    """Name(property=value, ...)"""
    text: str = import_module("energymargin.reprs").compiled_repr(self)
    return text


def shown_by(view: str) -> Callable[[Any], str]:
    """The method `_repr_html_` of a class, which calls a function of `notebook.views`.

    That module is imported when a notebook first asks. If the function raises, there is text.
    """

    def html_or_text(self: Any) -> str:
        try:
            html: str = getattr(import_module(f"{__name__}.views"), view)(self)
            return html
        except Exception as error:  # a damaged thing is shown as far as it can be
            return f"<pre>{escape(_plain(self))}\ncannot be shown: {escape(_plain(error))}</pre>"

    return html_or_text


def _plain(thing: object) -> str:
    try:
        return repr(thing)
    except Exception:
        return f"<{type(thing).__name__}>"
