"""A viewer of problems, datasets and tasks."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import rich

from energymargin._core import Problem
from energymargin.checks import whole_number
from energymargin.closing import Closing
from energymargin.datasets import Dataset, Future
from energymargin.settings import MOST_NODES
from energymargin.viewer.guard import HOST, Guard, guarded_server, port_at, served_at
from energymargin.viewer.page import Page
from energymargin.viewer.sources import StateSource, StoredScores, Trajectories, source_of

__all__ = ["Viewer", "view"]


SEARCH = {"nodes": 1000, "seed": 0}


class Viewer(Closing):
    """A page that is served until `close`; browsers may come and go."""

    def __init__(self, source: StateSource, host: str, port: int | None, **options: Any) -> None:
        """Serves it; `options` are those of Page."""
        self.host, self._source, self._closed = host, source, False
        try:
            self.port = port_at(host, port)
        except ValueError:
            source.close()
            raise
        guard = Guard(host)
        self._token = guard.token
        try:
            with _hushed():
                self._server = guarded_server(host, self.port, guard)
        except RuntimeError:
            source.close()
            raise
        try:
            self.port = served_at(self._server.get_port(), self.port, port)
            self.page = Page(self._server, source, **options)
        except BaseException:
            self._stop()
            raise

    @property
    def url(self) -> str:
        """Where a browser of this machine finds it: with the token that it needs."""
        host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self.host, self.host)
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/{self._token}/"

    def close(self) -> None:
        """Ends its searches, and no longer serves it."""
        self._closed = True
        self.page.close()
        self._stop()

    def _stop(self) -> None:
        with _hushed():
            self._server.stop()
        self._source.close()

    def __repr__(self) -> str:
        """Where it is."""
        return f"<Viewer of {self._source.title} at {self.url}>"

    def _repr_html_(self) -> str:
        if self._closed:
            return "<p>This viewer is closed.</p>"
        return f'<iframe src="{self.url}" width="100%" height="600" style="border:0"></iframe>'


@contextmanager
def _hushed() -> Iterator[None]:
    """viser says on stdout where it serves and when it stops, and cannot be told not to."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


def view(
    what: Problem | Dataset | str | os.PathLike[str],
    parameters: Mapping[str, Any] | None = None,
    *,
    trajectory: int = 0,
    frame: int = 0,
    nodes: int | None = None,
    seed: int | None = None,
    future: Future | None = None,
    scores: str | os.PathLike[str] | None = None,
    run: int | None = None,
    host: str = HOST,
    port: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Viewer:
    """Serves a page that shows a problem, a dataset, the file of one, or a task with parameters.

    It begins with a frame of a trajectory; `viewer.page.score()` scores it with so many nodes and
    this seed, as the button of the page does; None are those of `scores`, or else 1000 and 0.
    future: what is asked of the states of a dataset or a task. em.datasets.Future(5, "hold") asks
    whether they stay captured over the next five frames while the robot goes on as it moves; None
    asks what `scores` did, or else about each state as it is.
    scores: a file of scores of the dataset, to see beside; run: which of its runs. Other machines
    reach it only if `host` is an address that they know, such as "0.0.0.0". Whoever has the whole
    address, with its token, may use the page, and nobody else. port: None takes a free one.
    progress(done, total): of the trajectories of a task. Raises ValueError on bad input or a port
    that is taken, and OSError on files that cannot be read.
    """
    if nodes is not None:
        whole_number("nodes", nodes, 1, MOST_NODES)
    if run is not None and scores is None:
        raise ValueError(f"run is {run}, but there are no scores that it is of")
    for name, number in {"trajectory": trajectory, "frame": frame}.items():
        whole_number(name, number, 0)
    source = source_of(what, parameters, seed=seed or 0, future=future, progress=progress)
    try:
        stored = None if scores is None else _stored(source, scores, run)
        source = source if stored is None else _asked(source, stored, future)
    except BaseException:
        source.close()
        raise
    search = SEARCH if stored is None else SEARCH | stored.search
    given = {name: n for name, n in {"nodes": nodes, "seed": seed}.items() if n is not None}
    options: dict[str, Any] = {"trajectory": trajectory, "frame": frame, **search, **given}
    return Viewer(source, host, port, stored=stored, **options)


def _stored(source: StateSource, scores: str | os.PathLike[str], run: int | None) -> StoredScores:
    if not isinstance(source, Trajectories):
        raise ValueError(f"scores are {str(scores)!r}, of no use with a problem alone")
    return StoredScores(scores, source.dataset, run)


def _asked(source: StateSource, stored: StoredScores, future: Future | None) -> StateSource:
    """The states as the scores ask about them; ValueError if something else is wanted."""
    if future is not None and future != stored.future:
        asks = "states as they are" if stored.future is None else f"the future: {stored.future}"
        raise ValueError(
            f"what is asked is {future}, but the scores are about {asks}: leave the horizon out, "
            "or give another run"
        )
    return replace(source, future=stored.future) if isinstance(source, Trajectories) else source
