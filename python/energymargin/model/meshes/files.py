"""Shapes from mesh files: convex parts that move as one, with the mass properties of the mesh."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin._core import Cancel, Inertial, MassProperties
from energymargin.base.bars import Update
from energymargin.base.checks import positive_number
from energymargin.base.errors import EnergyMarginError, needs_extra
from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn
from energymargin.model.meshes.collada_checks import check_collada
from energymargin.model.meshes.solids import joined, merged, points_within, solids, winding_numbers
from energymargin.model.meshes.surfaces import closed_surfaces

if TYPE_CHECKING:
    from trimesh import Trimesh

    from energymargin.model.meshes.convex import Decomposition
    from energymargin.model.meshes.shape import MeshShape
    from energymargin.model.meshes.solids import Faces, Points, Solid

SUFFIXES = (".stl", ".obj", ".dae")
THRESHOLD = 0.1  # a duck has five parts, a bunny about twenty
MAX_POINTS = 128  # a ball of them has 95 % of its volume
LEAST_POINTS = 8  # those of a box
OVERLAP = 1e-9  # share of a volume; what overlaps by less is as good as apart
FLAT = 1e-6  # volume below which a mesh is a sheet, as a share of the cube of its size
LARGEST = 20.0  # m; what a robot handles is smaller, unless its scale is wrong
MAX_SHELLS = 64  # a mesh of more, such as an assembly with its screws, is decomposed as a whole


class FlatMeshError(EnergyMarginError, ValueError):
    """A mesh has no volume, as that of a sticker."""


def mesh(
    path: str | Path,
    *,
    scale: float | Sequence[float] = 1.0,
    decompose: bool = True,
    threshold: float = THRESHOLD,
    accuracy: float | None = None,
    max_points: int = MAX_POINTS,
    recenter: bool = False,
    seed: int = 0,
    progress: Update | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> MeshShape:
    """A solid from a mesh file (STL, OBJ, DAE), as convex parts that move as one.

    The file's numbers are metres; a DAE file's own unit is applied, its up axis is not. Several
    geometries in a file are joined. A closed surface that is convex within 1 % of its volume
    becomes one part; any other is decomposed with coacd.

    `solid` of the result has the exact mass properties of the mesh if it is closed: what lies in
    several of its bodies counts once, and so does a face that is there twice or turned the wrong
    way, with a warning. Of an open mesh it is None, and the parts' own mass properties count, with
    a warning. Holes of one or two triangles are filled. Larger ones make a mesh a shell, which has
    many parts and takes coacd a minute.

    A closed surface within another that faces the other way bounds a cavity; one that faces the
    same way is inside of the body, with a warning. The parts leave at least nine tenths of a cavity
    empty, if need be with a smaller threshold than the given one. It is an error if the smallest
    threshold fills a cavity too, or if a surface may be a cavity or not.

    `deviation` of the result says how far the parts are from the mesh, and how wide an opening they
    may close. With `accuracy`, parts of coacd that are farther off are cut until none is: a hole of
    42 mm takes a peg of 41 mm with 0.4 mm.

    Parts are cached in the user's cache folder (ENERGYMARGIN_CACHE, or else XDG_CACHE_HOME), so
    that a mesh is decomposed once. coacd runs in a process of its own, which ends with this call:
    Ctrl-C, `timeout` and `cancel` end both, and a command draws a bar.

    Args:
        path: the mesh file.
        scale: a factor, or one for each axis, shape (3,).
        decompose: False takes the convex hull of the whole mesh.
        threshold: the concavity that a part may have, as a share of the mesh's size.
        accuracy: how far a point of the parts may be from a closed mesh, or one of the mesh from
            the parts, at most [m]. None leaves that to `threshold`.
        max_points: corners of a part at most, from 8 on.
        recenter: True puts the body's frame at the centre of mass; `origin` of the result says
            where that is in the file.
        seed: of coacd's search.
        progress: progress(done, total) counts the solids of the file.
        timeout: [s].
        cancel: ends it once it is set.

    Raises:
        FileNotFoundError: if there is no such file.
        ValueError: that names what is wrong with the file or an argument.
        RuntimeError: if coacd fails.
        ImportError: without the extra [urdf].
        TimeoutError: after `timeout`. Cancelled: once `cancel` is set.
    """
    shape = shape_of(
        path,
        scale=scale,
        decompose=decompose,
        threshold=threshold,
        accuracy=accuracy,
        max_points=max_points,
        recenter=recenter,
        seed=seed,
        progress=progress,
        limit=Limit(timeout, cancel),
    )
    if shape.solid is None:
        warn_of_open([Path(path).name], str(path))
    return shape


def warn_of_open(names: Sequence[str], fingerprint: str) -> None:
    """Warns of shapes whose meshes have no inside, where their mass properties count."""
    text = (
        f"{', '.join(names)}: not closed, or closed surfaces that contradict each other, so "
        "volume, centre of mass and inertia are those of the convex parts, which may be some "
        "per cent off: close the mesh, or give mass and inertia."
    )
    warn([(text, text)], fingerprint)


def shape_of(
    path: str | Path,
    *,
    scale: float | Sequence[float],
    decompose: bool,
    threshold: float,
    accuracy: float | None,
    max_points: int,
    limit: Limit,
    recenter: bool = False,
    seed: int = 0,
    progress: Update | None = None,
) -> MeshShape:
    """The result of `mesh`, with `limit` for its timeout and cancel; says nothing of open meshes.

    Raises FlatMeshError, and all that `mesh` does.
    """
    from energymargin.model.meshes.convex import Decomposition, corners, hull_volume
    from energymargin.model.meshes.shape import MeshShape

    sizes = _scale(scale)
    for name, value, least, most in (
        ("threshold", threshold, 0.01, 1.0),
        ("max_points", max_points, LEAST_POINTS, 10_000),
        ("seed", seed, 0, 2**32 - 1),
    ):
        if not least <= value <= most:
            raise ValueError(f"{name} is {value!r}, expected a number from {least} to {most}")
    if accuracy is not None:
        positive_number("accuracy", accuracy)
    path = Path(path)
    pieces = _read(path, sizes)
    whole = joined(pieces)
    vertices = np.asarray(whole.vertices, float)
    size = float(np.ptp(vertices, axis=0).max())
    if hull_volume(vertices) <= FLAT * size**3:
        raise FlatMeshError(f"{path} is flat, expected a mesh with a volume: give it a thickness")
    if size > LARGEST:
        text = f"scale is {scale!r}, which makes {path.name} {size:.3g} m long: lengths are in "
        text += "metres; a file in millimetres needs 0.001."
        warn([("scale", text)], text)
    try:
        bodies = _bodies(pieces, path, limit)
    except ValueError:
        if decompose:
            raise
        bodies = []  # the surfaces contradict each other, and the hull is the same
    if not bodies:
        whole.fill_holes()
    if accuracy is not None and not (decompose and bodies):
        why = f"{path} has holes, so no inside; close it" if decompose else "decompose is False"
        raise ValueError(f"accuracy is {accuracy!r}, and {why}; expected accuracy=None there")
    if not decompose:
        parts = [corners(vertices, max_points)]
    else:
        how = Decomposition(path, threshold, max_points, seed, limit)
        parts = _parts(whole, bodies, how, accuracy, progress or (lambda done, total: None))
    return MeshShape(parts, _solid(bodies) if bodies else None, bodies, recenter=recenter)


def _bodies(pieces: list[Trimesh], path: Path, limit: Limit) -> list[Solid]:
    """The solids in a file; none if it has holes. Raises ValueError where surfaces contradict."""
    surfaces = closed_surfaces(pieces)
    if surfaces is None:
        return []
    bodies = solids(surfaces.shells, path, limit, certain=not surfaces.turned)
    if surfaces.turned:
        text = f"{path.name} has faces that are there twice or face both ways: they are turned "
        warn([("turned", text + "alike, and what they enclose is taken as solid.")], str(path))
    return [body for body in bodies if not (body.buried and _adds_nothing(body, bodies))]


def _adds_nothing(body: Solid, bodies: Sequence[Solid]) -> bool:
    """Whether a body lies in others that are not buried."""
    from energymargin.model.meshes.deviation import solid_of

    own = solid_of([body])
    rest = own - solid_of([other for other in bodies if not other.buried])
    return bool(rest.volume() <= OVERLAP * own.volume())


def _parts(
    whole: Trimesh, bodies: list[Solid], how: Decomposition, accuracy: float | None, report: Update
) -> list[Points]:
    """Points (k, 3) of the convex parts of a mesh, from its bodies if it is closed."""
    from energymargin.model.meshes.cuts import parts_within

    raw = how if accuracy is None else replace(how, max_points=sys.maxsize)
    apart = len(bodies) <= MAX_SHELLS or any(body.cavities for body in bodies)
    several = bodies if apart else []  # else it is decomposed as a whole
    if not bodies:
        _require_no_cavity(whole, how.path, how.limit)
    report(0, max(1, len(several)))
    parts = [] if several else raw.parts(whole, closed=False)
    for done, body in enumerate(several, 1):
        parts += raw.parts_of(body, float(whole.extents.max()))
        report(done, len(several))
    return parts if accuracy is None else parts_within(accuracy, parts, bodies, how)


def _scale(scale: Any) -> Points:
    try:
        sizes = np.broadcast_to(np.asarray(scale, float), 3)
    except (TypeError, ValueError):
        sizes = np.zeros(3)
    if not np.isfinite(sizes).all() or (sizes == 0).any():
        raise ValueError(f"scale is {scale!r}, expected one number that is not 0, or three")
    return sizes


def _read(path: Path, scale: Points) -> list[Trimesh]:
    """A file's geometries in metres, each with one vertex for each place."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"path is {str(path)!r}, expected a file that ends in {' '.join(SUFFIXES)}: "
            "trimesh.load_mesh(path).export('mesh.stl') makes one of PLY, OFF, GLB or 3MF, and CAD "
            "programs export STL of STEP"
        )
    if not path.is_file():
        raise FileNotFoundError(f"path is {str(path)!r}, and there is no such file")
    return [merged(*piece) for piece in _geometries(path, scale)]


