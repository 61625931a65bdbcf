"""The bodies of a scene in the browser, and their shapes as triangle meshes."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numpy as np
import trimesh
import viser
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from trimesh.exchange.gltf import export_glb

from energymargin._core import Body, Plane, Scene
from energymargin.outlines import Pose, body_poses, shape_parts
from energymargin.plots.styles import BODY_COLORS

__all__ = ["DrawnBodies", "Triangles", "add_translucent", "linear", "rgb", "shape_triangles"]

# Opacities: the tree begins within the object, and walls often stand in front.
OPACITY = {"object": 0.6, "effector": None, "none": 0.35}
GHOST = 0.25
SPRING_WIDTH = 2.0  # pixels
UP = np.array([0.0, 0.0, 1.0])


def rgb(color: str) -> tuple[int, int, int]:
    """A colour's numbers, 0..255."""
    red, green, blue = (round(255 * part) for part in to_rgb(color))
    return red, green, blue


def _pose_of(body: Body) -> Pose:
    """Where a body is at first."""
    return np.asarray(body.position), np.asarray(body.orientation)


def wxyz(orientation: NDArray[np.float64]) -> NDArray[np.float64]:
    """A quaternion x, y, z, w in the order that the browser's side wants."""
    return np.asarray(np.roll(orientation, 1))


class DrawnBodies:
    """All bodies of one scene; those that move can be put into any state."""

    def __init__(
        self, server: viser.ViserServer, scene: Scene, center: NDArray[np.float64], cell: float
    ) -> None:
        """Adds them; the ground is a grid around `center` (3,) with cells of this size [m]."""
        self._server = server
        self._scene = scene
        self._moving: dict[str, Any] = {}
        self._ghosts: dict[str, Any] = {}
        self._added: list[Any] = []
        for number, body in enumerate(scene.bodies):
            if isinstance(body.shape, Plane):
                self._added.append(
                    _add_ground(server, f"/ground/{number}", body.shape, center, cell)
                )
            else:
                self._add(number, body)
        self._springs: Any = None
        if scene.springs:
            self._springs = server.scene.add_line_segments(
                "/springs",
                _spring_ends(scene, {body.name: _pose_of(body) for body in scene.bodies}),
                rgb(BODY_COLORS["effector"]),
                thickness=SPRING_WIDTH,
                thickness_units="screen",
            )
            self._added.append(self._springs)

    def put(self, state: NDArray[np.float64]) -> None:
        """Moves them to where they are in a state, shape (n,)."""
        poses = body_poses(self._scene, state)
        _put(self._server, self._moving, poses)
        if self._springs is not None:
            self._springs.points = _spring_ends(self._scene, poses)

    def show_objects(self, shown: bool) -> None:
        """Whether they are to be seen, or what is within them."""
        for body in self._scene.bodies:
            if body.role == "object" and body.name in self._moving:
                self._moving[body.name].visible = shown

    def put_ghosts(self, state: NDArray[np.float64] | None) -> None:
        """Shows the objects once more, translucent, as they are in this state; None: nowhere."""
        if state is not None:
            _put(self._server, self._ghosts, body_poses(self._scene, state))
        for ghost in self._ghosts.values():
            ghost.visible = state is not None

    def remove(self) -> None:
        """Takes all of them away."""
        for added in self._added:
            added.remove()

    def _add(self, number: int, body: Body) -> None:
        mesh = _add_mesh(self._server, f"/bodies/{number}", body, OPACITY[body.role])
        _place(mesh, _pose_of(body))
        self._added.append(mesh)
        if not body.fixed:
            self._moving[body.name] = mesh
        if body.role == "object":
            ghost = _add_mesh(self._server, f"/escape/{number}", body, GHOST)
            ghost.visible = False
            self._ghosts[body.name] = ghost
            self._added.append(ghost)


