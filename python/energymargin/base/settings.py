"""Settings that commands offer as options."""

from __future__ import annotations

from dataclasses import Field, field
from typing import Any


def setting(default: Any, text: str, *, shown: str | None = None, flag: str | None = None) -> Any:
    """A field of a dataclass of settings that a command offers as an option.

    `text` is its help, `shown` its default in words, and `flag` its option if that is not the
    field's own name. A tuple is typed separated by commas.
    """
    return field(default=default, metadata={"help": text, "shown": shown, "flag": flag})


def flag_of(field: Field[Any]) -> str:
    """The option of a field, such as --nodes-per-edge."""
    return field.metadata.get("flag") or f"--{field.name.replace('_', '-')}"
