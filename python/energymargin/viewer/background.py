"""Work in the background: a search, a drawing that waits until the controls rest, a replay."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, suppress
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from energymargin._core import Cancel

WAIT = 0.08  # s
STOP = "Stop"


class SearchThread:
    """One search at a time, on a thread that does not keep Python from ending."""

    def __init__(self) -> None:
        """Idle."""
        self._lock = threading.RLock()
        self._cancel = Cancel()
        # Waited for instead of the thread, which Python takes for ended once Ctrl-C ends a join.
        self._done = threading.Event()
        self._done.set()
        self._closed = False

    @property
    def running(self) -> bool:
        """Whether it searches."""
        return not self._done.is_set()

    def start(self, work: Callable[[Cancel], None]) -> None:
        """Stops what runs, and calls `work` with the cancel that ends it; not once it is closed."""
        with self._lock:
            self.stop()
            if self._closed:
                return
            cancel, done = self._cancel, self._done = Cancel(), threading.Event()

        def run() -> None:
            try:
                work(cancel)
            finally:
                done.set()

        threading.Thread(target=run, daemon=True).start()

    def join(self) -> None:
        """Waits until it is done."""
        self._done.wait()

    def stop(self) -> None:
        """Ends the search, and waits for that: within one rollout."""
        with self._lock:
            self._cancel.set()
            self.join()

    def close(self) -> None:
        """Ends the search, and starts no other."""
        self._closed = True
        self.stop()


class Debounced:
    """A thread that does what it was last given, once that rests."""

    def __init__(self) -> None:
        """Idle."""
        self._pool = ThreadPoolExecutor(1)
        self._last: Callable[[], None] | None = None
        self._task: Future[None] | None = None

    def run(self, work: Callable[[], None]) -> None:
        """Calls `work` soon, unless other work comes before; not once it is closed."""
        self._last = work
        with suppress(RuntimeError):
            self._task = self._pool.submit(self._do, work)

    def join(self) -> None:
        """Waits until the last work is done; raises what that ended with."""
        if self._task is not None:
            self._task.result()

    def close(self) -> None:
        """Forgets what waits, and waits for what is done; nothing more is."""
        self._last = None
        self._pool.shutdown()

    def _do(self, work: Callable[[], None]) -> None:
        if work is self._last:
            time.sleep(WAIT)
        if work is self._last:
            work()


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
        self._lock = threading.Lock()
        self._over = threading.Event()  # of the replay that is the last one
        self._over.set()
        self._closed = False
        self._at_rest = threading.Event()
        self._at_rest.set()
        self.slider.on_update(self._take)
        self.slider.on_update(self._moved)

    @property
    def playing(self) -> bool:
        """Whether a replay runs."""
        return not self._at_rest.is_set()

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
        runs. Returns once it is over."""
        with self._lock:
            self._over.set()
            if self.playing or self._closed or len(self._times) == 0:
                return
            times, over = self._times, threading.Event()
            self._over = over
            self._at_rest.clear()
        try:
            self.button.label = STOP
            self._play(times, over)
        finally:
            over.set()
            self.button.label = self._label
            self._at_rest.set()

    def join(self) -> None:
        """Waits until none runs."""
        self._at_rest.wait()

    def stop(self) -> None:
        """Ends the replay, if there is one, where it is: the slider moves no more."""
        with self._lock:
            self._over.set()

    def close(self) -> None:
        """Ends the replay, waits for that, and starts no other: the loop is about to end."""
        self._closed = True
        self.stop()
        self.join()

    async def _take(self, event: Any) -> None:
        """A move by hand stops the replay, which would take it away again."""
        if event.client_id is None or self._over.is_set():
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

    def _play(self, times: NDArray[np.float64], over: threading.Event) -> None:
        last = len(times) - 1
        waits = [*np.diff(times), 0.0]
        for moment in range(int(value_of(self.slider)) % max(last, 1), last + 1):
            moved = asyncio.run_coroutine_threadsafe(self._move(moment, over), self._loop)
            if not moved.result():
                return
            self.draw()
            over.wait(waits[moment])

    async def _move(self, moment: int, over: threading.Event) -> bool:
        """Moves the slider unless the replay is over; whether it did."""
        with self._lock:
            if not over.is_set():
                set_value(self.slider, moment)
            return not over.is_set()


def value_of(slider: Any) -> float:
    """Value of a slider; a number that was typed out of its range is put back."""
    value = float(min(max(slider.value, slider.min), slider.max))
    if value != slider.value:
        set_value(slider, value)
    return value


def set_value(control: Any, value: float) -> None:
    """Moves a slider or bar: viser lets one, but its types do not say so."""
    control.value = value