def _add_mesh(server: viser.ViserServer, name: str, body: Body, opacity: float | None) -> Any:
    solid, color = shape_triangles(body.shape), BODY_COLORS[body.role]
    if opacity is not None:
        return add_translucent(server, name, solid, color, opacity, flat=True)
    return server.scene.add_mesh_simple(
        name,
        solid.vertices.astype(np.float32),
        solid.faces.astype(np.uint32),
        color=rgb(color),
        flat_shading=True,
    )


def add_translucent(
    server: viser.ViserServer,
    name: str,
    surface: Triangles,
    color: str,
    opacity: float,
    *,
    flat: bool,
    visible: bool = True,
) -> Any:
    """A surface that never hides what is within or behind it.

    It is a glTF file, whose blended materials the browser draws without noting their depth. Viser's
    own meshes note it: of a set within an object, or around one, the inner one would not be seen.
    """
    red, green, blue = linear(np.array(rgb(color), dtype=np.uint8))
    visual: Any = trimesh.visual
    material = visual.material.PBRMaterial(
        baseColorFactor=[red, green, blue, round(255 * opacity)],
        alphaMode="BLEND",
        metallicFactor=0.0,
        roughnessFactor=1.0,
    )
    mesh = trimesh.Trimesh(
        surface.vertices,
        surface.faces,
        visual=visual.TextureVisuals(material=material),
        process=False,
    )
    glb = cast(Any, export_glb)(mesh.scene(), include_normals=not flat)
    return server.scene.add_glb(name, glb, cast_shadow=False, visible=visible)


def linear(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """glTF's colours are proportional to light, those of a screen are not (sRGB)."""
    share = colors / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.round(255.0 * light), dtype=np.uint8)


def _add_ground(
    server: viser.ViserServer,
    name: str,
    plane: Plane,
    center: NDArray[np.float64],
    cell: float,
) -> Any:
    """A plane's surface as a grid; it has no end, but fades."""
    normal, offset = np.asarray(plane.normal), plane.offset
    turned, _ = Rotation.align_vectors([normal], [UP])
    center = np.round(center / cell) * cell  # lines at round numbers, if it is level
    center = center - (center @ normal - offset) * normal
    return server.scene.add_grid(
        name,
        width=40 * cell,
        height=40 * cell,
        cell_size=cell,
        section_size=5 * cell,
        cell_color=(215, 215, 215),
        section_color=(170, 170, 170),
        position=center,
        wxyz=wxyz(turned.as_quat()),
        fade_distance=60 * cell,
    )


def _spring_ends(scene: Scene, poses: dict[str, Pose]) -> NDArray[np.float32]:
    """Where the springs are fastened [m], shape (N, 2, 3)."""
    return np.array(
        [
            [
                poses[body][0] + Rotation.from_quat(poses[body][1]).apply(np.array(point))
                for body, point in ((one.body_a, one.point_a), (one.body_b, one.point_b))
            ]
            for one in scene.springs
        ],
        dtype=np.float32,
    )


def _put(server: viser.ViserServer, meshes: dict[str, Any], poses: dict[str, Pose]) -> None:
    with server.atomic():
        for name, mesh in meshes.items():
            _place(mesh, poses[name])


def _place(mesh: Any, pose: Pose) -> None:
    mesh.position, mesh.wxyz = pose[0], wxyz(pose[1])


class Triangles(NamedTuple):
    """A closed surface; the triangles' corners run counterclockwise seen from outside."""

    vertices: NDArray[np.float64]
    """Shape (N, 3) [m]."""
    faces: NDArray[np.int64]
    """Rows of `vertices`, shape (M, 3)."""


def shape_triangles(shape: Any) -> Triangles:
    """The surface of a shape in its own frame; of a compound those of all parts.

    Raises TypeError for a Plane, which has no end.
    """
    hulls = [trimesh.convex.convex_hull(corners) for corners in shape_parts(shape)]
    mesh: Any = trimesh.util.concatenate(hulls)
    return Triangles(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces))
