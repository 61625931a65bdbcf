"""A search tree in the browser: nodes by cost, edges, the way out; and the undisturbed future."""

from __future__ import annotations

from itertools import compress
from typing import Any

import matplotlib
import numpy as np
import viser
from numpy.typing import NDArray

from energymargin._core import Problem, Tree
from energymargin.plots.sets import leaving_objects
from energymargin.plots.styles import COSTS, LOST_COLOR
from energymargin.undisturbed import Undisturbed
from energymargin.viewer.bodies import rgb
from energymargin.viewer.lines import lines_glb, shown_edges, shown_points
from energymargin.viewer.replay import Replay
from energymargin.viewer.views import View, object_places

__all__ = ["FUTURE_COLOR", "DrawnTree"]

DOT = 0.006  # of the view's size
EDGE_COLOR = (110, 110, 110)
PATH_COLOR = (0, 0, 0)
PATH_WIDTH = 4.0  # pixels
FUTURE_COLOR = "#0072B2"
EXIT = 4 * DOT


class DrawnTree:
    """What is drawn of one tree; each call replaces what was there."""

    def __init__(self, server: viser.ViserServer, view: View) -> None:
        """Nothing at first."""
        self._scene = server.scene
        self._view = view
        self._nodes: list[Any] = []
        self._edges: list[Any] = []
        self._path: list[Any] = []
        self._future: list[Any] = []

    def draw(
        self, problem: Problem, tree: Tree, lost: NDArray[np.bool_], nodes: int, most: float
    ) -> tuple[int, int]:
        """The root and the first `nodes` nodes, coloured by cost from 0 to `most` [J].

        lost: which object is out of its capture set in which node, shape (M + 1, k). These are
        diamonds, and the edges to them are red. Returns how many dots and edges there
        are: what falls on the same spot is drawn once.
        """
        places = object_places(problem.scene)
        kept = slice(0, nodes + 1)
        points = np.concatenate([tree.states[kept, place] for place in places])
        costs, outside = np.tile(tree.costs[kept], len(places)), lost[kept].T.ravel()
        self.clear()
        dots = shown_points(points, outside, costs, self._view.size)
        self._draw_nodes(points[dots], _colors(costs[dots], most), outside[dots])
        starts = np.concatenate([tree.states[tree.parents[1 : nodes + 1], :][:, p] for p in places])
        ends = np.concatenate([tree.states[1 : nodes + 1, place] for place in places])
        edges = np.stack([starts, ends], axis=1)
        reached = lost[1 : nodes + 1].T.ravel()
        order = np.tile(tree.costs[1 : nodes + 1], len(places))
        lines = shown_edges(edges, reached, order, self._view.size)
        self._draw_edges(edges[lines], reached[lines])
        return len(dots), len(lines)

    def draw_path(self, problem: Problem, way: Replay | None) -> None:
        """The places of the objects' centres along the way out; None: there is none."""
        _remove(self._path)
        if way is not None:
            self._path += self._lines("/escape/path", problem, way.states, PATH_COLOR)

    def draw_future(self, problem: Problem, future: Undisturbed | None) -> None:
        """The same of the undisturbed future, and diamonds where it leaves; None: there is none."""
        _remove(self._future)
        if future is None:
            return
        self._future += self._lines("/future/path", problem, future.states, rgb(FUTURE_COLOR))
        leaves, left = future.exit_moment, leaving_objects(problem, future)
        if leaves is not None:
            places = compress(object_places(problem.scene), left)
            self._future.append(
                self._scene.add_point_cloud(
                    "/future/exit",
                    np.array([future.states[leaves, p] for p in places]),
                    rgb(LOST_COLOR),
                    point_size=EXIT * self._view.size,
                    point_shape="diamond",
                    point_shading="flat",
                    precision="float32",
                )
            )

    def _lines(
        self,
        name: str,
        problem: Problem,
        states: NDArray[np.float64],
        color: tuple[int, int, int],
    ) -> list[Any]:
        """A line for each object's centre; none of a single state."""
        if len(states) < 2:
            return []
        return [
            self._scene.add_line_segments(
                f"{name}_{number}",
                np.stack([states[:-1, place], states[1:, place]], axis=1).astype(np.float32),
                color,
                thickness=PATH_WIDTH,
                thickness_units="screen",
            )
            for number, place in enumerate(object_places(problem.scene))
        ]

    def show(self, *, nodes: bool, edges: bool, path: bool, future: bool) -> None:
        """What is to be seen."""
        seen_parts = (
            (self._nodes, nodes),
            (self._edges, edges),
            (self._path, path),
            (self._future, future),
        )
        for handles, seen in seen_parts:
            for handle in handles:
                handle.visible = seen

    def clear(self) -> None:
        """Takes nodes and edges away."""
        _remove(self._nodes)
        _remove(self._edges)

    def _draw_nodes(
        self, points: NDArray[np.float64], colors: NDArray[np.uint8], outside: NDArray[np.bool_]
    ) -> None:
        for name, chosen in (("captured", ~outside), ("lost", outside)):
            if chosen.any():
                self._nodes.append(
                    self._scene.add_point_cloud(
                        f"/tree/{name}",
                        points[chosen].astype(np.float32),
                        colors[chosen],
                        point_size=DOT * self._view.size,
                        point_shape="circle" if name == "captured" else "diamond",
                        point_shading="flat",
                        precision="float32",
                    )
                )

    def _draw_edges(self, edges: NDArray[np.float64], outside: NDArray[np.bool_]) -> None:
        if len(edges):
            colors = np.where(outside[:, None], rgb(LOST_COLOR), EDGE_COLOR).astype(np.uint8)
            self._edges.append(
                self._scene.add_glb(
                    "/tree/edges",
                    lines_glb(edges, colors),
                )
            )


def _colors(costs: NDArray[np.float64], most: float) -> NDArray[np.uint8]:
    mapped = matplotlib.colormaps[COSTS](np.clip(costs / max(most, 1e-12), 0.0, 1.0), bytes=True)
    return np.asarray(mapped)[:, :3]


def _remove(handles: list[Any]) -> None:
    for handle in handles:
        handle.remove()
    handles.clear()
