"""The bodies of a scene in the browser, and their shapes as triangle meshes."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import trimesh
import viser
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from trimesh.exchange.gltf import export_glb

import energymargin as em
from energymargin.look.outlines import Pose, spring_ends
from energymargin.look.plots.styles import BODY_COLORS

Floats = NDArray[np.float64]

# Opacities: the tree begins within the object, and walls often stand in front.
OPACITY = {"object": 0.6, "effector": 1.0, "none": 0.35}
GHOST = 0.25
SPRING_WIDTH = 2.0  # pixels
UP = np.array([0.0, 0.0, 1.0])


def rgb(color: str) -> tuple[int, int, int]:
    """A colour's numbers, 0..255."""
    red, green, blue = (round(255 * part) for part in to_rgb(color))
    return red, green, blue


class Layer:
    """What one checkbox shows: a node of the browser's scene, and all that is drawn below it."""

    def __init__(self, scene: viser.SceneApi, name: str) -> None:
        """Shown and empty."""
        self.scene, self.path = scene, f"/{name.replace(' ', '_')}"
        self._node = scene.add_frame(self.path, show_axes=False)

    def clear(self) -> Layer:
        """Itself, without what is drawn."""
        visible = self._node.visible
        self._node.remove()
        self._node = self.scene.add_frame(self.path, show_axes=False, visible=visible)
        return self

    def show(self, visible: bool) -> None:
        """Whether it is to be seen."""
        self._node.visible = visible


class DrawnBodies:
    """All bodies of one scene; those that move can be put into any state."""

    def __init__(
        self, objects: Layer, others: Layer, scene: em.Scene, center: Floats, cell: float
    ) -> None:
        """Adds them; the ground is a grid around `center` (3,) with cells of this size [m]."""
        self._scene = scene
        self._moving: dict[str, Any] = {}
        for number, body in enumerate(scene.bodies):
            layer = objects if body.role == "object" else others
            path = f"{layer.path}/{number}"
            if isinstance(body.shape, em.Plane):
                _add_ground(layer.scene, path, body.shape, center, cell)
                continue
            mesh = _add_body(layer.scene, path, body, OPACITY[body.role])
            _place(mesh, (np.asarray(body.position), np.asarray(body.orientation)))
            if not body.fixed:
                self._moving[body.name] = mesh
        self._springs: Any = None
        if scene.springs:
            ends = np.zeros((len(scene.springs), 2, 3))
            color = rgb(BODY_COLORS["effector"])
            self._springs = add_lines(others, "springs", ends, color, SPRING_WIDTH)

    def put(self, state: Floats) -> None:
        """Moves them to where they are in a state, shape (n,)."""
        poses = em.scenes.body_poses(self._scene, state)
        for name, mesh in self._moving.items():
            _place(mesh, poses[name])
        if self._springs is not None:
            self._springs.points = spring_ends(self._scene, poses).astype(np.float32)


def add_lines(
    layer: Layer, name: str, ends: Floats, color: tuple[int, int, int], width: float
) -> Any:
    """Lines between both ends of each, shape (N, 2, 3) [m], so many pixels wide."""
    path, points = f"{layer.path}/{name}", ends.astype(np.float32)
    look: dict[str, Any] = {"thickness": width, "thickness_units": "screen"}
    return layer.scene.add_line_segments(path, points, color, **look)


def draw_ghosts(layer: Layer, scene: em.Scene, state: Floats) -> None:
    """The objects once more, paler, as they are in a state, shape (n,)."""
    poses = em.scenes.body_poses(scene, state)
    for number, body in enumerate(scene.bodies):
        if body.role == "object":
            ghost = _add_body(layer.scene, f"{layer.path}/ghost_{number}", body, GHOST)
            _place(ghost, poses[body.name])


def _add_body(scene: viser.SceneApi, path: str, body: em.Body, opacity: float) -> Any:
    color = BODY_COLORS[body.role]
    return add_surface(scene, path, shape_surface(body.shape), color, opacity, flat=True)


def add_surface(
    scene: viser.SceneApi, path: str, surface: Any, color: str, opacity: float, *, flat: bool
) -> Any:
    """A mesh; a translucent one never hides what is within or behind it.

    It is a glTF file, whose blended materials the browser draws without noting their depth. Viser's
    own meshes note it: of a set within an object, or around one, the inner one would not be seen.
    """
    red, green, blue = linear(np.array(rgb(color), dtype=np.uint8))
    visual: Any = trimesh.visual
    material = visual.material.PBRMaterial(
        baseColorFactor=[red, green, blue, round(255 * opacity)],
        alphaMode="BLEND" if opacity < 1.0 else "OPAQUE",
        metallicFactor=0.0,
        roughnessFactor=1.0,
    )
    surface.visual = visual.TextureVisuals(material=material)
    glb = cast(Any, export_glb)(surface.scene(), include_normals=not flat)
    return scene.add_glb(path, glb, cast_shadow=False)


def linear(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """glTF's colours are proportional to light, those of a screen are not (sRGB)."""
    share = colors / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.round(255.0 * light), dtype=np.uint8)


def _add_ground(
    scene: viser.SceneApi, path: str, plane: em.Plane, center: Floats, cell: float
) -> None:
    """A plane's surface as a grid; it has no end, but fades."""
    normal, offset = np.asarray(plane.normal), plane.offset
    turned, _ = Rotation.align_vectors([normal], [UP])
    center = np.round(center / cell) * cell  # lines at round numbers, if it is level
    center = center - (center @ normal - offset) * normal
    scene.add_grid(
        path,
        width=40 * cell,
        height=40 * cell,
        cell_size=cell,
        section_size=5 * cell,
        cell_color=(215, 215, 215),
        section_color=(170, 170, 170),
        position=center,
        wxyz=_wxyz(turned.as_quat()),
        fade_distance=60 * cell,
    )


def _place(mesh: Any, pose: Pose) -> None:
    mesh.position, mesh.wxyz = pose[0], _wxyz(pose[1])


def _wxyz(orientation: Floats) -> Floats:
    """A quaternion x, y, z, w in the order of the browser's side."""
    return np.asarray(np.roll(orientation, 1))


def shape_surface(shape: Any) -> Any:
    """The closed surface of a shape in its own frame, a Trimesh; of a compound those of all parts.

    Raises TypeError for a Plane, which has no end.
    """
    return trimesh.util.concatenate(
        [trimesh.convex.convex_hull(c) for c in em.scenes.shape_parts(shape)]
    )
