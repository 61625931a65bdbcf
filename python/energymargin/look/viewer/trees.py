"""A search tree in the browser: nodes by cost, edges, the escape path, the undisturbed future.

Nodes and edges that fall on the same spot are drawn once: a million dots on a thousand spots look
like a thousand dots, and are a thousand times slower. Edges are a glTF file: the browser draws its
lines as the graphics card's own. Viser's lines, which have a width, are each made of triangles, and
ten times slower.
"""

from __future__ import annotations

from typing import Any, cast

import matplotlib
import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.exchange.gltf import export_glb

import energymargin as em
from energymargin.look.outlines import object_centers
from energymargin.look.plots.scenes import leaving_objects
from energymargin.look.plots.styles import COSTS, LOST_COLOR
from energymargin.look.viewer.bodies import Layer, add_lines, linear, rgb
from energymargin.look.viewer.search import Scored

Floats = NDArray[np.float64]

DOT = 0.006  # of the view's size
EDGE_COLOR = (110, 110, 110)
PATH_COLOR = (0, 0, 0)
PATH_WIDTH = 4.0  # pixels
FUTURE_COLOR = "#0072B2"
EXIT = 4 * DOT

LINES = 1  # glTF's mode of a primitive

MOST_POINTS, MOST_EDGES = 20_000, 8_000  # what a browser without a graphics card still moves
SPOTS = (500, 350, 250, 175, 125)  # along the view's longest side; the coarsest is a dot's size


def draw_nodes(layer: Layer, problem: em.Problem, scored: Scored, nodes: int, size: float) -> int:
    """The root and the first `nodes` nodes, coloured by cost, as many dots as it returns.

    Nodes in which an object is out of its capture set are diamonds. size: of the view [m].
    """
    first, tree = slice(0, nodes + 1), scored.tree
    centers = object_centers(problem.scene, tree.states[first]).swapaxes(0, 1)
    points, costs = centers.reshape(-1, 3), np.tile(tree.costs[first], len(centers))
    outside = scored.lost[first].T.ravel()
    dots = one_a_spot(points, outside, costs, size, MOST_POINTS)
    shares = np.clip(costs / max(scored.most, 1e-12), 0.0, 1.0)
    colors = matplotlib.colormaps[COSTS](shares, bytes=True)[:, :3]
    for shape, chosen in (("circle", dots[~outside[dots]]), ("diamond", dots[outside[dots]])):
        if len(chosen):
            _add_dots(layer, shape, points[chosen], colors[chosen], DOT * size)
    return len(dots)


def draw_edges(layer: Layer, problem: em.Problem, scored: Scored, nodes: int, size: float) -> int:
    """The edges to the first `nodes` nodes, as many as it returns; those are red that lead to where
    an object is out of its capture set. size: of the view [m]."""
    tree, ends = scored.tree, slice(1, nodes + 1)
    centers = object_centers(problem.scene, tree.states).swapaxes(0, 1)
    edges = np.stack([centers[:, tree.parents[ends]], centers[:, ends]], axis=2).reshape(-1, 2, 3)
    outside, costs = scored.lost[ends].T.ravel(), np.tile(tree.costs[ends], len(centers))
    lines = one_a_spot(edges.reshape(-1, 6), outside, costs, size, MOST_EDGES)
    if len(lines):
        colors = np.where(outside[lines, None], rgb(LOST_COLOR), EDGE_COLOR).astype(np.uint8)
        layer.scene.add_glb(f"{layer.path}/lines", lines_glb(edges[lines], colors))
    return len(lines)


def draw_path(
    layer: Layer, problem: em.Problem, states: Floats, color: tuple[int, int, int]
) -> None:
    """A line for each object's centre along these states, shape (K, n); none of a single state."""
    if len(states) < 2:
        return
    for number, way in enumerate(object_centers(problem.scene, states).swapaxes(0, 1)):
        ends = np.stack([way[:-1], way[1:]], axis=1)
        add_lines(layer, str(number), ends, color, PATH_WIDTH)


def draw_future(
    layer: Layer, problem: em.Problem, future: em.futures.Undisturbed, size: float
) -> None:
    """The paths of the objects' centres, and diamonds where they leave. size: of the view [m]."""
    draw_path(layer, problem, future.states, rgb(FUTURE_COLOR))
    if future.exit_moment is not None:
        centers = object_centers(problem.scene, future.states[[future.exit_moment]])[0]
        points = centers[leaving_objects(problem, future)]
        _add_dots(layer, "diamond", points, rgb(LOST_COLOR), EXIT * size)


def _add_dots(layer: Layer, shape: Any, points: Floats, colors: Any, size: float) -> None:
    layer.scene.add_point_cloud(
        f"{layer.path}/{shape}",
        points.astype(np.float32),
        colors,
        point_size=size,
        point_shape=shape,
        point_shading="flat",
        precision="float32",
    )


def lines_glb(segments: Floats, colors: NDArray[np.uint8]) -> bytes:
    """A binary glTF 2.0 file of line segments: a cloud of their ends that is drawn as lines.

    segments: both ends of each, shape (N, 2, 3) [m], N > 0; colors: sRGB of each, shape (N, 3).
    """
    points, shades = segments.reshape(-1, 3), np.repeat(linear(colors), 2, axis=0)
    ends = cast(Any, trimesh.PointCloud)(points, shades)

    def join(document: dict[str, Any]) -> None:
        document["meshes"][0]["primitives"][0]["mode"] = LINES

    return bytes(cast(Any, export_glb)(trimesh.Scene(ends), tree_postprocessor=join))


def one_a_spot(
    values: Floats, kinds: NDArray[np.bool_], order: Floats, size: float, most: int
) -> NDArray[np.int64]:
    """Rows of points or edges, shape (N, D), that are drawn: of those of one kind, shape (N,), on a
    spot the one that comes first in `order`, shape (N,); and at most so many. size: of the view
    [m]."""
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
