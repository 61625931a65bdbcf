"""Progress bars of long work that is a step of other work: a command says how they are drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar

Update = Callable[[int, int], None]
"""update(done, total)"""
DrawBar = Callable[[str, str], AbstractContextManager[Update]]
"""draw(title, unit)"""

_draw: ContextVar[DrawBar | None] = ContextVar("bars", default=None)


@contextmanager
def bars_by(draw: DrawBar) -> Iterator[None]:
    """In the `with` block, and in this thread alone, `bar` draws with draw(title, unit)."""
    token = _draw.set(draw)
    try:
        yield
    finally:
        _draw.reset(token)


def bar(title: str, unit: str) -> AbstractContextManager[Update | None]:
    """A bar while the `with` block runs, which calls update(done, total); None if nobody draws."""
    draw = _draw.get()
    return nullcontext(None) if draw is None else draw(title, unit)
