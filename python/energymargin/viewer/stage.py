"""The three-dimensional scene: bodies, sets, the tree and the way out."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from energymargin._core import Problem
from energymargin.plots.sets import sets_of
from energymargin.plots.styles import CAPTURED_COLOR, SUCCEEDED_COLOR
from energymargin.undisturbed import Undisturbed
from energymargin.viewer.bodies import DrawnBodies, rgb
from energymargin.viewer.search import Scored
from energymargin.viewer.solids import Triangles, region_surface
from energymargin.viewer.sources import Frames
from energymargin.viewer.trees import DrawnTree
from energymargin.viewer.views import View, is_flat, view_around

__all__ = ["SHOWN", "UNDISTURBED", "Stage"]

UNDISTURBED = "undisturbed path"
SHOWN = ("nodes", "edges", "escape path", UNDISTURBED, "capture set", "success set", "objects")
SAMPLES = 20  # frames of a trajectory that the view holds
FROM = {True: (0.25, -0.8, 1.0), False: (0.45, -1.0, 0.55)}  # the camera, from the middle; if flat
DISTANCE = 0.9  # of the camera, beside the view's size
CELLS = 20  # of the ground's grid, along the view
NICE = (1.0, 2.0, 5.0, 10.0)
OPACITY = 0.3  # of sets


class Stage:
    """The scene of one trajectory; what stands on it is replaced bit by bit."""

    def __init__(self, server: viser.ViserServer, problem: Problem, frames: Frames) -> None:
        """Bodies in the problem's state, and a view of the whole trajectory."""
        self._server = server
        self._surfaces: dict[str, Any] = {}
        self._lock = threading.Lock()  # of the surfaces, which come later
        self._shown = dict.fromkeys(SHOWN, True)
        self._gone = False
        self._way_ends: NDArray[np.float64] | None = None
        scene = problem.scene
        states = frames.states[np.isfinite(frames.states).all(axis=1)]
        chosen = np.linspace(0, len(states) - 1, min(len(states), SAMPLES)).astype(int)
        view = view_around(scene, states[chosen])
        self._view = view
        self._flat = is_flat(problem, states, view)
        self._bodies = DrawnBodies(server, scene, view, _nice(view.size / CELLS))
        self._tree = DrawnTree(server, view)
        _look_at(server, view, FROM[self._flat])
        self.put(problem)

    def put(self, problem: Problem) -> None:
        """Moves the bodies to the problem's state."""
        self._problem = problem
        self._bodies.put(problem.state)

    def draw_way(self, scored: Scored | None) -> None:
        """The way out, with the objects at its end, if there is one."""
        way = None if scored is None else scored.way_out
        self._tree.draw_path(self._problem, way)
        self._way_ends = None if way is None else way.states[-1]
        self._bodies.put_ghosts(self._way_ends if self._shown["escape path"] else None)

    def draw_tree(self, scored: Scored | None, nodes: int) -> tuple[int, int]:
        """The first nodes of the tree; how many dots and edges are drawn of them."""
        if scored is None:
            self._tree.clear()
            return 0, 0
        drawn = self._tree.draw(self._problem, scored.tree, scored.lost, nodes, scored.most)
        self.choose(self._shown)
        return drawn

    def draw_future(self, future: Undisturbed | None) -> None:
        """The way of the objects that nothing disturbs, with a mark where it leads out."""
        self._tree.draw_future(self._problem, future)
        self.choose(self._shown)

    def put_state(self, state: NDArray[np.float64]) -> None:
        """Moves the bodies to another state, shape (n,), such as a moment of a replay."""
        self._bodies.put(state)

    def clear_sets(self) -> None:
        """Takes those of another state away."""
        with self._lock:
            for surface in self._surfaces.values():
                surface.remove()
            self._surfaces.clear()

    def draw_sets(self) -> set[str]:
        """Capture and success set of the present state: they may follow the effector. Returns
        the names of those that have a border in the view."""
        problem = self._problem
        captured, succeeded = sets_of(problem)
        sets = {
            "success set": (succeeded, SUCCEEDED_COLOR),
            "capture set": (captured, CAPTURED_COLOR),
        }
        for layer, (name, (region, color)) in enumerate(sets.items()):
            surface = None
            if region is not None:
                surface = region_surface(problem, region, self._view, flat=self._flat, layer=layer)
            with self._lock:
                if self._gone or problem is not self._problem:  # moved on meanwhile
                    break
                self._replace(name, surface, color)
        with self._lock:
            return set(self._surfaces)

    def choose(self, shown: Mapping[str, bool]) -> None:
        """What is to be seen, by the names of SHOWN."""
        self._shown.update(shown)
        self._tree.show(
            nodes=shown["nodes"],
            edges=shown["edges"],
            path=shown["escape path"],
            future=shown[UNDISTURBED],
        )
        self._bodies.put_ghosts(self._way_ends if shown["escape path"] else None)
        self._bodies.show_objects(shown["objects"])
        with self._lock:
            for name, surface in self._surfaces.items():
                surface.visible = shown[name]

    def remove(self) -> None:
        """Takes everything away."""
        self._gone = True
        self.clear_sets()
        self._bodies.remove()
        self._tree.clear()
        self._tree.draw_path(self._problem, None)
        self._tree.draw_future(self._problem, None)

    def _replace(self, name: str, surface: Triangles | None, color: str) -> None:
        if name in self._surfaces:
            self._surfaces.pop(name).remove()
        if surface is None:
            return
        self._surfaces[name] = self._server.scene.add_mesh_simple(
            f"/sets/{name.replace(' ', '_')}",
            surface.vertices.astype(np.float32),
            surface.faces.astype(np.uint32),
            color=rgb(color),
            opacity=OPACITY,
            flat_shading=self._flat,
            visible=self._shown[name],
        )


def _look_at(server: viser.ViserServer, view: View, where: tuple[float, float, float]) -> None:
    """Where browsers look from: those that come, and those that are there."""
    position = view.center + np.array(where) / np.linalg.norm(where) * DISTANCE * view.size
    cameras: list[Any] = [
        server.initial_camera,
        *(one.camera for one in server.get_clients().values()),
    ]
    for camera in cameras:
        camera.position, camera.look_at = position, view.center
        camera.near, camera.far = view.size / 100, view.size * 100


def _nice(length: float) -> float:
    """The next of 1, 2, 5, 10, 20, ..."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(next(power * step for step in NICE if power * step >= length * 0.999))
