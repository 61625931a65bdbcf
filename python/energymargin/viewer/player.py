"""The replay of a way out: its moments one after the other, in its own time."""

from __future__ import annotations

import threading
import time

import numpy as np

from energymargin.viewer.panel import Panel, set_value, value_of
from energymargin.viewer.replay import Replay

__all__ = ["Player"]


class Player:
    """Moves the panel's slider of moments; one replay at a time."""

    def __init__(self, panel: Panel) -> None:
        """At rest."""
        self._panel = panel
        self._lock = threading.Lock()
        self._number = 0  # of the replay that may go on
        self.playing = False

    def press(self, way: Replay | None) -> None:
        """Replays a way out from the present moment, or again from its end; stops one that runs.
        Returns once it is over."""
        with self._lock:
            self._number += 1
            if self.playing or way is None:
                return
            self.playing, number = True, self._number
        self._panel.playing(True)
        try:
            self._play(way, number)
        finally:
            self.playing = False
            self._panel.playing(False)

    def stop(self) -> None:
        """Ends the replay, if there is one, where it is."""
        with self._lock:
            self._number += 1

    def _play(self, way: Replay, number: int) -> None:
        last = len(way.times) - 1
        waits = [*np.diff(way.times), 0.0]
        for moment in range(int(value_of(self._panel.moment)) % max(last, 1), last + 1):
            if number != self._number:
                return
            set_value(self._panel.moment, moment)  # which shows it
            time.sleep(waits[moment])
