"""Shots of a page: a scene in a state, what is drawn around it, and what can be played.

A shot is a dict that the page's script reads; its arrays are numbers of `Blobs`. Of a search tree
it has so many dots and edges that a browser without a graphics card turns them: a thousand nodes on
one spot look like one dot, and the cheapest is drawn.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

import energymargin as em
from energymargin.base.aliases import Floats, Ints, Mask
from energymargin.look.outlines import object_centers
from energymargin.look.plots import styles
from energymargin.look.plots.scenes import leaving_objects, sets_of
from energymargin.look.viewer.sets import Surface, is_flat, region_surface, view_around
from energymargin.look.viewer.sources import Scored

# Opacities: the tree begins within the object, and walls often stand in front.
OPACITY = {"object": 0.6, "effector": 1.0, "none": 0.35}
GHOST = 0.25
SET = {True: 0.3, False: 0.18}  # of sets that are flat, and of those that are looked through twice
SETS = {"capture set": styles.CAPTURED_COLOR, "success set": styles.SUCCEEDED_COLOR}
EDGE_COLOR, PATH_COLOR, FUTURE_COLOR = "#6E6E6E", "#000000", "#0072B2"
FROM = {True: (0.25, -0.8, 1.0), False: (0.45, -1.0, 0.55)}  # the camera, from the middle; if flat
GROUND_CELLS = 20  # of the ground, along the view
SAMPLES = 20  # states that the view holds
GROWTH = 60  # moments of a tree that grows
DOT = 0.014  # of the view's size
MOST_POINTS, MOST_EDGES = 20_000, 8_000
SPOTS = (500, 350, 250, 175, 125)  # along the view's longest side; the coarsest is a dot's size


class Blobs(dict[bytes, int]):
    """Arrays of a page as bytes, each once, with their numbers."""

    def add(self, array: ArrayLike, kind: type[np.generic] = np.float32) -> int:
        """The array's number."""
        return self.setdefault(np.ascontiguousarray(array, kind).tobytes(), len(self))

    def texts(self) -> list[str]:
        """All of them as base64, by number."""
        return [base64.b64encode(content).decode() for content in self]


class Shot:
    """Collects what a shot shows, in `content`."""

    def __init__(self, blobs: Blobs, name: str, problem: em.Problem, states: Floats) -> None:
        """A problem's bodies in its state, in a view that holds these states, shape (K, n)."""
        self._blobs, self._problem = blobs, problem
        self._solid = [b for b in problem.scene.bodies if not isinstance(b.shape, em.Plane)]
        states = states[np.isfinite(states).all(axis=1)]
        chosen = np.linspace(0, len(states) - 1, min(len(states), SAMPLES)).astype(int)
        self._view = view = view_around(problem.scene, states[chosen])
        self._flat = is_flat(problem, states, view)
        ticks = MaxNLocator(GROUND_CELLS, steps=[1, 2, 5, 10]).tick_values(0.0, view.size)
        self.content: dict[str, Any] = {
            "name": name,
            "center": view.center.tolist(),
            "size": view.size,
            "from": FROM[self._flat],
            "cell": float(ticks[1] - ticks[0]),
            "pose": self._poses(problem.state[None]),
            "surfaces": [],
            "paths": [],
            "tracks": [],
        }
        self._add_bodies()

    def add_sets(self) -> set[str]:
        """Adds capture and success set; returns the names of those that have a border in view."""
        drawn = set()
        for layer, (name, region) in enumerate(zip(SETS, sets_of(self._problem), strict=True)):
            where: dict[str, Any] = {"flat": self._flat, "layer": 1 - layer}
            if region is None:
                continue
            surface = region_surface(self._problem, region, self._view, **where)
            if surface is not None:
                mesh = self._mesh(surface)
                look = {"color": SETS[name], "opacity": SET[self._flat], "smooth": not self._flat}
                self.content["surfaces"].append({"show": name, "mesh": mesh, **look})
                drawn.add(name)
        return drawn

    def add_search(self, scored: Scored) -> tuple[int, int]:
        """Adds a tree with its growth, and the way out; how many dots and edges are drawn."""
        size, add = self._view.size, self._blobs.add
        dots, edges = tree_parts(self._problem, scored, size)
        kinds: dict[str, type[np.generic]]
        kinds = {"outside": np.uint8, "colors": np.uint8, "numbers": np.uint32}
        for name, drawn in {"dots": dots, "edges": edges}.items():
            blobs = {key: add(array, kinds.get(key, np.float32)) for key, array in drawn.items()}
            self.content[name] = blobs
        self.content |= {"dot": DOT * size, "edge colors": [EDGE_COLOR, styles.LOST_COLOR]}
        way = scored.way_out
        if way is not None and len(way.times) > 1:
            captions = [f"{t:.2f} s, {c:.3g} J" for t, c in zip(way.times, way.costs, strict=True)]
            self.add_track("escape", way.states, way.times, captions)
            self.add_path("escape path", way.states, PATH_COLOR)
            self.content["ghost"] = self._poses(way.states[-1:])
        if scored.nodes > 1:
            count = np.unique(np.linspace(1, scored.nodes, GROWTH).astype(int)).tolist()
            captions = [f"node {n:,}" for n in count]
            times = np.arange(len(count)) / 15
            self.add_track("growth of the tree", self._problem.state[None], times, captions)
            self.content["tracks"][-1]["nodes"] = count
        return len(dots["points"]), len(edges["points"])

    def add_future(self, future: em.futures.Undisturbed) -> None:
        """Adds the undisturbed future, with marks where objects leave."""
        captions = [f"{time:.2f} s ahead" for time in future.times]
        self.add_track("undisturbed future", future.states, future.times, captions)
        self.add_path("undisturbed path", future.states, FUTURE_COLOR)
        if future.exit_moment is not None:
            centers = object_centers(self._problem.scene, future.states[[future.exit_moment]])[0]
            marks = centers[leaving_objects(self._problem, future)]
            self.content["exit"] = {"points": self._blobs.add(marks), "color": styles.LOST_COLOR}

    def add_track(self, name: str, states: Floats, times: Floats, captions: Sequence[str]) -> None:
        """Adds states to play, shape (K, n), at these times [s], shape (K,), with a text each; one
        state stays."""
        track = {"name": name, "times": np.asarray(times).round(4).tolist()}
        track |= {"captions": list(captions), "poses": self._poses(states)}
        self.content["tracks"].append(track)

    def add_path(self, show: str, states: Floats, color: str) -> None:
        """Adds a line for each object's centre along these states, shape (K, n)."""
        ways = object_centers(self._problem.scene, states).swapaxes(0, 1)
        paths = [{"show": show, "points": self._blobs.add(way), "color": color} for way in ways]
        self.content["paths"] += paths

    def _add_bodies(self) -> None:
        """Adds the bodies, planes as grounds, and springs."""
        scene, bodies, grounds = self._problem.scene, [], []
        for body in scene.bodies:
            if isinstance(body.shape, em.Plane):
                normal = np.asarray(body.shape.normal)
                center = self._view.center
                center = center - (center @ normal - body.shape.offset) * normal
                grounds.append({"normal": normal.tolist(), "center": center.tolist()})
            else:
                mesh = self._mesh(shape_surface(body.shape))
                look = {"color": styles.BODY_COLORS[body.role], "opacity": OPACITY[body.role]}
                bodies.append({"mesh": mesh, "object": body.role == "object", **look})
        number, springs = {body.name: k for k, body in enumerate(self._solid)}, []
        for one in scene.springs:
            a, b = (number[one.body_a], list(one.point_a)), (number[one.body_b], list(one.point_b))
            springs.append([*a, *b])
        self.content |= {"bodies": bodies, "grounds": grounds, "springs": springs, "pale": GHOST}

    def _poses(self, states: Floats) -> int:
        """Position and quaternion of each body that is no plane, float32 of (K, B, 7)."""
        rows = []
        for state in states:
            poses = em.scenes.body_poses(self._problem.scene, state)
            rows.append([np.concatenate(poses[body.name]) for body in self._solid])
        return self._blobs.add(rows)

    def _mesh(self, surface: Surface) -> dict[str, int]:
        add = self._blobs.add
        return {"points": add(surface.points), "faces": add(surface.faces, np.uint32)}


