"""The controls beside the scene, and the replay of an escape or of a future in real time."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from energymargin._core import Problem
from energymargin.futures import Undisturbed
from energymargin.searches import SearchSettings
from energymargin.viewer.search import Scored
from energymargin.viewer.sources import EFFORT, Frames
from energymargin.viewer.stage import SHOWN, UNDISTURBED
from energymargin.viewer.texts import plain

__all__ = ["Panel", "Player", "set_value", "value_of"]

BAND = "#56B4E9"
# Scores along a trajectory; the second are those of problems with a horizon. Of an interval's ends
# only those of an Along are known.
LINES = {
    False: {"capture": "#0072B2", "success": "#000000"},
    True: {"probability": "#0072B2", "probability/success": "#000000", "low": BAND, "high": BAND},
}
EFFORTS = {EFFORT: "#009E73"}
MOST_ROLLOUTS = 1000  # of the slider
RATES = 20.0  # 1/J, for a problem whose lambda is 0
MOST_ASKED = 1_000_000  # nodes: a quarter of a gigabyte, and minutes
SHARES = (-0.05, 1.1)
OVER = 1.1  # times the largest effort, where its axis ends
STEPS = 200  # of the slider of lambda
SCORE, PLAY, STOP = "Score this state", "Replay the escape", "Stop"
AHEAD = "Replay the future"


class Panel:
    """The controls; `Page` connects them."""

    def __init__(
        self,
        server: viser.ViserServer,
        *,
        title: str,
        trajectories: int,
        trajectory: int,
        problem: Problem,
        settings: SearchSettings,
        curves: Collection[str] | None = None,
    ) -> None:
        """Adds the controls, with the nodes and rollouts of the settings; those of a probability
        if the problem has a horizon. `curves` names what scores of a file there are along a
        trajectory; None: what a search of the problem has."""
        gui, timed = server.gui, problem.horizon is not None
        first, success, *_ = LINES[timed]
        there = {first, success if problem.succeeded is not None else first}
        there = there if curves is None else {first, *curves}
        self._lines = {name: color for name, color in LINES[timed].items() if name in there}
        self._has_efforts = EFFORT in there
        gui.configure_theme(
            control_width="medium",
            show_logo=False,
            show_share_button=False,  # it would publish the page through a stranger's server
            brand_color=(0, 114, 178),
        )
        gui.main_panel.dock_right()
        gui.set_panel_label(f"Energy margin: {title}")
        with gui.add_folder("State"):
            self.trajectory = gui.add_slider(
                "trajectory", 0, max(trajectories - 1, 1), 1, trajectory, visible=trajectories > 1
            )
            self.frame = gui.add_slider("frame", 0, 1, 1, 0)
            self.what = gui.add_html("")
        with gui.add_folder("Undisturbed future", visible=timed):
            self.future_text = gui.add_html("")
            self.ahead = gui.add_slider("ahead", 0, 1, 1, 0, disabled=True)
            self.play_future = gui.add_button(AHEAD, disabled=True, color="blue")
        with gui.add_folder("Scores"):
            self._add_scores(gui, settings, problem.rate, timed=timed)
        with gui.add_folder("Escape"):
            self.escape_text = gui.add_html("")
            self.moment = gui.add_slider("moment", 0, 1, 1, 0, disabled=True)
            self.play = gui.add_button(PLAY, disabled=True, color="blue")
        with gui.add_folder("Show"):
            self.legend = gui.add_html("")
            self.drawn = gui.add_html("")
            self.sets = gui.add_html("")
            self.shown = {name: gui.add_checkbox(name, True) for name in SHOWN}
            self.shown[UNDISTURBED].visible = timed

        self._rate = problem.rate

    @property
    def curves(self) -> list[str]:
        """Names of what `plot` draws."""
        return [*self._lines, *(EFFORTS if self._has_efforts else ())]

    def asked_nodes(self) -> int:
        """How many nodes; the slider grows if more are typed beside it."""
        if self.nodes.value > self.nodes.max:
            self.nodes.max = min(int(self.nodes.value), MOST_ASKED)
        return int(value_of(self.nodes))

    def show_rate(self, rate: float) -> None:
        """The slider of lambda at a problem's own; it stays if it was another problem's with the
        same."""
        if rate != self._rate:
            self._rate = rate
            self.rate.max = 4 * rate or RATES
            self.rate.step = self.rate.max / STEPS
            set_value(self.rate, rate)

    def show_frames(self, frames: Frames, frame: int) -> None:
        """The frame slider for another trajectory."""
        last = len(frames.times) - 1
        self.frame.visible = last > 0
        self.frame.max = max(last, 1)
        set_value(self.frame, frame)
        self.score_all.visible = last > 0

    def show_moments(self, scored: Scored | None) -> None:
        """The slider of the way out, from its start on; disabled if there is none."""
        way = None if scored is None else scored.way_out
        _show_way(self.moment, self.play, 0 if way is None else len(way.times))

    def show_future(self, future: Undisturbed | None) -> None:
        """The slider of the undisturbed future, from its start on; disabled if there is none."""
        _show_way(self.ahead, self.play_future, 0 if future is None else len(future.times))

    def show_curve(self, scored: Scored | None) -> None:
        """The probability over the horizon between the ends of its intervals."""
        found = None if scored is None else scored.probability
        self._curve.visible = found is not None
        if found is not None:
            low, high = found.band()
            self._curve.data = (found.times, found.curve, low, high)

    def searching(self, searching: bool) -> None:
        """The button stops a search that runs."""
        self.score.label = STOP if searching else SCORE
        self.score.color = "red" if searching else "blue"
        self.score_all.disabled = searching
        set_value(self.progress, 0.0)
        self.progress.visible = searching

    def playing(self, playing: bool) -> None:
        """The button stops a replay that runs."""
        self.play.label = STOP if playing else PLAY

    def playing_future(self, playing: bool) -> None:
        """The same of the undisturbed future."""
        self.play_future.label = STOP if playing else AHEAD

    def plot(
        self, times: NDArray[np.float64], scores: Mapping[str, NDArray[np.float64]], frame: int
    ) -> None:
        """Scores along the trajectory, NaN where there is none; the present frame as a dot."""
        self._plot.visible = len(times) > 1
        self._efforts.visible = len(times) > 1 and self._has_efforts
        if self._plot.visible:
            self._plot.data = _with_dot(times, [scores[name] for name in self._lines], frame)
        if self._efforts.visible:
            efforts = _with_dot(times, [scores[name] for name in EFFORTS], frame)
            # uPlot finds no range of its own where numbers are missing.
            scales = _scales((0.0, OVER * float(np.nanmax(efforts[1])) or 1.0))
            if scales != self._efforts.scales:
                self._efforts.scales = scales
            self._efforts.data = efforts

    def _add_scores(
        self, gui: viser.GuiApi, settings: SearchSettings, rate: float, *, timed: bool
    ) -> None:
        most_rate = 4 * rate or RATES
        self.scores = gui.add_html(plain("Not scored yet."))
        self.score = gui.add_button(SCORE, color="blue")
        self.score_all = gui.add_button("Score all frames", color="blue")
        self.progress = gui.add_progress_bar(0.0, visible=False, animated=True)
        most_nodes = max(2 * settings.nodes, 2000)
        self.nodes = gui.add_slider(
            "nodes",
            *(1, most_nodes, 1, settings.nodes),
            hint="Fewer are shown at once; more when scored again.",
        )
        self.rate = gui.add_slider(
            "lambda [1/J]",
            *(0.0, most_rate, most_rate / STEPS, rate),  # so many digits are shown
            hint="How fast likelihood falls with cost, eq. 4; at first the problem's own.",
        )
        self.rate.visible = not timed
        rollouts = settings.rollouts
        self.rollouts = gui.add_slider(
            *("rollouts", 1, max(MOST_ROLLOUTS, 2 * rollouts), 1, rollouts),
            hint="Of the probability; more make its interval narrower when scored again.",
            visible=timed,
        )
        self._curve = _plot(gui, "time ahead [s]", _curve_series())
        self._plot = _plot(gui, "time [s]", _series(self._lines))
        efforts = {f"{name} [J]": color for name, color in EFFORTS.items()}
        self._efforts = _plot(gui, "time [s]", _series(efforts))


def value_of(slider: Any) -> float:
    """Of a slider; the number beside it may be typed out of its range, and is then put back."""
    value = float(min(max(slider.value, slider.min), slider.max))
    if value != slider.value:
        set_value(slider, value)
    return value


def set_value(control: Any, value: float) -> None:
    """Moves a slider or bar: viser lets one, but its types do not say so."""
    control.value = value


def _show_way(slider: Any, button: Any, moments: int) -> None:
    """A slider of so many moments from their start on, and what replays them."""
    slider.max = max(moments - 1, 1)
    set_value(slider, 0)
    slider.disabled = button.disabled = moments < 2


def _with_dot(
    times: NDArray[np.float64], curves: Sequence[NDArray[np.float64]], frame: int
) -> tuple[NDArray[np.float64], ...]:
    """Data of a plot, with a dot on its first curve."""
    now = np.full(len(times), np.nan)
    now[frame] = curves[0][frame]
    return (times, *curves, now)


def _scales(y: tuple[float, float]) -> dict[str, uplot.Scale]:
    return {"x": uplot.Scale(time=False), "y": uplot.Scale(range=y)}


def _plot(gui: viser.GuiApi, x: str, series: Sequence[uplot.Series]) -> Any:
    """Curves from 0 to 1 that are not there yet."""
    return gui.add_uplot(
        (np.arange(2.0), *[np.full(2, np.nan)] * len(series)),
        series=(uplot.Series(label=x), *series),
        scales=_scales(SHARES),
        height=150,
        visible=False,
    )


def _series(lines: Mapping[str, str]) -> list[uplot.Series]:
    marked, plain = uplot.Series_Points(show=True, size=4), uplot.Series_Points(show=False)
    drawn = [
        uplot.Series(label=name, stroke=color, width=1, points=plain)
        if color == BAND
        else uplot.Series(label=name, stroke=color, width=2, points=marked)
        for name, color in lines.items()
    ]
    dot = uplot.Series_Points(show=True, size=10, fill="#D55E00")
    return [*drawn, uplot.Series(label="now", stroke="#D55E00", width=0, points=dot)]


def _curve_series() -> list[uplot.Series]:
    plain = uplot.Series_Points(show=False)
    ends = [
        uplot.Series(label=name, stroke=BAND, width=1, points=plain) for name in ("low", "high")
    ]
    return [uplot.Series(label="captured", stroke="#0072B2", width=2, points=plain), *ends]


class Player:
    """Moves a slider of moments; one replay at a time.

    A replay moves the slider in the event loop, where moves by hand arrive: one that somebody makes
    comes before or after a move of the replay, never within it.
    """

    def __init__(
        self,
        slider: Any,
        loop: asyncio.AbstractEventLoop,
        lock: AbstractContextManager[Any],
        show: Callable[[], None],
        on_change: Callable[[bool], None],
    ) -> None:
        """At rest; calls show() with the lock whenever the slider has moved, and on_change(playing)
        when a replay begins and ends. The loop is the server's."""
        self._slider, self._loop, self._on_change = slider, loop, on_change
        self._shown_with, self._show = lock, show
        self._lock = threading.Lock()
        self._over = threading.Event()  # of the replay that is the last one
        self._over.set()
        self._closed = False
        self._at_rest = threading.Event()
        self._at_rest.set()
        slider.on_update(self._take)
        slider.on_update(self._moved)

    @property
    def playing(self) -> bool:
        """Whether a replay runs."""
        return not self._at_rest.is_set()

    def press(self, times: NDArray[np.float64] | None) -> None:
        """Replays moments at these times [s] from the present one on, or again from the end; stops
        a replay that runs. Returns once it is over."""
        with self._lock:
            self._over.set()
            if self.playing or times is None or self._closed:
                return
            over = self._over = threading.Event()
            self._at_rest.clear()
        try:
            self._on_change(True)
            self._play(times, over)
        finally:
            over.set()
            self._on_change(False)
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
        taken = value_of(self._slider)
        # The browser may have had a later move of the replay meanwhile: it is told once more.
        set_value(self._slider, taken - 1 if taken > 0 else 1)
        set_value(self._slider, taken)

    def _moved(self, _: Any) -> None:
        """In the loop only the player moves it, which then shows it on a thread of its own."""
        if not _is_in_a_loop():
            self._draw()

    def _draw(self) -> None:
        with self._shown_with:
            self._show()

    def _play(self, times: NDArray[np.float64], over: threading.Event) -> None:
        last = len(times) - 1
        waits = [*np.diff(times), 0.0]
        for moment in range(int(value_of(self._slider)) % max(last, 1), last + 1):
            moved = asyncio.run_coroutine_threadsafe(self._move(moment, over), self._loop)
            if not moved.result():
                return
            self._draw()
            over.wait(waits[moment])

    async def _move(self, moment: int, over: threading.Event) -> bool:
        """Moves the slider unless the replay is over; whether it did."""
        with self._lock:
            if not over.is_set():
                set_value(self._slider, moment)
            return not over.is_set()


def _is_in_a_loop() -> bool:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True
