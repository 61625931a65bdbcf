"""The three-dimensional scene: what is in view, bodies, tree, and sets of states as solids.

The solid of a set is the positions of the objects for which the state, otherwise unchanged, is in
the set.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, cast

import numpy as np
import trimesh
import viser
from fast_simplification import simplify
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from skimage.measure import marching_cubes

import energymargin as em
from energymargin.look.outlines import AXES, object_centers, seen_corners
from energymargin.look.plots.scenes import inside_at, sets_of
from energymargin.look.plots.styles import CAPTURED_COLOR, SUCCEEDED_COLOR
from energymargin.look.viewer import trees
from energymargin.look.viewer.bodies import DrawnBodies, Layer, add_surface, draw_ghosts
from energymargin.look.viewer.search import Scored
from energymargin.look.viewer.sources import Frames

UNDISTURBED = "undisturbed path"
SHOWN = ("nodes", "edges", "escape path", UNDISTURBED, "capture set", "success set", "objects")
SETS = {"capture set": CAPTURED_COLOR, "success set": SUCCEEDED_COLOR}
SAMPLES = 20  # frames of a trajectory that the view holds
FROM = {True: (0.25, -0.8, 1.0), False: (0.45, -1.0, 0.55)}  # the camera, from the middle; if flat
DISTANCE = 0.9  # of the camera, beside the view's size
GROUND_CELLS = 20  # of the ground, along the view
OPACITY = 0.3  # of sets

# Room around what is seen, as a share of its longest side.
LEVEL_NORMAL = 0.99  # upward part of the normal of a plane that counts as level
AROUND_STATES = 0.08
AROUND_ONE = 0.6  # of a single state: its motion is not known
LEVEL = 0.02  # of the view's size: an object that rises by less stays on the ground

# Cells along the longest side of the grid, and how far it reaches beyond the view, as a share of
# the view's size. A slab may reach far; the camera has to stay outside of a solid.
CELLS, AROUND = 60, 0.03
FLAT_CELLS, FLAT_AROUND = 320, 0.4
FLAT = 0.002  # height of a slab, as a share of the view's size
MOST_TRIANGLES = 3000  # a flat surface needs few, and browsers without a graphics card are slow
HALVINGS = 6  # of a cell, until the border is found

Points = NDArray[np.float64]


class Stage:
    """The scene of what is shown; its layers are drawn anew one at a time."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Empty until it is set."""
        self._server = server
        self._layers = {name: Layer(server.scene, name) for name in (*SHOWN, "bodies")}
        self._lock = threading.Lock()  # of the sets, which are drawn later

    def set_up(self, problem: em.Problem, frames: Frames) -> None:
        """Bodies in the problem's state, and a view of the whole trajectory."""
        scene = problem.scene
        states = frames.states[np.isfinite(frames.states).all(axis=1)]
        chosen = np.linspace(0, len(states) - 1, min(len(states), SAMPLES)).astype(int)
        view = self._view = view_around(scene, states[chosen])
        self._flat = is_flat(problem, states, view)
        with self._lock, self._server.atomic():
            for layer in self._layers.values():
                layer.clear()
        ticks = MaxNLocator(GROUND_CELLS, steps=[1, 2, 5, 10]).tick_values(0.0, view.size)
        layers = self._layers["objects"], self._layers["bodies"]
        self._bodies = DrawnBodies(*layers, scene, view.center, float(ticks[1] - ticks[0]))
        _look_at(self._server, view, FROM[self._flat])
        self.put(problem)

    def put(self, problem: em.Problem) -> None:
        """Moves the bodies to the problem's state."""
        self._problem = problem
        self.put_state(problem.state)

    def put_state(self, state: NDArray[np.float64]) -> None:
        """Moves the bodies to another state, shape (n,), such as a moment of a replay."""
        with self._server.atomic():
            self._bodies.put(state)

    def draw_way(self, scored: Scored | None) -> None:
        """The way out, with the objects at its end, if there is one."""
        layer = self._layers["escape path"].clear()
        if scored is not None and scored.way_out is not None:
            states = scored.way_out.states
            trees.draw_path(layer, self._problem, states, trees.PATH_COLOR)
            draw_ghosts(layer, self._problem.scene, states[-1])

    def draw_tree(self, scored: Scored | None, nodes: int) -> tuple[int, int]:
        """The first nodes of the tree; how many dots and edges are drawn of them."""
        dots, edges = (self._layers[name].clear() for name in ("nodes", "edges"))
        if scored is None:
            return 0, 0
        what = self._problem, scored, nodes, self._view.size
        return trees.draw_nodes(dots, *what), trees.draw_edges(edges, *what)

    def draw_future(self, future: em.futures.Undisturbed | None) -> None:
        """The undisturbed path of the objects, with a mark where it leaves the capture set."""
        layer = self._layers[UNDISTURBED].clear()
        if future is not None:
            trees.draw_future(layer, self._problem, future, self._view.size)

    def clear_sets(self) -> None:
        """Takes those of another state away."""
        with self._lock:
            for name in SETS:
                self._layers[name].clear()

    def draw_sets(self) -> set[str]:
        """Capture and success set of the present state: they may follow the effector. Returns
        the names of those that have a border in the view."""
        problem, view, flat, drawn = self._problem, self._view, self._flat, set()
        regions = dict(zip(SETS, sets_of(problem), strict=True))
        for height, (name, region) in enumerate(reversed(regions.items())):
            surface = None
            if region is not None:
                surface = region_surface(problem, region, view, flat=flat, layer=height)
            with self._lock:
                if problem is not self._problem:  # moved on meanwhile
                    break
                layer = self._layers[name].clear()
                if surface is not None:
                    path = f"{layer.path}/surface"
                    add_surface(layer.scene, path, surface, SETS[name], OPACITY, flat=flat)
                    drawn.add(name)
        return drawn

    def choose(self, shown: Mapping[str, bool]) -> None:
        """What is to be seen, by the names of SHOWN."""
        with self._lock:
            for name, visible in shown.items():
                self._layers[name].show(visible)


