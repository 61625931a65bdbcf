"""The keys of a problem file as Markdown, from its JSON Schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

SCHEMA = Path(__file__).parents[1] / "cpp/src/problem_io/problem.schema.json"
WORDS = {"array": "list", "object": "object", "boolean": "true or false"}


def page() -> str:
    """As Markdown: the file, and then each kind of object in it."""
    schema = json.loads(SCHEMA.read_text())
    lines = ["### The file", "", *_table(schema)]
    for name, definition in schema["definitions"].items():
        if "properties" in definition:
            about = definition.get("description", "")
            lines += [f"### {name}", "", about, "", *_table(definition)]
    return "\n".join(lines)


def _table(definition: dict[str, Any]) -> list[str]:
    lines = ["| key | value | |", "| --- | --- | --- |"]
    required = definition.get("required", ())
    for key, value in definition["properties"].items():
        name = f"`{key}`" + (", required" if key in required else "")
        about = _cell(value.get("description", ""))
        lines.append(f"| {name} | {_cell(_kind(value))} | {about} |")
    return [*lines, ""]


def _kind(value: dict[str, Any]) -> str:
    """In words."""
    if "$ref" in value:
        name: str = value["$ref"].rsplit("/", 1)[-1]
        return name
    if "const" in value:
        return f"`{json.dumps(value['const'])}`"
    if "enum" in value:
        return ", ".join(f"`{json.dumps(choice)}`" for choice in value["enum"])
    for key in ("oneOf", "anyOf"):
        if key in value:
            return " or ".join(_kind(choice) for choice in value[key])
    kind = value.get("type", "any")
    words = [WORDS.get(each, each) for each in ([kind] if isinstance(kind, str) else kind)]
    return " or ".join(words) + _bounds(value)


def _bounds(value: dict[str, Any]) -> str:
    items = value.get("items")
    parts = [f" of {_kind(items)}"] if isinstance(items, dict) else []
    for key, word in (("exclusiveMinimum", "above"), ("minimum", "from"), ("maximum", "to")):
        if key in value:
            parts.append(f" {word} {value[key]:g}")
    return "".join(parts)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
