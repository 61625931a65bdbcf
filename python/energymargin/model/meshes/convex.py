"""Convex parts of a solid that is not convex, by approximate decomposition (coacd).

Hulls have few corners, since each costs time in a collision. Parts are cached on disk, under a
digest of the mesh and the settings.
"""

from __future__ import annotations

import hashlib
import json
import logging
import math
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from trimesh import Trimesh

from energymargin.base.bars import bar
from energymargin.base.limits import Limit
from energymargin.base.replacing import replaced
from energymargin.model.meshes.solids import Faces, Points, Solid, joined, points_within

log = logging.getLogger("energymargin")

# A fifth of coacd's own effort in the search for cuts: parts as good, in a quarter of the time.
SEARCH = {"mcts_iterations": 30, "mcts_max_depth": 2}
POLL = 0.02  # s; Ctrl-C is answered within it
PATIENCE = 30.0  # s without a word, where no bar is drawn
CONVEX = 0.99  # share of its hull's volume from which on a mesh is convex
FILLED = 0.1  # share of a cavity's points that may be filled
LEAST_THRESHOLD = 0.01  # coacd's own
# Parts with less than this share of the whole hull's volume are flat but for rounding.
NOTHING = 1e-9

# Where no point sticks out of the thinned hull by more than this share of its size, it is the same.
SAME = 2e-3
EXTREMES = 26  # directions of the first corners
OPTIONS = "Qt Q12"  # facets of triangles; wide ones, of rounded points, are no error


@dataclass(frozen=True)
class Decomposition:
    """How the solids of a file become convex parts."""

    path: Path
    threshold: float
    max_points: int
    seed: int
    limit: Limit

    def parts_of(self, body: Solid, size: float) -> list[Points]:
        """Points (k, 3) of a solid's convex parts; the threshold is of the whole mesh's `size`.

        Raises ValueError if they fill a cavity, whatever the threshold.
        """
        threshold = self.threshold * size / float(body.outer.extents.max())
        if not body.cavities:
            return replace(self, threshold=threshold).parts(body.outer, closed=True)
        surface = joined([body.outer, *body.cavities])
        points = [points_within(cavity) for cavity in body.cavities]
        threshold = min(threshold, 0.5)
        while True:
            decomposition = replace(self, threshold=max(threshold, LEAST_THRESHOLD))
            parts = decomposition.parts(surface, closed=True, hollow=True)
            filled = max(_filled(inside, parts) for inside in points)
            if filled <= FILLED:
                return parts
            if threshold <= LEAST_THRESHOLD:
                raise ValueError(
                    f"{self.path} has a cavity of which its convex parts fill {filled:.0%}, "
                    "expected a greater one, or none. An em.Compound of boxes leaves it empty, and "
                    "decompose=False takes the convex hull of it all"
                )
            threshold /= 2.0

    def parts(self, surface: Trimesh, *, closed: bool, hollow: bool = False) -> list[Points]:
        """Points (k, 3) of a surface's convex parts; one that is not `closed` is made so first.

        Raises RuntimeError if coacd fails, and TimeoutError or Cancelled if it reaches the limit.
        """
        vertices, faces = np.asarray(surface.vertices, float), np.asarray(surface.faces, np.int64)
        solid = closed and not hollow
        convex = solid and surface.volume >= CONVEX * hull_volume(vertices)
        if convex or self.threshold >= 1.0:
            return [corners(vertices, self.max_points)]
        settings: dict[str, Any] = {**SEARCH, "threshold": self.threshold, "seed": self.seed}
        settings["preprocess_mode"] = "off" if closed else "on"
        how = json.dumps([settings, self.max_points, version("coacd")])
        return cached([vertices, faces, how], lambda: self._decomposed(vertices, faces, settings))

    def _decomposed(self, vertices: Points, faces: Faces, settings: dict[str, Any]) -> list[Points]:
        """Points (k, 3) of the parts that coacd makes; says that it takes long."""
        with bar(f"Decomposing {self.path.name}", "meshes") as update:
            if update is not None:
                update(0, 1)
            else:
                _tell(self.path, len(faces))
            raw = self._run(vertices, faces, settings, PATIENCE if update is None else math.inf)
        least = NOTHING * hull_volume(vertices)
        large = [points for points in raw if hull_volume(points) > least]
        if not large:
            raise RuntimeError(
                f"coacd found no part in {self.path}; decompose=False takes its hull"
            )
        return [corners(points, self.max_points) for points in large]

    def _run(
        self, vertices: Points, faces: Faces, settings: dict[str, Any], patience: float
    ) -> list[Points]:
        """The parts that coacd makes, in a process that ends with this call, whatever ends it. Each
        `patience` [s] it says how long that has taken."""
        start, words = time.monotonic(), 1
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
                    stdin=subprocess.PIPE,  # open while this process is: the other one watches
                    stdout=subprocess.DEVNULL,
                    stderr=messages,
                ) as process,
            ):
                try:
                    while process.poll() is None:
                        time.sleep(POLL)
                        self.limit.require(f"{self.path} was decomposed")
                        if (seconds := time.monotonic() - start) > words * patience:
                            words += 1
                            log.warning(f"decomposing {self.path} for {seconds:.0f} s so far")
                except BaseException:
                    process.kill()
                    process.wait()
                    raise
            if process.returncode != 0:
                lines = (folder / "messages").read_text(errors="replace").strip().splitlines()
                why = lines[-1] if lines else f"it ended with {process.returncode}"
                raise RuntimeError(
                    f"coacd fails on {self.path}: {why}; decompose=False takes its hull"
                )
            return _arrays(folder / "parts.npz")


