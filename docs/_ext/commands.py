"""The commands' page: ```{commands}``` writes every command and its options, from typer itself."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import typer
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

NAME = "energymargin"


def commands() -> Iterator[tuple[str, Any]]:
    """Every command by its whole name ("energymargin score"), a group before what it holds."""
    from energymargin.cli import app

    yield from _walk(NAME, typer.main.get_command(app))


def _walk(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    yield name, command
    if hasattr(command, "list_commands"):
        context = typer.Context(command)
        for child in command.list_commands(context):
            yield from _walk(f"{name} {child}", command.get_command(context, child))


def page() -> str:
    """As Markdown, a heading a command, after the options of all."""
    (_, whole), *others = commands()
    return "\n".join([*_table(whole), *(_text(name, command) for name, command in others)])


def _text(name: str, command: Any) -> str:
    level = "#" * len(name.split())
    lines = [f"{level} {name.removeprefix(NAME).strip()}", "", *_help(command.help), ""]
    if not getattr(command, "commands", None):
        lines += ["```text", _usage(name, command), "```", "", *_table(command)]
    return "\n".join([*lines, ""])


def _help(text: str | None) -> list[str]:
    """In lines without their common indentation."""
    return [line.strip() for line in (text or "").splitlines()]


def _usage(name: str, command: Any) -> str:
    arguments = [parameter for parameter in command.params if _is_argument(parameter)]
    words = [name, "[OPTIONS]"]
    for argument in arguments:
        word = argument.name.upper() + ("..." if argument.nargs != 1 else "")
        words.append(word if argument.required else f"[{word}]")
    return " ".join(words)


def _is_argument(parameter: Any) -> bool:
    return bool(parameter.param_type_name == "argument")


def _table(command: Any) -> list[str]:
    """Of its arguments and options."""
    lines = ["| | what | default |", "| --- | --- | --- |"]
    context = typer.Context(command)
    for parameter in command.params:
        if parameter.name == "help" or getattr(parameter, "hidden", False):
            continue
        shown = parameter.get_help_record(context)[0]
        what = re.sub(r"\s+", " ", parameter.help or "").strip()
        cells = (_name(parameter, shown), _cell(what), _default(parameter))
        lines.append(f"| {' | '.join(cells)} |")
    return [*lines, ""] if len(lines) > 2 else []


def _name(parameter: Any, shown: str) -> str:
    """`shown`: how the terminal names it, as "-o, --output <path>"."""
    if _is_argument(parameter):
        return f"`{parameter.name.upper()}`"
    names = ", ".join(f"`{name}`" for name in (*parameter.opts, *parameter.secondary_opts))
    if parameter.is_flag:
        return names
    kind = shown.rsplit(maxsplit=1)[-1].strip("<>")
    return f"{names} {_cell(kind.removeprefix('list[').strip('[]'))}"


def _default(parameter: Any) -> str:
    if isinstance(parameter.show_default, str):
        return _cell(parameter.show_default)
    if _is_argument(parameter) and parameter.required:
        return "required"
    value = parameter.default
    simple = isinstance(value, (int, float, str)) and not isinstance(value, bool)
    return f"`{value}`" if simple or hasattr(value, "parts") else ""


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


class Commands(SphinxDirective):
    """Parses the page where it stands."""

    def run(self) -> list[nodes.Node]:
        """Its sections."""
        return self.parse_text_to_nodes(page(), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, Any]:
    """Adds the directive."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
