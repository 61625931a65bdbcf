"""Work in the background: a search, a drawing that waits until the controls rest, a replay."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

import energymargin as em

WAIT = 0.08  # s, until a drawing begins
REST = 0.01  # s, between two looks at whether a replay is over
STOP = "Stop"


class WorkThread:
    """One piece of work at a time, on a thread that does not keep Python from ending."""

    def __init__(self, rest: float = 0.0) -> None:
        """Idle. Work begins after `rest` [s], unless other work takes its place until then."""
        self._rest, self._closed, self._lock = rest, False, threading.Lock()
        self._cancel = em.Cancel()
        # Waited for instead of the thread, which Python takes for ended once Ctrl-C ends a join.
        self._done = threading.Event()
        self._done.set()

    @property
    def running(self) -> bool:
        """Whether it works."""
        return not self._done.is_set()

    def start(self, work: Callable[[em.Cancel], None]) -> None:
        """Ends what runs, then calls `work` with the cancel that ends it; not once it is closed."""
        with self._lock:
            if self._closed:
                return
            self._cancel.set()
            before, cancel, done = self._done, em.Cancel(), threading.Event()
            self._cancel, self._done = cancel, done

        def run() -> None:
            try:
                before.wait()
                if self._rest and not cancel.is_set:
                    time.sleep(self._rest)
                if not cancel.is_set:
                    work(cancel)
            finally:
                done.set()

        threading.Thread(target=run, daemon=True).start()

    def join(self) -> None:
        """Waits until it is done."""
        self._done.wait()

    def cancel(self) -> None:
        """Tells the work to end, without waiting for it."""
        self._cancel.set()

    def stop(self) -> None:
        """Ends the work, and waits for that: a search ends within one rollout."""
        self.cancel()
        self.join()

    def close(self) -> None:
        """Ends the work, and starts no other."""
        with self._lock:
            self._closed = True
        self.stop()


class Player:
    """A slider of moments and the button that replays them; one replay at a time.

    A replay moves the slider in the event loop, where moves by hand arrive: one that somebody makes
    comes before or after a move of the replay, never within it.
    """

    def __init__(
        self, server: viser.ViserServer, name: str, label: str, lock: AbstractContextManager[Any]
    ) -> None:
        """At rest and without moments, in the folder of the panel that is open."""
        self.slider = server.gui.add_slider(name, 0, 1, 1, 0, disabled=True)
        self.button = server.gui.add_button(label, disabled=True, color="blue")
        self._label, self._loop, self._shown_with = label, server.get_event_loop(), lock
        self._times = np.zeros(0)
        self._show: Callable[[int], None] = lambda _: None
        self._lock = threading.Lock()  # of moves by a replay that may be over
        self._replay = WorkThread()
        self.slider.on_update(self._take)
        self.slider.on_update(self._moved)

    @property
    def playing(self) -> bool:
        """Whether a replay runs."""
        return self._replay.running

    def connect(self, show: Callable[[int], None]) -> None:
        """Calls show(moment) with the lock whenever the slider has moved."""
        self._show = show

    def set_up(self, times: NDArray[np.float64] | None) -> None:
        """Ends the replay: there are moments at these times [s], and the slider is at the first;
        None: there are none."""
        self.stop()
        self._times = np.zeros(0) if times is None else times
        self.slider.max = max(len(self._times) - 1, 1)
        set_value(self.slider, 0)
        self.slider.disabled = self.button.disabled = len(self._times) < 2

    def press(self) -> None:
        """Replays the moments from the present one on, or again from the end; stops a replay that
        runs."""
        if self.playing:
            self.stop()
        elif len(self._times):
            self._replay.start(self._play)

    def join(self) -> None:
        """Waits until none runs."""
        self._replay.join()

    def stop(self) -> None:
        """Ends the replay, if there is one, where it is: the slider moves no more."""
        with self._lock:
            self._replay.cancel()

    def close(self) -> None:
        """Ends the replay, waits for that, and starts no other: the loop is about to end."""
        self._replay.close()

    async def _take(self, event: Any) -> None:
        """A move by hand stops the replay, which would take it away again."""
        if event.client_id is None or not self.playing:
            return
        self.stop()
        taken = value_of(self.slider)
        # The browser may have had a later move of the replay meanwhile: it is told once more.
        set_value(self.slider, taken - 1 if taken > 0 else 1)
        set_value(self.slider, taken)

    def _moved(self, event: Any) -> None:
        """What the program moves it shows itself."""
        if event.client_id is not None:
            self.draw()

    def draw(self) -> None:
        """Shows the moment of the slider."""
        with self._shown_with:
            if len(self._times):
                self._show(min(int(value_of(self.slider)), len(self._times) - 1))

    def _play(self, cancel: em.Cancel) -> None:
        times, last = self._times, len(self._times) - 1
        self.button.label = STOP
        try:
            for moment in range(int(value_of(self.slider)) % max(last, 1), last + 1):
                move = self._move(moment, cancel)
                asyncio.run_coroutine_threadsafe(move, self._loop).result()
                self.draw()
                end = time.monotonic() + times[min(moment + 1, last)] - times[moment]
                while not cancel.is_set and time.monotonic() < end:
                    time.sleep(min(REST, max(0.0, end - time.monotonic())))
                if cancel.is_set:
                    return
        finally:
            self.button.label = self._label

    async def _move(self, moment: int, cancel: em.Cancel) -> None:
        """Moves the slider unless the replay is over."""
        with self._lock:
            if not cancel.is_set:
                set_value(self.slider, moment)


def value_of(slider: Any) -> float:
    """Value of a slider; a number that was typed out of its range is put back."""
    value = float(min(max(slider.value, slider.min), slider.max))
    if value != slider.value:
        set_value(slider, value)
    return value


def set_value(control: Any, value: float) -> None:
    """Moves a slider or bar: viser lets one, but its types do not say so."""
    control.value = value