@cache  # a file may have many solids
def _tell(path: Path, faces: int) -> None:
    log.warning(
        f"decomposing {path} of {faces} triangles into convex parts, once: they are cached in "
        f"{cache_folder()}. A tenth of the triangles take about a tenth of the time: "
        "trimesh.load_mesh(path).simplify_quadric_decimation(face_count=3000).export(...) writes "
        "such a mesh (pip install fast-simplification). decompose=False takes the hull at once"
    )


def _filled(points: Points, parts: Sequence[Points]) -> float:
    """The share of the points that lie in a convex part."""
    if not len(points):
        return 0.0
    return float(np.any([inside(points, part) for part in parts], axis=0).mean())


def hull_volume(points: Points) -> float:
    """Volume [m^3] of the convex hull of points, shape (n, 3); 0 if they are flat."""
    try:
        return float(ConvexHull(points, qhull_options=OPTIONS).volume)
    except (QhullError, ValueError):  # flat, or fewer than four points
        return 0.0


def inside(points: Points, part: Points) -> NDArray[np.bool_]:
    """Whether each of the points (n, 3) lies in the convex hull of a part's, shape (n,)."""
    planes = ConvexHull(part, qhull_options=OPTIONS).equations
    return np.asarray((points @ planes[:, :3].T + planes[:, 3] <= 0.0).all(axis=1))


def corners(points: Points, most: int, within: float = math.inf) -> Points:
    """At most `most` corners of the hull of points that span a volume, shape (k, 3).

    All corners if they are no more. Otherwise the hull grows by the corner that is farthest
    outside, until none is farther than `within` [m] or than a small share of its size: it lies
    within the true one.
    """
    all_corners: Points = points[np.sort(ConvexHull(points, qhull_options=OPTIONS).vertices)]
    if len(all_corners) <= most:
        return all_corners
    chosen = _extremes(all_corners) if most >= EXTREMES else _simplex(all_corners)
    hull = ConvexHull(all_corners[chosen], incremental=True, qhull_options=OPTIONS)
    within = min(within, SAME * float(np.ptp(all_corners, axis=0).max()))
    while len(chosen) < most:
        outside = (all_corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        farthest = int(outside.argmax())
        if outside[farthest] <= within:
            break
        chosen.append(farthest)
        hull.add_points(all_corners[[farthest]])
    return np.asarray(all_corners[np.sort(chosen)])


def _simplex(points: Points) -> list[int]:
    """Indices of four points, each the farthest one from what those before it span."""
    chosen = [int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmax())]
    for _ in range(3):
        spanned = np.linalg.qr((points[chosen[1:]] - points[chosen[0]]).T)[0]
        across = points - points[chosen[0]]
        chosen.append(int(np.linalg.norm(across - across @ spanned @ spanned.T, axis=1).argmax()))
    return chosen


def _extremes(points: Points) -> list[int]:
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


def cached(content: Sequence[str | NDArray[Any]], make: Callable[[], list[Points]]) -> list[Points]:
    """Arrays that follow from the content alone, from the cache if they are there."""
    digest = hashlib.sha256()
    for part in content:
        data = part.encode() if isinstance(part, str) else part.tobytes()
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    file = cache_folder() / "convex" / f"{digest.hexdigest()}.npz"
    with suppress(OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile):  # none, or damaged
        return _arrays(file)
    made = make()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with replaced(file) as new, new.open("wb") as stream:
            np.savez(stream, *made)
    except OSError as error:
        log.warning("convex parts are not cached: %s", error)
    return made


def _arrays(file: Path) -> list[Points]:
    """Those of a file of `np.savez`, in order."""
    with np.load(file, allow_pickle=False) as found:
        return [np.asarray(found[f"arr_{i}"], float) for i in range(len(found.files))]
