"""Shapes from mesh files: convex parts that move as one, with the mass properties of the mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Compound, ConvexHull, Inertial, MassProperties
from energymargin.limits import Limit
from energymargin.plausibility import warn

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = ["Mesh", "needs_extra"]

SUFFIXES = (".stl", ".obj", ".dae")
THRESHOLD = 0.1  # a duck has five parts, a bunny about twenty
MAX_POINTS = 128  # a ball of them has 95 % of its volume
CONVEX = 0.99  # share of its hull's volume from which on a mesh is convex
FLAT = 1e-6  # volume below which a mesh is a sheet, as a share of the cube of its size
LARGEST = 20.0  # m; what a robot handles is smaller, unless its scale is wrong
MAX_SHELLS = 64  # a mesh of more, such as an assembly with its screws, is taken apart as a whole


def Mesh(
    path: str | Path,
    *,
    scale: float | Sequence[float] = 1.0,
    decompose: bool = True,
    threshold: float = THRESHOLD,
    max_points: int = MAX_POINTS,
    seed: int = 0,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Compound:
    """A solid from a mesh file (STL, OBJ, DAE), as convex parts that move as one.

    The file's numbers are metres, times `scale`, one number or one for each axis; a DAE file's own
    unit is applied, and its up axis is not. Several geometries in a file are joined. A closed
    surface that is convex within 1 % of its volume becomes one part, any other is taken apart with
    coacd: `threshold` is the concavity that a part may keep, as a share of the mesh's size, and
    `seed` that of coacd's search. `decompose=False` takes the convex hull of it all instead. A part
    has `max_points` corners at most.

    `solid` has the exact mass properties of the mesh if it is closed; otherwise it is None, and
    those of the parts together count. Holes of one or two triangles are filled. Greater ones make
    a mesh a shell, which has many parts and takes coacd a minute.

    Parts are kept in the user's cache folder (ENERGYMARGIN_CACHE, or else XDG_CACHE_HOME), so that
    the same mesh is taken apart once. Raises FileNotFoundError; ValueError that names what is wrong
    with the file or an argument; RuntimeError if coacd fails; ImportError without the extra [urdf];
    TimeoutError if it takes longer than `timeout` [s], and Cancelled once `cancel` is set.
    """
    limit = Limit(timeout, cancel)
    sizes = _scale(scale)
    _check(threshold, max_points, seed)
    with needs_extra():
        from energymargin.convex import corners
    path = Path(path)
    pieces = _read(path, sizes)
    whole = _joined(pieces)
    vertices = np.asarray(whole.vertices, float)
    _require_volume(vertices, path)
    _warn_of_size(vertices, scale, path)
    shells = _shells(pieces)
    solid = _solid(_joined(shells)) if shells else None
    if not decompose:
        return Compound([ConvexHull(corners(vertices, max_points))], solid=solid)
    closed = shells is not None and len(shells) <= MAX_SHELLS
    parts = [
        part
        for surface in (shells if shells and closed else [whole])
        for part in _parts(
            surface,
            closed,
            path,
            threshold=threshold * float(whole.extents.max() / surface.extents.max()),
            max_points=max_points,
            seed=seed,
            limit=limit,
        )
    ]
    return Compound([ConvexHull(part) for part in parts], solid=solid)


@contextmanager
def needs_extra() -> Iterator[None]:
    """Tells what to install if an import fails."""
    try:
        yield
    except ImportError as error:
        raise ImportError(
            f"meshes and URDF files need {error.name}: pip install energymargin[urdf]"
        ) from error


def _warn_of_size(vertices: NDArray[np.float64], scale: Any, path: Path) -> None:
    extent = float(np.ptp(vertices, axis=0).max())
    if extent > LARGEST:
        text = (
            f"scale is {scale!r}, which makes {path.name} {extent:.3g} m long: lengths are in "
            f"metres; a file in millimetres needs 0.001."
        )
        warn([("scale", text)], text, stacklevel=3)


def _scale(scale: Any) -> NDArray[np.float64]:
    try:
        sizes = np.broadcast_to(np.asarray(scale, float), 3)
    except (TypeError, ValueError):
        sizes = np.zeros(3)
    if not np.isfinite(sizes).all() or (sizes == 0).any():
        raise ValueError(f"scale is {scale!r}, expected one number that is not 0, or three")
    return sizes


def _check(threshold: float, max_points: int, seed: int) -> None:
    for name, value, least, most in (
        ("threshold", threshold, 0.01, 1.0),
        ("max_points", max_points, 26, 10_000),
        ("seed", seed, 0, 2**32 - 1),
    ):
        if not least <= value <= most:
            raise ValueError(f"{name} is {value!r}, expected a number from {least} to {most}")


def _read(path: Path, scale: NDArray[np.float64]) -> list[Trimesh]:
    """A file's geometries in metres, each with one vertex for each place."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"path is {str(path)!r}, expected a file that ends in {' '.join(SUFFIXES)}"
        )
    if not path.is_file():
        raise FileNotFoundError(f"path is {str(path)!r}, and there is no such file")
    pieces = [_surface(*piece) for piece in _geometries(path, scale)]
    if all(_closed(piece) for piece in pieces):
        return pieces
    joined = _joined(pieces)  # one surface may lie in several groups
    joined.fill_holes()
    return [joined]


