"""The commands that other packages register: `energymargin reproduce` is one.

An entry point of the group `energymargin.commands` names a Typer app.
"""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from typing import Any

import typer

__all__ = ["registered_command", "registered_names"]

GROUP = "energymargin.commands"


def registered_names() -> list[str]:
    """The names that `registered_command` knows, sorted."""
    return sorted({entry.name for entry in entry_points(group=GROUP)})


def registered_command(name: str) -> Any:
    """The command of that name; None if there is none. A command whose package cannot be imported
    says so when it is called."""
    for entry in entry_points(group=GROUP, name=name):
        try:
            command: Any = typer.main.get_command(entry.load())
        except ImportError as error:
            command = typer.main.get_command(_unusable(entry, error))
        command.name = name
        return command
    return None


def _unusable(entry: EntryPoint, error: ImportError) -> typer.Typer:
    """An app that takes whatever it is given, and raises ImportError."""
    app = typer.Typer(add_completion=False)
    package = entry.module.partition(".")[0]
    need = f"needs the package {package}, which cannot be imported"
    way_out = f"({error}): install {package}, or energymargin as a whole"
    anything = {"allow_extra_args": True, "ignore_unknown_options": True}

    @app.command(help=f"This command {need}.", context_settings=anything)
    def refuse() -> None:
        raise ImportError(f"`energymargin {entry.name}` {need} {way_out}")

    return app