def _geometries(path: Path, scale: Points) -> list[tuple[Points, Faces]]:
    """Vertices [m] and faces of each object in a file."""
    with needs_extra("a mesh file", "urdf"):
        import trimesh

        if path.suffix.lower() == ".dae":
            import collada  # noqa: F401
    of_obj = ("split_objects", "split_groups", "skip_materials")
    options: Any = dict.fromkeys(of_obj if path.suffix.lower() == ".obj" else (), True)
    try:
        if path.suffix.lower() == ".dae":
            check_collada(path)
        scene = trimesh.load_scene(path, process=False, **options)
        meshes = [piece for piece in scene.dump() if isinstance(piece, trimesh.Trimesh)]
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


def _require_no_cavity(surface: Trimesh, path: Path, limit: Limit) -> None:
    """Raises ValueError on a closed surface that faces inwards within a surface with holes.

    What closes the holes would fill the cavity. One is let pass if it is as small a share of the
    hull as a dent that a convex part may have: scans have such by mistake.
    """
    from energymargin.model.meshes.convex import CONVEX, hull_volume

    least = (1.0 - CONVEX) * hull_volume(np.asarray(surface.vertices, float))
    for piece in surface.split(only_watertight=True, repair=False):
        if piece.volume >= -least:
            continue
        limit.require(f"the surfaces of {path} were sorted")
        points = points_within(piece)
        around = winding_numbers(points, surface) - winding_numbers(points, piece)
        if (around > 0.5).mean() > 0.5:
            raise ValueError(
                f"{path} has a cavity and holes, expected a closed surface; "
                "decompose=False takes the convex hull of it all"
            )


def _solid(bodies: Sequence[Solid]) -> MassProperties:
    """Exact mass properties of bodies of 1 kg together; where they overlap they count once."""
    from energymargin.model.meshes.deviation import mesh_of, solid_of

    closed = joined([surface for body in bodies for surface in (body.outer, *body.cavities)])
    if len(bodies) > 1:
        union = solid_of(bodies)
        if union.volume() < (1.0 - OVERLAP) * closed.volume:
            closed = mesh_of(union)
    volume = float(closed.volume)
    inertial = Inertial(closed.center_mass, inertia=closed.moment_inertia / volume)
    return MassProperties(volume, inertial.center, inertial.moments, inertial.axes)
