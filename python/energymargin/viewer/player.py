"""The replay of a way out, or of a future: its moments one after the other, in its own time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.viewer.panel import set_value, value_of

__all__ = ["Player"]


class Player:
    """Moves a slider of moments; one replay at a time."""

    def __init__(self, slider: Any, told: Callable[[bool], None]) -> None:
        """At rest; told(playing) hears when a replay begins and ends."""
        self._slider, self._told = slider, told
        self._lock = threading.Lock()
        self._over = threading.Event()  # of the replay that is the last one
        self._at_rest = threading.Event()
        self._at_rest.set()
        self._taken: float | None = None  # the moment that somebody chose by hand

    @property
    def playing(self) -> bool:
        """Whether a replay runs."""
        return not self._at_rest.is_set()

    def press(self, times: NDArray[np.float64] | None) -> None:
        """Replays moments at these times [s] from the present one on, or again from the end; stops
        a replay that runs. Returns once it is over."""
        with self._lock:
            self._over.set()
            if self.playing or times is None:
                return
            over = self._over = threading.Event()
            self._at_rest.clear()
        try:
            self._told(True)
            self._play(times, over)
        finally:
            self._told(False)
            self._at_rest.set()

    def join(self) -> None:
        """Waits until none runs."""
        self._at_rest.wait()

    def stop(self) -> None:
        """Ends the replay, if there is one, where it is: at once, but for a move that has begun."""
        with self._lock:
            self._over.set()

    def connect(self, lock: AbstractContextManager[Any], show: Callable[[], None]) -> None:
        """Calls show() with the lock whenever the slider moves; a move by hand stops the replay,
        which would take it away again."""

        async def take(event: Any) -> None:
            """A coroutine is called right after the move, before the replay's next one; what is
            drawn has to wait for other work."""
            if event.client_id is not None:
                self.stop()
                self._taken = value_of(self._slider)

        def move(event: Any) -> None:
            with lock:
                if event.client_id is not None and self._taken is not None:
                    set_value(self._slider, self._taken)  # if the replay was about to move it
                show()

        self._slider.on_update(take)
        self._slider.on_update(move)

    def _play(self, times: NDArray[np.float64], over: threading.Event) -> None:
        last = len(times) - 1
        waits = [*np.diff(times), 0.0]
        for moment in range(int(value_of(self._slider)) % max(last, 1), last + 1):
            if over.is_set():
                return
            set_value(self._slider, moment)  # which shows it
            over.wait(waits[moment])
