"""Convex parts of a solid that is not convex, by approximate decomposition (coacd).

Hulls have few corners, since each costs time in a collision. Parts are cached on disk, under a
digest of the mesh and the settings.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Sequence
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from energymargin.bars import bar
from energymargin.limits import Limit
from energymargin.replacing import replaced

log = logging.getLogger("energymargin")

# A fifth of coacd's own effort in the search for cuts: parts as good, in a quarter of the time.
SEARCH = {"mcts_iterations": 30, "mcts_max_depth": 2}
POLL = 0.02  # s; Ctrl-C is answered within it
# Parts with less than this share of the whole hull's volume are flat but for rounding.
NOTHING = 1e-9

# Where no point sticks out of the thinned hull by more than this share of its size, it is the same.
SAME = 2e-3
OPTIONS = "Qt Q12"  # facets of triangles; wide ones, of rounded points, are no error


def decomposed(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    *,
    closed: bool,
    threshold: float,
    max_points: int,
    seed: int,
    path: Path,
    limit: Limit,
) -> list[NDArray[np.float64]]:
    """Points of convex parts of a mesh, shapes (k, 3) with k up to `max_points`.

    A mesh that is not `closed` is made so first. `threshold`: the concavity that a part may have,
    as a share of the mesh's size. `path` is for messages. Raises RuntimeError if coacd fails, and
    TimeoutError or Cancelled if it reaches the limit.
    """
    settings = {
        **SEARCH,
        "threshold": threshold,
        "seed": seed,
        "preprocess_mode": "off" if closed else "on",
    }
    key = _key(
        np.ascontiguousarray(vertices, float).tobytes(),
        np.ascontiguousarray(faces, np.int64).tobytes(),
        json.dumps([settings, max_points, version("coacd")]).encode(),
    )
    parts = _load(key)
    if parts is None:
        with bar(f"Decomposing {path.name}", "meshes") as update:
            if update is not None:
                update(0, 1)
            else:
                log.warning(
                    "decomposing %s into convex parts, once: they are cached in %s. A greater "
                    "threshold is faster, and decompose=False takes the hull at once",
                    path,
                    cache_folder(),
                )
            raw = _run(vertices, faces, settings, path, limit)
        least = NOTHING * hull_volume(vertices)
        parts = [corners(points, max_points) for points in raw if hull_volume(points) > least]
        if not parts:
            raise RuntimeError(f"coacd found no part in {path}; decompose=False takes its hull")
        _store(key, parts)
    return parts


def _run(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    settings: dict[str, Any],
    path: Path,
    limit: Limit,
) -> list[NDArray[np.float64]]:
    """The parts that coacd makes, in a process that ends with this call, whatever ends it."""
    script = Path(__file__).with_name("coacd_process.py")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with tempfile.TemporaryDirectory() as name_of_folder:
        folder = Path(name_of_folder)
        text = np.array(json.dumps(settings))
        np.savez(folder / "mesh.npz", vertices=vertices, faces=faces, settings=text)
        with (
            open(folder / "messages", "wb") as messages,
            subprocess.Popen(
                [sys.executable, str(script), str(folder)],
                env=environment,
                stdin=subprocess.PIPE,  # open as long as this process is: the other one watches it
                stdout=subprocess.DEVNULL,
                stderr=messages,
            ) as process,
        ):
            try:
                while process.poll() is None:
                    time.sleep(POLL)
                    limit.require(f"{path} was decomposed")
            except BaseException:
                process.kill()
                process.wait()
                raise
        if process.returncode != 0:
            lines = (folder / "messages").read_text(errors="replace").strip().splitlines()
            why = lines[-1] if lines else f"it ended with {process.returncode}"
            raise RuntimeError(f"coacd fails on {path}: {why}; decompose=False takes its hull")
        with np.load(folder / "parts.npz") as parts:
            return [np.asarray(parts[f"arr_{i}"], float) for i in range(len(parts.files))]


def hull_volume(points: NDArray[np.float64]) -> float:
    """Volume [m^3] of the convex hull of points, shape (n, 3); 0 if they are flat."""
    try:
        return float(ConvexHull(points, qhull_options=OPTIONS).volume)
    except (QhullError, ValueError):  # flat, or fewer than four points
        return 0.0


def inside(points: NDArray[np.float64], part: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each of the points (n, 3) lies in the convex hull of a part's, shape (n,)."""
    planes = ConvexHull(part, qhull_options=OPTIONS).equations
    return np.asarray((points @ planes[:, :3].T + planes[:, 3] <= 0.0).all(axis=1))


def corners(points: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    """At most `most` corners of the hull of points that span a volume, shape (k, 3).

    All corners if they are no more. Otherwise the hull grows by the corner that is farthest
    outside, until none is far: it lies within the true one.
    """
    all_corners: NDArray[np.float64] = points[
        np.sort(ConvexHull(points, qhull_options=OPTIONS).vertices)
    ]
    if len(all_corners) <= most:
        return all_corners
    chosen = _extremes(all_corners)
    hull = ConvexHull(all_corners[chosen], incremental=True, qhull_options=OPTIONS)
    size = float(np.ptp(all_corners, axis=0).max())
    while len(chosen) < most:
        outside = (all_corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        farthest = int(outside.argmax())
        if outside[farthest] <= SAME * size:
            break
        chosen.append(farthest)
        hull.add_points(all_corners[[farthest]])
    return np.asarray(all_corners[np.sort(chosen)])


def _extremes(points: NDArray[np.float64]) -> list[int]:
    """Indices of the points that are farthest out along the principal axes and between them."""
    centered = points - points.mean(axis=0)
    spreads, axes = np.linalg.svd(centered, full_matrices=False)[1:]
    along = centered @ axes.T / spreads
    directions = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], float)
    return sorted({int(i) for i in (along @ directions.T).argmax(axis=0)})


def cache_folder() -> Path:
    """ENERGYMARGIN_CACHE, or else `energymargin` in the user's cache folder."""
    if own := os.environ.get("ENERGYMARGIN_CACHE"):
        return Path(own)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "energymargin"


def _key(*contents: bytes) -> str:
    """A name for what follows from the contents."""
    digest = hashlib.sha256()
    for content in contents:
        digest.update(len(content).to_bytes(8, "little"))
        digest.update(content)
    return digest.hexdigest()


def _load(name: str) -> list[NDArray[np.float64]] | None:
    """The point sets of a name, each (k, 3); None if there are none, or the file is damaged."""
    try:
        with np.load(_file(name), allow_pickle=False) as file:
            return [np.asarray(file[f"arr_{i}"], float) for i in range(len(file.files))]
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile):
        return None


def _store(name: str, points: Sequence[NDArray[np.float64]]) -> None:
    """Caches point sets; a folder that cannot be written to is no error."""
    file = _file(name)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with replaced(file) as new, new.open("wb") as stream:
            np.savez(stream, *points)
    except OSError as error:
        log.warning("convex parts are not cached: %s", error)


def _file(name: str) -> Path:
    return cache_folder() / "convex" / f"{name}.npz"
