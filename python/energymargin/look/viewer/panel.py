"""The controls beside the scene."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

import energymargin as em
from energymargin.look.viewer.background import STOP, Player, set_value, value_of
from energymargin.look.viewer.search import Scored
from energymargin.look.viewer.sources import EFFORT, Frames, StateSource
from energymargin.look.viewer.stage import SHOWN, UNDISTURBED
from energymargin.look.viewer.texts import plain

BAND = "#56B4E9"
# Scores along a trajectory; the second are those of problems with a horizon. Of an interval's ends
# only those of a MarginProfile are known.
LINES = {
    False: {"capture": "#0072B2", "success": "#000000"},
    True: {"probability": "#0072B2", "probability/success": "#000000", "low": BAND, "high": BAND},
}
EFFORTS = {EFFORT: "#009E73"}
CURVE = {"captured": "#0072B2", "low": BAND, "high": BAND}  # over the horizon
NOW = "#D55E00"
MOST_ROLLOUTS = 1000  # of the slider
RATES = 20.0  # 1/J, for a problem whose lambda is 0
MOST_ASKED = 1_000_000  # nodes: a quarter of a gigabyte, and minutes
SHARES = (-0.05, 1.1)
OVER = 1.1  # times the largest effort, where its axis ends
STEPS = 200  # of the slider of lambda
SCORE = "Score this state"


class Panel:
    """The controls; `Page` connects them."""

    def __init__(
        self,
        server: viser.ViserServer,
        lock: AbstractContextManager[Any],
        source: StateSource,
        problem: em.Problem,
        settings: em.searches.SearchSettings,
        *,
        curves: Collection[str] | None,
    ) -> None:
        """Adds the controls, with the nodes and rollouts of the settings; those of a probability
        if the problem has a horizon. Replays show with the lock. `curves` names what scores of a
        file there are along a trajectory; None: what a search of the problem has."""
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
        gui.set_panel_label(f"Energy margin: {source.title}")
        with gui.add_folder("State"):
            last = source.trajectories - 1
            self.trajectory = gui.add_slider("trajectory", 0, max(last, 1), 1, 0, visible=last > 0)
            self.frame = gui.add_slider("frame", 0, 1, 1, 0)
            self.what = gui.add_html("")
        with gui.add_folder("Undisturbed future", visible=timed):
            self.future_text = gui.add_html("")
            self.future = Player(server, "ahead", "Replay the future", lock)
        with gui.add_folder("Scores"):
            self._add_scores(gui, settings, problem.rate, timed=timed)
        with gui.add_folder("Escape"):
            self.escape_text = gui.add_html("")
            self.escape = Player(server, "moment", "Replay the escape", lock)
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

    def plot(
        self, times: NDArray[np.float64], scores: Mapping[str, NDArray[np.float64]], frame: int
    ) -> None:
        """Scores along the trajectory, NaN where there is none; the present frame as a dot."""
        if self._has_efforts:
            # uPlot finds no range of its own where numbers are missing.
            scales = _scales((0.0, OVER * float(np.nanmax(scores[EFFORT])) or 1.0))
            if scales != self._efforts.scales:
                self._efforts.scales = scales
        plots = [(self._plot, [*self._lines])]
        plots += [(self._efforts, [*EFFORTS])] if self._has_efforts else []
        for plot, names in plots:
            plot.visible = len(times) > 1
            if plot.visible:
                now = np.full(len(times), np.nan)
                now[frame] = scores[names[0]][frame]
                plot.data = (times, *(scores[name] for name in names), now)

    def _add_scores(
        self, gui: viser.GuiApi, settings: em.searches.SearchSettings, rate: float, *, timed: bool
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
            hint="Rollouts of the probability; more make its interval narrower when scored again.",
            visible=timed,
        )
        self._curve = _plot(gui, "time ahead [s]", _series(CURVE, dots=False))
        self._plot = _plot(gui, "time [s]", _series(self._lines))
        efforts = {f"{name} [J]": color for name, color in EFFORTS.items()}
        self._efforts = _plot(gui, "time [s]", _series(efforts))


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


def _series(lines: Mapping[str, str], *, dots: bool = True) -> list[uplot.Series]:
    """A line by name and colour; with a dot at each number, but on ends of an interval, and a
    larger one that is now."""
    drawn = [
        uplot.Series(
            label=name,
            stroke=color,
            width=1 if color == BAND else 2,
            points=uplot.Series_Points(show=dots and color != BAND, size=4),
        )
        for name, color in lines.items()
    ]
    if not dots:
        return drawn
    dot = uplot.Series_Points(show=True, size=10, fill=NOW)
    return [*drawn, uplot.Series(label="now", stroke=NOW, width=0, points=dot)]
