"""Objects with a `close` as context managers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TypeVar

Own = TypeVar("Own", bound="Closing")


class Closing(ABC):
    """An open object that a `with` statement closes at its end."""

    @abstractmethod
    def close(self) -> None:
        """Frees its files, threads and connections."""

    def __enter__(self: Own) -> Own:
        """Itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Closes it."""
        self.close()
