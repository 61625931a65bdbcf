"""A viewer of problems, datasets and tasks."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import rich
import viser

import energymargin as em
from energymargin.base.checks import whole_number
from energymargin.base.closing import Closing
from energymargin.look.viewer import sources
from energymargin.look.viewer.page import Page

HOST, PORT = "127.0.0.1", 8080  # only this machine reaches it


class Server(viser.ViserServer):
    """A server that no browser can ask for a public tunnel."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Refuses it."""


class Viewer(Closing):
    """A page that is served to this machine until `close`; browsers may come and go."""

    def __init__(self, source: sources.StateSource, port: int = PORT, **options: Any) -> None:
        """Serves it at the port or the first free one behind it; `options` are those of Page."""
        self._source, self._closed = source, False
        with _silent():
            self._server = Server(HOST, port, verbose=False)
        self.port = self._server.get_port()
        try:
            self.page = Page(self._server, source, **options)
        except BaseException:
            self._stop()
            raise

    @property
    def url(self) -> str:
        """Where a browser of this machine finds it."""
        return f"http://{HOST}:{self.port}/"

    def close(self) -> None:
        """Ends its searches, and no longer serves it."""
        self._closed = True
        self.page.close()
        self._stop()

    def _stop(self) -> None:
        with _silent():
            self._server.stop()
        self._source.close()

    def __repr__(self) -> str:
        """Where it is."""
        return f"<Viewer of {self._source.title} at {self.url}>"

    def _repr_html_(self) -> str:
        if self._closed:
            return "<p>This viewer is closed.</p>"
        return f'<iframe src="{self.url}" width="100%" height="600" style="border:0"></iframe>'


def view(
    what: em.Problem | em.datasets.Dataset | em.MarginProfile | str | os.PathLike[str],
    *,
    parameters: Mapping[str, Any] | None = None,
    trajectory: int | None = None,
    frame: int | None = None,
    nodes: int | None = None,
    seed: int | None = None,
    future: em.datasets.Future | None = None,
    scores: str | os.PathLike[str] | None = None,
    run: int | None = None,
    port: int = PORT,
    progress: Callable[[int, int], None] | None = None,
) -> Viewer:
    """Serves a page that shows a problem, a dataset, the file of one, a task, or a margin along a
    plan.

    `viewer.page.score()` scores the frame that is shown, as the button of the page does. Only
    this machine reaches the page; all who can use the machine can use it.

    Args:
        what: a problem, a dataset, a path to the file of one, the name of a task, of which
            trajectories are generated, or a MarginProfile, whose moments are the frames.
        parameters: of the task.
        trajectory: the one that is shown first, from 0. None takes the first one that ends outside
            of its capture set, or else the first.
        frame: of that trajectory, from 0. None takes one a quarter of all frames before its last
            loss, the middle one without a loss, or the weakest moment of a MarginProfile.
        nodes: nodes of each search tree. None takes those of `scores` or of a MarginProfile, or
            else 1000.
        seed: of searches and of a task's trajectories. None takes that of `scores`
            or of a MarginProfile, or else 0.
        future: the horizon and plan of the states of a dataset or a task:
            `em.datasets.Future(5, "hold")` asks whether they stay captured over the next five
            frames while the robot goes on as it moves. None takes that of `scores`, or else asks
            about each state as it is.
        scores: a file of scores of the dataset, to compare with.
        run: which of its runs, if there are several.
        port: where it is served; if it is taken, at the next one that is free.
        progress: progress(done, total) counts the trajectories of a task that are generated.

    Returns:
        The viewer, which serves the page until `close`.

    Raises:
        ValueError: on bad input.
        OSError: on files that cannot be read.
    """
    whole_number("port", port, 1, 65535)
    if run is not None and scores is None:
        raise ValueError(f"run is {run}, but there are no scores that it is of")
    for name, number in {"trajectory": trajectory, "frame": frame}.items():
        if number is not None:
            whole_number(name, number, 0)
    given = {name: n for name, n in {"nodes": nodes, "seed": seed}.items() if n is not None}
    source = sources.source_of(what, parameters, seed=seed or 0, progress=progress)
    try:
        stored = _scores_of(source, scores, run, future)
        source = _asked(source, future if scores is None or stored is None else stored.future)
        settings = em.searches.SearchSettings(**({} if stored is None else stored.search) | given)
        trajectory, frame = sources.first_frame(source, trajectory, frame)
    except BaseException:
        source.close()
        raise
    start = {"trajectory": trajectory, "frame": frame}
    return Viewer(source, port, stored=stored, settings=settings, **start)


@contextmanager
def _silent() -> Iterator[None]:
    """Silences viser, which prints where it serves and when it stops and has no option for it."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


def _scores_of(
    source: sources.StateSource,
    scores: str | os.PathLike[str] | None,
    run: int | None,
    future: em.datasets.Future | None,
) -> sources.FrameScores | None:
    """Scores of a file, or of a MarginProfile; ValueError if they are about another question."""
    if scores is None:
        return (
            sources.profile_scores(source.what)
            if isinstance(source.what, em.MarginProfile)
            else None
        )
    if not isinstance(source.what, em.datasets.Dataset):
        kind = "a MarginProfile" if isinstance(source.what, em.MarginProfile) else "a problem"
        raise ValueError(f"scores are {str(scores)!r}, of no use with {kind} alone")
    name = source.title if source.opened else "DATASET"
    stored = sources.stored_scores(scores, source.what, run, name)
    if future is not None and future != stored.future:
        asks = "states as they are" if stored.future is None else f"the future: {stored.future}"
        raise ValueError(
            f"what is asked is {future}, but the scores are about {asks}: leave the horizon out, "
            "or give another run"
        )
    return stored


def _asked(source: sources.StateSource, future: em.datasets.Future | None) -> sources.StateSource:
    """The source whose states are asked about this future; ValueError on what is no dataset."""
    if future is not None and not isinstance(source.what, em.datasets.Dataset):
        raise ValueError(
            f"the horizon is {future.frames} frames, but there is no dataset that has them: give a "
            "problem its horizon in seconds, problem.replace(horizon=...)"
        )
    return replace(source, future=future)
