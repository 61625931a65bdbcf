"""What happens on the page: each control, and what it shows."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

import energymargin as em
from energymargin.look.viewer import background, texts
from energymargin.look.viewer.panel import Panel
from energymargin.look.viewer.search import Scored, ShareProgress, score_state, tree_cache
from energymargin.look.viewer.sources import Frames, FrameScores, StateSource
from energymargin.look.viewer.stage import Stage

NOTIFICATION = 10.0  # s that one is shown
AMBIENT = 1.3  # light from all sides, beside the lamps


class Page:
    """What all browsers see: they share one state."""

    def __init__(
        self,
        server: viser.ViserServer,
        source: StateSource,
        *,
        trajectory: int = 0,
        frame: int = 0,
        settings: em.searches.SearchSettings,
        stored: FrameScores | None = None,
    ) -> None:
        """Draws a frame. Nodes and rollouts of the settings are those that the controls begin with.

        Raises ValueError if there is no such frame, or its state makes no problem.
        """
        self._server, self._source, self._stored = server, source, stored
        self._settings = settings
        self._lock = threading.RLock()
        self._searching, self._cache = background.WorkThread(), tree_cache()
        self._sets_later, self._nodes_later, self._future_later = later = [
            background.WorkThread(background.WAIT) for _ in range(3)
        ]
        self._working = (self._searching, *later)
        self._future: em.futures.Undisturbed | None = None  # of what is shown, once simulated
        self._error: Exception | None = None
        self._trajectory, self._frame = trajectory, frame
        self._frames = source.frames(trajectory)
        if not 0 <= frame < len(self._frames.times):
            raise ValueError(f"frame is {frame}, expected 0 to {len(self._frames.times) - 1}")
        self._problem = self._frames.problem(frame)
        _light(server)
        self._stage = Stage(server)
        self._stage.set_up(self._problem, self._frames)
        curves = None if stored is None else stored.curves
        self._panel = Panel(server, self._lock, source, self._problem, settings, curves=curves)
        background.set_value(self._panel.trajectory, trajectory)
        self._players = (self._panel.escape, self._panel.future)
        self._panel.show_frames(self._frames, frame)
        self._show_frame()
        self._connect()

    @property
    def scored(self) -> Scored | None:
        """The scores of the frame that is shown, with their trees; None if there are none yet."""
        return self._cache.get((self._trajectory, self._frame))

    def score(self, progress: ShareProgress | None = None) -> None:
        """Scores the frame that is shown, in the background; progress(share) is called too."""
        self._start([self._frame], progress)

    def wait(self) -> None:
        """Until nothing runs in the background; raises what a search ended with."""
        for work in self._working:
            work.join()
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Ends what runs in the background."""
        for player in self._players:
            player.close()
        for work in self._working:
            work.close()

    # What is shown

    def _show_frame(self) -> None:
        """The present frame: bodies and texts at once, its sets once the controls rest."""
        self._panel.shown["success set"].visible = self._problem.succeeded is not None
        self._panel.what.content = texts.frame_text(self._frames, self._frame)
        self._show_future(None)
        self._show_scored()
        self._stage.clear_sets()
        self._sets_later.start(self._draw_sets)
        if self._problem.horizon is not None:
            self._future_later.start(self._simulate_future)

    def _draw_sets(self, _: em.Cancel) -> None:
        try:
            drawn = self._stage.draw_sets()
        except Exception as error:  # of a predicate
            self._notify("The sets cannot be drawn", str(error))
        else:
            self._panel.sets.content = texts.sets_text(self._problem, drawn)

    def _simulate_future(self, cancel: em.Cancel) -> None:
        """The undisturbed future of the problem that is shown, unless it moved on meanwhile."""
        problem, future, why = self._problem, None, ""
        try:
            future = em.futures.undisturbed(problem, cancel)
        except em.Cancelled:
            return
        except Exception as error:  # it diverges, or a predicate raises
            why = str(error)
        with self._lock:
            if problem is self._problem:
                self._show_future(future, why)

    def _show_future(self, future: em.futures.Undisturbed | None, why: str = "") -> None:
        self._future = future
        self._panel.future.set_up(None if future is None else future.times)
        self._stage.draw_future(future)
        self._panel.future_text.content = texts.future_text(self._problem, future, why=why)
        self._panel.legend.content = texts.legend(self._problem, self.scored, future)

    def _show_scored(self) -> None:
        """The tree of the present frame, its scores and its way out."""
        scored = self.scored
        way = None if scored is None else scored.way_out
        self._stage.put(self._problem)
        self._panel.escape.set_up(None if way is None else way.times)
        self._panel.show_curve(scored)
        self._panel.escape_text.content = texts.escape_text(scored)
        self._stage.draw_way(scored)
        self._show_nodes()

    def _show_nodes(self) -> None:
        """As many nodes as the slider asks for, and their scores."""
        scored = self.scored
        dots, edges = self._stage.draw_tree(scored, self._nodes())
        self._panel.legend.content = texts.legend(self._problem, scored, self._future)
        self._panel.drawn.content = texts.drawn_text(dots, edges)
        self._show_scores()

    def _show_scores(self) -> None:
        """Shows the scores of the nodes that are shown, at the slider's lambda, and those along the
        trajectory."""
        panel, file = self._panel, self._stored
        stored = [] if file is None else file.at(self._frames.first + self._frame)
        panel.scores.content = texts.score_table(
            self.scored, self._nodes(), background.value_of(panel.rate), stored
        )
        panel.plot(self._frames.times, self._along(), self._frame)

    def _along(self) -> dict[str, NDArray[np.float64]]:
        """Scores in each frame of the trajectory by name: the stored ones if there are scores of a
        file, else those of the trees that there are; NaN is one that is missing."""
        first, frames = self._frames.first, len(self._frames.times)
        along = {name: np.full(frames, np.nan) for name in self._panel.curves}
        if self._stored is not None:
            there = {n: row[first : first + frames] for n, row in self._stored.curves.items()}
            return along | there
        nodes, rate = self._panel.asked_nodes(), background.value_of(self._panel.rate)
        for frame in range(frames):
            scored = self._cache.get((self._trajectory, frame))
            values = {} if scored is None else scored.values(nodes, rate)
            for name in along.keys() & values:
                along[name][frame] = values[name]
        return along

    def _nodes(self) -> int:
        """How many are shown: those of the tree, or fewer."""
        there = 0 if self.scored is None else self.scored.nodes
        return min(self._panel.asked_nodes(), there)

    # What happens when a control is moved

    def _connect(self) -> None:
        panel = self._panel
        panel.trajectory.on_update(self._then(self._choose_frame))
        panel.frame.on_update(self._then(self._choose_frame))
        show_nodes = self._then(self._show_nodes)
        panel.nodes.on_update(lambda _: self._nodes_later.start(show_nodes))
        panel.rate.on_update(self._then(self._show_scores))
        panel.score.on_click(lambda _: self._press_score())
        panel.score_all.on_click(lambda _: self._start())
        panel.escape.connect(self._choose_moment)
        panel.escape.button.on_click(lambda _: self._play(panel.escape))
        panel.future.connect(self._choose_ahead)
        panel.future.button.on_click(lambda _: self._play(panel.future))
        for box in panel.shown.values():
            box.on_update(self._then(self._choose_shown))

    def _then(self, action: Callable[[], None]) -> Callable[[Any], None]:
        """Handlers run on several threads at once: one after the other."""

        def handle(_: Any) -> None:
            with self._lock:
                action()

        return handle

    def _choose_frame(self) -> None:
        """Shows the frame of the sliders; they go back if its state makes no problem."""
        panel = self._panel
        trajectory = min(int(background.value_of(panel.trajectory)), self._source.trajectories - 1)
        is_other = trajectory != self._trajectory
        frames = self._source.frames(trajectory) if is_other else self._frames
        frame = min(int(background.value_of(panel.frame)), len(frames.times) - 1)
        if not is_other and frame == self._frame:
            return
        problem = self._problem_of(frames, frame)
        if problem is None:
            background.set_value(panel.trajectory, self._trajectory)
            background.set_value(panel.frame, self._frame)
            return
        self._trajectory, self._frames = trajectory, frames
        self._frame, self._problem = frame, problem
        if is_other:
            self._stage.set_up(problem, frames)  # its parameters may make other bodies
            panel.show_rate(problem.rate)
            panel.show_frames(frames, frame)
        self._show_frame()

    def _choose_moment(self, moment: int) -> None:
        scored = self.scored
        if scored is not None and scored.way_out is not None:
            self._stage.put_state(scored.way_out.states[moment])
            self._panel.escape_text.content = texts.escape_text(scored, moment)

    def _choose_ahead(self, moment: int) -> None:
        if self._future is not None:
            self._stage.put_state(self._future.states[moment])
            self._panel.future_text.content = texts.future_text(self._problem, self._future, moment)

    def _choose_shown(self) -> None:
        self._stage.choose({name: box.value for name, box in self._panel.shown.items()})

    def _press_score(self) -> None:
        if self._searching.running:
            self._searching.stop()
        else:
            self._start([self._frame])

    def _play(self, player: background.Player) -> None:
        for other in self._players:
            if other is not player:
                other.stop()  # both move the bodies
        player.press()

    # Scores

    def _start(
        self, frames: list[int] | None = None, progress: ShareProgress | None = None
    ) -> None:
        """Scores these frames of the trajectory, by default all, one after the other, in the
        background."""
        with self._lock:
            trajectory, recorded = self._trajectory, self._frames
            chosen = list(range(len(recorded.times))) if frames is None else frames
            asked = replace(
                self._settings,
                nodes=self._panel.asked_nodes(),
                rollouts=int(background.value_of(self._panel.rollouts)),
            )

        def work(cancel: em.Cancel) -> None:
            self._error = None
            self._panel.searching(True)
            try:
                for number, frame in enumerate(chosen):
                    problem = self._problem_of(recorded, frame)
                    if problem is None or cancel.is_set:
                        continue

                    def tell(share: float, number: int = number) -> None:
                        done = (number + share) / len(chosen)
                        background.set_value(self._panel.progress, 100.0 * done)
                        if progress is not None:
                            progress(done)

                    place = None if recorded.numbers is None else recorded.numbers[frame]
                    scored = score_state(
                        *(problem, asked, place, cancel, tell), disturbance=recorded.disturbance
                    )
                    self._keep(trajectory, frame, scored)
            except Exception as error:  # of a predicate, a task, the memory: shown on the page
                self._error = error
                self._notify("The search ended with an error", str(error))
            finally:
                self._panel.searching(False)

        self._searching.start(work)

    def _keep(self, trajectory: int, frame: int, scored: Scored) -> None:
        """Keeps it, and shows what of it is to be seen; not if it was stopped before it began."""
        if scored.empty:
            return
        scored.read_off()
        with self._lock:
            before = self._cache.get((trajectory, frame))
            if not scored.complete and before is not None and before.size >= scored.size:
                return
            self._cache.get((self._trajectory, self._frame))  # what is shown is not the next to go
            self._cache[trajectory, frame] = scored
            if (trajectory, frame) == (self._trajectory, self._frame):
                self._show_scored()
            elif trajectory == self._trajectory:
                self._show_scores()

    def _problem_of(self, frames: Frames, frame: int) -> em.Problem | None:
        """None, and a notification, if the state makes none."""
        try:
            return frames.problem(frame)
        except ValueError as error:
            self._notify(f"Frame {frame} makes no problem", str(error))
            return None

    def _notify(self, title: str, text: str) -> None:
        """Shows a notification in all browsers."""
        for client in self._server.get_clients().values():
            client.add_notification(title, text, auto_close_seconds=NOTIFICATION)


def _light(server: viser.ViserServer) -> None:
    """Without shadows, which take half of a frame's time, and in the colours of the legend."""
    server.scene.configure_environment_map(None)
    server.scene.configure_default_lights(cast_shadow=False)
    server.scene.add_light_ambient("/light", intensity=AMBIENT)