def _look_at(server: viser.ViserServer, view: View, where: tuple[float, float, float]) -> None:
    """Where browsers look from: those that come, and those that are there."""
    position = view.center + np.array(where) / np.linalg.norm(where) * DISTANCE * view.size
    clients = server.get_clients().values()
    cameras: list[Any] = [server.initial_camera, *(client.camera for client in clients)]
    for camera in cameras:
        camera.position, camera.look_at = position, view.center
        camera.near, camera.far = view.size / 100, view.size * 100


class View(NamedTuple):
    """A box [m] that holds what matters."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    floor: float
    """Height of the ground, or of the lowest point if there is none."""

    @property
    def size(self) -> float:
        """Its longest side [m]."""
        return float((self.high - self.low).max())

    @property
    def center(self) -> NDArray[np.float64]:
        """Its middle."""
        return np.asarray((self.low + self.high) / 2)


def view_around(scene: em.Scene, states: Iterable[NDArray[np.float64]]) -> View:
    """A view of objects and effector in these states."""
    states = list(states)
    points = seen_corners(scene, states, AXES)
    low, high = points.min(axis=0), points.max(axis=0)
    share = AROUND_STATES if len(states) > 1 else AROUND_ONE
    around = share * float((high - low).max())
    grounds = [shape for body in scene.bodies if isinstance(shape := body.shape, em.Plane)]
    level = [plane.offset for plane in grounds if plane.normal[2] > LEVEL_NORMAL]
    return View(low - around, high + around, max(level, default=float(low[2])))


def is_flat(problem: em.Problem, states: NDArray[np.float64], view: View) -> bool:
    """Whether no object is lifted or tipped: neither in these states, shape (K, n), nor by the
    disturbance."""
    if problem.force[2] != 0.0 or np.any(problem.torque[:2] != 0.0):
        return False
    heights = object_centers(problem.scene, states, "z")
    return bool(np.all(np.ptp(heights, axis=0) < LEVEL * view.size))


def region_surface(
    problem: em.Problem,
    region: em.regions.Region,
    view: View,
    *,
    flat: bool = False,
    layer: int = 0,
) -> Any:
    """The surface of a set in and around the view, a Trimesh; None if it is empty there, or all of
    it.

    flat: a slab on the ground, of the places at the objects' own height. layer: slabs of others lie
    above each other, and solids of others do not end at the same walls. If each of several objects
    has its own set, the region is that of at least one.
    """
    seen = AXES[:2] if flat else AXES

    def contains(points: Points) -> NDArray[np.bool_]:
        """Whether it is in the set with the objects' centres at each of the points, (N, 3)."""
        return inside_at(problem, region, points[:, : len(seen)], seen)

    cells, share = (FLAT_CELLS, FLAT_AROUND) if flat else (CELLS, (1 + layer) * AROUND)
    around = share * view.size
    cell = (view.size + 2 * around) / cells
    ends = zip(view.low - around, view.high + around, strict=True)
    axes = [np.arange(low, high + cell, cell) for low, high in ends]
    size = np.full(3, cell)
    if flat:
        size[2] = FLAT * view.size
        axes[2] = np.array([view.floor + 2 * layer * size[2]])
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    inside = contains(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    if flat:
        inside = np.repeat(inside, 2, axis=2)
    return _surface(inside, contains, grid[0, 0, 0], size, sides=2 if flat else 3)


def _surface(
    inside: NDArray[np.bool_],
    contains: Callable[[Points], NDArray[np.bool_]],
    start: NDArray[np.float64],
    cell: NDArray[np.float64],
    sides: int,
) -> Any:
    """Surface of the cells that are inside, closed one cell beyond the grid's ends; its border is
    looked for along the first so many axes."""
    if inside.all() or not inside.any():
        return None
    padded = np.pad(inside, 1)
    corners, faces, _, _ = cast(Any, marching_cubes)(padded.astype(np.float32), 0.5)
    axis = np.argmin(np.abs(corners % 1 - 0.5), axis=1)  # of the grid's edge that it halves
    low = np.floor(corners).astype(np.int64)
    step = np.eye(3)[axis]
    within = np.where(padded[tuple(low.T)], 0.0, 1.0)  # shares of the edge
    beyond, refined = 1.0 - within, axis < sides
    for _ in range(HALVINGS):
        middle = (within + beyond) / 2
        points = start + (low + middle[:, None] * step - 1) * cell
        found = np.zeros(len(points), bool)
        found[refined] = contains(points[refined])
        within, beyond = np.where(found, middle, within), np.where(found, beyond, middle)
    share = np.where(refined, (within + beyond) / 2, 0.5)
    vertices = start + (low + share[:, None] * step - 1) * cell
    if len(faces) > MOST_TRIANGLES:
        vertices, faces = cast(Any, simplify)(
            vertices.astype(np.float32), faces.astype(np.int32), target_count=MOST_TRIANGLES
        )
    return trimesh.Trimesh(vertices, faces[:, ::-1], process=False)
