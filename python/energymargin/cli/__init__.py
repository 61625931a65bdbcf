"""The command line: `application` joins the commands, each of which is a file beside it.

The application is imported when it is asked for: other packages use the terminal, the progress bars
and the options alone, and may bring a command themselves.
"""

from __future__ import annotations

from typing import Any


def __getattr__(name: str) -> Any:
    if name not in ("app", "main", "run"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from energymargin.cli import application

    return getattr(application, name)