def shape_surface(shape: Any) -> Surface:
    """The surface of a shape in its own frame, of a compound those of all parts. Its triangles may
    be seen either way round.

    Raises TypeError for a Plane, which has no end.
    """
    parts = em.scenes.shape_parts(shape)
    starts = np.cumsum([0, *map(len, parts)])
    faces = [ConvexHull(p).simplices + start for p, start in zip(parts, starts, strict=False)]
    return Surface(np.concatenate(parts), np.concatenate(faces).astype(np.int64))


def tree_parts(
    problem: em.Problem, scored: Scored, size: float
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The nodes, coloured by cost, and the edges, each in the order of the search: at most
    MOST_POINTS and MOST_EDGES. size: of the view [m]."""
    tree = scored.tree
    centers = object_centers(problem.scene, tree.states).swapaxes(0, 1)
    lines = np.stack([centers[:, tree.parents[1:]], centers[:, 1:]], axis=2)
    nodes = np.arange(len(tree))
    dots = _drawn(centers, nodes, scored, size, MOST_POINTS)
    edges = _drawn(lines, nodes[1:], scored, size, MOST_EDGES)
    shares = np.clip(tree.costs[dots["numbers"]] / max(scored.most, 1e-12), 0.0, 1.0)
    dots["colors"] = matplotlib.colormaps[styles.COSTS](shares, bytes=True)[:, :3]
    return dots, edges


def _drawn(places: Floats, nodes: Ints, scored: Scored, size: float, most: int) -> dict[str, Any]:
    """What is drawn of N nodes or edges of k objects, shape (k, N, ...), sorted by their node."""
    points, numbers = places.reshape(-1, *places.shape[2:]), np.tile(nodes, len(places))
    outside, costs = scored.lost[nodes].T.ravel(), scored.tree.costs[numbers]
    flat = points.reshape(-1, math.prod(points.shape[1:]))
    drawn = one_a_spot(flat, outside, costs, size, most)
    drawn = drawn[np.argsort(numbers[drawn], kind="stable")]
    return {"points": points[drawn], "outside": outside[drawn], "numbers": numbers[drawn]}


def one_a_spot(values: Floats, kinds: Mask, order: Floats, size: float, most: int) -> Ints:
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
