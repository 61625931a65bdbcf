"""Settings that commands offer as options."""

from __future__ import annotations

from dataclasses import field
from typing import Any


def setting(default: Any, text: str, *, shown: str | None = None) -> Any:
    """A field of a dataclass of settings that a command offers as an option.

    `text` is its help, `shown` its default in words. A tuple is typed separated by commas.
    """
    return field(default=default, metadata={"help": text, "shown": shown})
