"""A search tree in the browser: nodes by cost, edges, the escape path, the undisturbed future.

Nodes and edges that fall on the same spot are drawn once: a million dots on a thousand spots look
like a thousand dots, and are a thousand times slower. Edges are a glTF file: the browser draws its
lines as the graphics card's own. Viser's lines, which have a width, are each made of triangles, and
ten times slower.
"""

from __future__ import annotations

import json
import struct
from itertools import compress
from typing import Any

import matplotlib
import numpy as np
import viser
from numpy.typing import NDArray

from energymargin._core import Problem, Tree
from energymargin.futures import Undisturbed
from energymargin.outlines import object_centers
from energymargin.plots.scenes import leaving_objects
from energymargin.plots.styles import COSTS, LOST_COLOR
from energymargin.viewer.bodies import linear, rgb
from energymargin.viewer.search import Replay

__all__ = ["FUTURE_COLOR", "DrawnTree", "lines_glb", "shown_edges", "shown_points"]

DOT = 0.006  # of the view's size
EDGE_COLOR = (110, 110, 110)
PATH_COLOR = (0, 0, 0)
PATH_WIDTH = 4.0  # pixels
FUTURE_COLOR = "#0072B2"
EXIT = 4 * DOT

LINES = 1  # glTF's mode of a primitive
FLOAT, UNSIGNED_BYTE = 5126, 5121

MOST_POINTS, MOST_EDGES = 20_000, 8_000  # what a browser without a graphics card still moves
SPOTS = (500, 350, 250, 175, 125)  # along the view's longest side; the coarsest is a dot's size


class DrawnTree:
    """What is drawn of one tree; each call replaces what was there."""

    def __init__(self, server: viser.ViserServer, size: float) -> None:
        """Nothing at first."""
        self._scene = server.scene
        self._size = size
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
        places = object_centers(problem.scene)
        first = slice(0, nodes + 1)
        points = np.concatenate([tree.states[first, place] for place in places])
        costs, outside = np.tile(tree.costs[first], len(places)), lost[first].T.ravel()
        self.clear()
        dots = shown_points(points, outside, costs, self._size)
        self._draw_nodes(points[dots], _colors(costs[dots], most), outside[dots])
        starts = np.concatenate([tree.states[tree.parents[1 : nodes + 1], :][:, p] for p in places])
        ends = np.concatenate([tree.states[1 : nodes + 1, place] for place in places])
        edges = np.stack([starts, ends], axis=1)
        reached = lost[1 : nodes + 1].T.ravel()
        order = np.tile(tree.costs[1 : nodes + 1], len(places))
        lines = shown_edges(edges, reached, order, self._size)
        self._draw_edges(edges[lines], reached[lines])
        return len(dots), len(lines)

    def draw_path(self, problem: Problem, way: Replay | None) -> None:
        """The paths of the objects' centres along the escape; None: there is none."""
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
            places = compress(object_centers(problem.scene), left)
            self._future.append(
                self._scene.add_point_cloud(
                    "/future/exit",
                    np.array([future.states[leaves, p] for p in places]),
                    rgb(LOST_COLOR),
                    point_size=EXIT * self._size,
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
            for number, place in enumerate(object_centers(problem.scene))
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
                        point_size=DOT * self._size,
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


def lines_glb(segments: NDArray[np.float64], colors: NDArray[np.uint8]) -> bytes:
    """A binary glTF 2.0 file of line segments.

    segments: both ends of each, shape (N, 2, 3) [m], N > 0; colors: sRGB of each, shape (N, 3).
    """
    points = segments.reshape(-1, 3).astype("<f4")
    rgba = np.full((len(points), 4), 255, dtype=np.uint8)
    rgba[:, :3] = np.repeat(linear(colors), 2, axis=0)
    binary = points.tobytes() + rgba.tobytes()
    accessor = {"count": len(points), "byteOffset": 0}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": LINES}]}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": rgba.nbytes},
        ],
        "accessors": [
            {
                **accessor,
                "bufferView": 0,
                "componentType": FLOAT,
                "type": "VEC3",
                "min": points.min(axis=0).tolist(),
                "max": points.max(axis=0).tolist(),
            },
            {
                **accessor,
                "bufferView": 1,
                "componentType": UNSIGNED_BYTE,
                "normalized": True,
                "type": "VEC4",
            },
        ],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def shown_points(
    points: NDArray[np.float64], kinds: NDArray[np.bool_], order: NDArray[np.float64], size: float
) -> NDArray[np.int64]:
    """Rows of points, shape (N, 3), that are drawn: of those of one kind, shape (N,), on a spot the
    one that comes first in `order`, shape (N,); and at most MOST_POINTS. size: of the view [m]."""
    return _one_a_spot(points, kinds, order, size, MOST_POINTS)


def shown_edges(
    edges: NDArray[np.float64], kinds: NDArray[np.bool_], order: NDArray[np.float64], size: float
) -> NDArray[np.int64]:
    """As `shown_points`, of edges from spot to spot, shape (N, 2, 3); at most MOST_EDGES."""
    return _one_a_spot(edges.reshape(-1, 6), kinds, order, size, MOST_EDGES)


def _one_a_spot(
    values: NDArray[np.float64],
    kinds: NDArray[np.bool_],
    order: NDArray[np.float64],
    size: float,
    most: int,
) -> NDArray[np.int64]:
    first = np.argsort(order, kind="stable")
    if len(values) <= most:
        return first
    shown = first
    for spots in SPOTS:
        places = np.round(values[first] * (spots / size)).astype(np.int64)
        keys = np.column_stack([places, kinds[first]])
        shown = first[np.sort(np.unique(keys, axis=0, return_index=True)[1])]
        if len(shown) <= most:
            return shown
    return shown[:most]
