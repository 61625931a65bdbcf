"""What results look like in a notebook: a small table in HTML, of a problem with its
picture and of a probability with its curve.

Nothing here is in the way of a cell: what cannot be shown is shown as text.
"""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from importlib import import_module
from typing import Any

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
OF_CORE: dict[type, str] = {
    CaptureProbability: "results.capture_probability",
    CaptureScore: "results.capture_score",
    EscapeEffort: "results.escape_effort",
    EscapeEnergy: "results.escape_energy",
    ForceScore: "results.force_score",
    Tree: "results.tree",
    Plan: "problems.plan",
    Problem: "problems.problem",
    Scene: "problems.scene",
}


def attach() -> None:
    """Lets notebooks show the classes of the compiled module."""
    for kind, function in OF_CORE.items():
        setattr(kind, METHOD, shown_by(function))


def shown_by(function: str) -> Callable[[Any], str]:
    """The method `_repr_html_` of a class, from "module.function" of this package.

    The module is imported when a notebook first asks. What raises is shown as text.
    """
    module, _, name = function.partition(".")

    def shown_or_text(self: Any) -> str:
        try:
            shown: str = getattr(import_module(f"{__name__}.{module}"), name)(self)
            return shown
        except Exception as error:  # a damaged thing is shown as far as it can be
            return f"<pre>{escape(_plain(self))}\ncannot be shown: {escape(_plain(error))}</pre>"

    return shown_or_text


def _plain(thing: object) -> str:
    try:
        return repr(thing)
    except Exception:
        return f"<{type(thing).__name__}>"
