"""Shapes from mesh files: convex parts that move as one, with the mass properties of the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from energymargin._core import Cancel
from energymargin.base.bars import Update
from energymargin.base.errors import needs_extra
from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn
from energymargin.model.meshes.settings import (
    MAX_POINTS,
    THRESHOLD,
    PartSettings,
    check_file,
    sizes_of,
)

if TYPE_CHECKING:
    from energymargin.model.meshes.shape import MeshShape


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
    how = PartSettings(decompose, threshold, accuracy, max_points, recenter, seed)
    shape = shape_of(path, how, Limit(timeout, cancel), scale, progress)
    if shape.solid is None:
        warn_of_open([Path(path).name], str(path))
    return shape


def warn_of_open(names: Sequence[str], fingerprint: str) -> None:
    """Warns of shapes whose meshes have no inside, where their mass properties count."""
    text = f"{', '.join(names)}: not closed, or closed surfaces that contradict each other, so "
    text += "volume, centre of mass and inertia are those of the convex parts, which may be some "
    text += "per cent off: close the mesh, or give mass and inertia."
    warn([(text, text)], fingerprint)


def shape_of(
    path: str | Path, how: PartSettings, limit: Limit, scale: Any, progress: Update | None = None
) -> MeshShape:
    """The result of `mesh`, with `limit` for its timeout and cancel; says nothing of open meshes.

    Raises FlatMeshError, and all that `mesh` does.
    """
    sizes_of(scale)
    check_file(Path(path))
    with needs_extra("a mesh file", "urdf"):
        from energymargin.model.meshes.shape import made_of
    tell = (lambda done, total: None) if progress is None else progress
    return made_of(Path(path), how, limit, scale, tell)