def _geometries(
    path: Path, scale: NDArray[np.float64]
) -> list[tuple[NDArray[np.float64], NDArray[np.int64]]]:
    """Vertices [m] and faces of each object in a file."""
    with needs_extra():
        import trimesh

        if path.suffix.lower() == ".dae":
            import collada  # noqa: F401
    options: dict[str, Any] = (
        {"split_objects": True, "split_groups": True, "skip_materials": True}
        if path.suffix.lower() == ".obj"
        else {}
    )
    try:
        scene = trimesh.load_scene(path, process=False, **options)
        meshes = [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh)]
        unit = trimesh.units.unit_conversion(scene.units, "meters") if scene.units else 1.0
    except Exception as error:  # each format's reader fails in its own ways
        raise ValueError(f"{path} is no {path.suffix[1:].upper()} mesh: {error}") from error
    found = [(np.array(m.vertices, float) * unit * scale, np.array(m.faces)) for m in meshes]
    found = [(vertices, faces) for vertices, faces in found if len(faces)]
    if not found:
        raise ValueError(f"{path} has no faces, expected a surface")
    if not all(np.isfinite(vertices).all() for vertices, _ in found):
        raise ValueError(f"{path} has a vertex that is not finite")
    return found


def _surface(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Trimesh:
    """A mesh whose faces meet at common vertices."""
    import trimesh

    surface = trimesh.Trimesh(vertices, faces, process=False)
    surface.merge_vertices()
    a, b, c = surface.faces.T
    surface.update_faces((a != b) & (b != c) & (c != a))
    surface.remove_unreferenced_vertices()
    return surface


def _joined(pieces: Sequence[Trimesh]) -> Trimesh:
    counts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    faces = [piece.faces + start for piece, start in zip(pieces, counts, strict=False)]
    return _surface(
        np.concatenate([piece.vertices for piece in pieces]),
        np.concatenate(faces),
    )


def _closed(surface: Trimesh) -> bool:
    return bool(surface.is_watertight and surface.is_winding_consistent)


def _shells(pieces: Sequence[Trimesh]) -> list[Trimesh] | None:
    """The closed surfaces that a mesh consists of, facing outwards; None if it is open.

    All may face inwards, and are then turned. Where some face otherwise than the rest they are
    cavities or mistakes, which cannot be told apart: the mesh counts as open.
    """
    if not all(_closed(piece) for piece in pieces):
        return None
    split = [piece.split(only_watertight=False, repair=False) for piece in pieces]
    shells = [shell for parts in split for shell in parts]
    inwards = [shell.volume < 0 for shell in shells]
    if any(inwards) and not all(inwards):
        return None
    for shell in shells if all(inwards) else []:
        shell.invert()
    return shells


def _require_volume(vertices: NDArray[np.float64], path: Path) -> None:
    from energymargin.convex import hull_volume

    size = float(np.ptp(vertices, axis=0).max())
    if hull_volume(vertices) <= FLAT * size**3:
        raise ValueError(f"{path} is flat, expected a mesh with a volume: give it a thickness")


def _parts(
    surface: Trimesh,
    closed: bool,
    path: Path,
    *,
    threshold: float,
    max_points: int,
    seed: int,
    limit: Limit,
) -> list[NDArray[np.float64]]:
    """Corners of a surface's convex parts, each (k, 3)."""
    from energymargin.convex import corners, decomposed, hull_volume

    vertices = np.asarray(surface.vertices, float)
    convex = closed and surface.volume >= CONVEX * hull_volume(vertices)
    if convex or threshold >= 1.0:
        return [corners(vertices, max_points)]
    return decomposed(
        vertices,
        np.asarray(surface.faces, np.int64),
        closed=closed,
        threshold=threshold,
        max_points=max_points,
        seed=seed,
        name=str(path),
        limit=limit,
    )


def _solid(closed: Trimesh) -> MassProperties:
    """Exact mass properties of a closed mesh of 1 kg."""
    volume = float(closed.volume)
    spread = Inertial(closed.center_mass, inertia=closed.moment_inertia / volume)
    return MassProperties(volume, spread.center, spread.moments, spread.axes)
