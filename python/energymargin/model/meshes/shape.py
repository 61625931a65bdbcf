"""What a mesh file becomes: a compound that knows how it differs from the mesh."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import numpy as np
from trimesh import Trimesh

from energymargin._core import Compound, ConvexHull, Inertial, MassProperties, mass_properties
from energymargin.base.bars import Update
from energymargin.base.errors import needs_extra
from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn
from energymargin.model.meshes import solids
from energymargin.model.meshes.collada_checks import check_collada
from energymargin.model.meshes.convex import CONVEX, Decomposition, cached, corners, hull_volume
from energymargin.model.meshes.cuts import parts_within
from energymargin.model.meshes.deviation import Deviation, deviation, mesh_of, solid_of
from energymargin.model.meshes.settings import FlatMeshError, PartSettings, sizes_of
from energymargin.model.meshes.solids import Faces, Points, Solid, joined, merged
from energymargin.model.meshes.surfaces import closed_surfaces

OVERLAP = 1e-9  # share of a volume; what overlaps by less is as good as apart
FLAT = 1e-6  # volume below which a mesh is a sheet, as a share of the cube of its size
LARGEST = 20.0  # m; what a robot handles is smaller, unless its scale is wrong
MAX_SHELLS = 64  # a mesh of more, such as an assembly with its screws, is decomposed as a whole


class MeshShape(Compound):
    """Convex parts of a mesh, which move as one, and how they differ from it."""

    def __init__(
        self,
        parts: Sequence[Points],
        solid: MassProperties | None,
        bodies: Sequence[Solid],
        *,
        recenter: bool,
    ) -> None:
        """Parts (k, 3), and the bodies that they stand for, in the frame of the file."""
        self._parts, self._bodies = parts, bodies
        self._origin = np.zeros(3)
        if recenter:
            of = solid or mass_properties(Compound([ConvexHull(part) for part in parts]))
            self._origin = np.array(of.center)
        if recenter and solid is not None:
            solid = MassProperties(solid.volume, np.zeros(3), solid.moments, solid.axes)
        super().__init__([ConvexHull(part - self._origin) for part in parts], solid=solid)

    def __reduce__(self) -> tuple[type[Compound], tuple[Any, ...]]:
        """In another process, and in digests, it is its parts alone."""
        return Compound, (self.parts, self.solid)

    @property
    def origin(self) -> Points:
        """Where the body's frame is in that of the file, shape (3,) [m]: 0, or the centre of mass
        with `recenter`."""
        return self._origin.copy()

    @property
    def deviation(self) -> Deviation | None:
        """How the parts differ from the mesh; None if that has holes, and so no inside."""
        if not self._bodies:
            return None
        figures = cached(
            ["deviation", *solids.triangles(self._bodies), *self._parts],
            lambda: [np.array(astuple(deviation(solid_of(self._bodies), self._parts)))],
        )
        return Deviation(*figures[0].tolist())


def made_of(path: Path, how: PartSettings, limit: Limit, scale: Any, report: Update) -> MeshShape:
    """That of a file, as `em.mesh` says."""
    pieces = [merged(*piece) for piece in _geometries(path, sizes_of(scale))]
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
        if how.decompose:
            raise
        bodies = []  # the surfaces contradict each other, and the hull is the same
    if not bodies:
        whole.fill_holes()
    if how.accuracy is not None and not (how.decompose and bodies):
        why = f"{path} has holes, so no inside; close it" if how.decompose else "decompose is False"
        raise ValueError(f"accuracy is {how.accuracy!r}, and {why}; expected accuracy=None there")
    if how.decompose:
        cutting = Decomposition(path, how.threshold, how.max_points, how.seed, limit)
        parts = _parts(whole, bodies, cutting, how.accuracy, report)
    else:
        parts = [corners(vertices, how.max_points)]
    return MeshShape(parts, _solid(bodies) if bodies else None, bodies, recenter=how.recenter)


def _bodies(pieces: list[Trimesh], path: Path, limit: Limit) -> list[Solid]:
    """The solids in a file; none if it has holes. Raises ValueError where surfaces contradict."""
    surfaces = closed_surfaces(pieces)
    if surfaces is None:
        return []
    bodies = solids.solids(surfaces.shells, path, limit, certain=not surfaces.turned)
    if surfaces.turned:
        text = f"{path.name} has faces that are there twice or face both ways: they are turned "
        warn([("turned", text + "alike, and what they enclose is taken as solid.")], str(path))
    return [body for body in bodies if not (body.buried and _adds_nothing(body, bodies))]


def _adds_nothing(body: Solid, bodies: Sequence[Solid]) -> bool:
    """Whether a body lies in others that are not buried."""
    own = solid_of([body])
    rest = own - solid_of([other for other in bodies if not other.buried])
    return bool(rest.volume() <= OVERLAP * own.volume())


def _parts(
    whole: Trimesh, bodies: list[Solid], how: Decomposition, accuracy: float | None, report: Update
) -> list[Points]:
    """Points (k, 3) of the convex parts of a mesh, from its bodies if it is closed."""
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
    least = (1.0 - CONVEX) * hull_volume(np.asarray(surface.vertices, float))
    for piece in surface.split(only_watertight=True, repair=False):
        if piece.volume >= -least:
            continue
        limit.require(f"the surfaces of {path} were sorted")
        points = solids.points_within(piece)
        around = solids.winding_numbers(points, surface) - solids.winding_numbers(points, piece)
        if (around > 0.5).mean() > 0.5:
            expected = "expected a closed surface; decompose=False takes the convex hull of it all"
            raise ValueError(f"{path} has a cavity and holes, {expected}")


def _solid(bodies: Sequence[Solid]) -> MassProperties:
    """Exact mass properties of bodies of 1 kg together; where they overlap they count once."""
    closed = joined([surface for body in bodies for surface in (body.outer, *body.cavities)])
    if len(bodies) > 1:
        union = solid_of(bodies)
        if union.volume() < (1.0 - OVERLAP) * closed.volume:
            closed = mesh_of(union)
    volume = float(closed.volume)
    inertial = Inertial(closed.center_mass, inertia=closed.moment_inertia / volume)
    return MassProperties(volume, inertial.center, inertial.moments, inertial.axes)
