"""Convex parts of a mesh, by approximate convex decomposition (coacd), kept on disk."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.convex import cache
from energymargin.convex.hulls import corners, hull_volume
from energymargin.limits import Limit

__all__ = ["decomposed"]

log = logging.getLogger("energymargin")

# A fifth of coacd's own effort in the search for cuts: parts as good, in a quarter of the time.
SEARCH = {"mcts_iterations": 30, "mcts_max_depth": 2}
PATIENCE = 5.0  # s; a longer wait is told of
POLL = 0.02  # s; Ctrl-C is answered within it
# Parts with less than this share of the whole hull's volume are flat but for rounding.
NOTHING = 1e-9


def decomposed(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    *,
    closed: bool,
    threshold: float,
    max_points: int,
    seed: int,
    name: str,
    limit: Limit,
) -> list[NDArray[np.float64]]:
    """Points of convex parts of a mesh, shapes (k, 3) with k up to `max_points`.

    A mesh that is not `closed` is made so first. `threshold`: the concavity that a part may keep,
    as a share of the mesh's size. `name` is for messages. Raises RuntimeError if coacd fails,
    and TimeoutError or Cancelled if it reaches the limit.
    """
    settings = {
        **SEARCH,
        "threshold": threshold,
        "seed": seed,
        "preprocess_mode": "off" if closed else "on",
    }
    kept = cache.key(
        np.ascontiguousarray(vertices, float).tobytes(),
        np.ascontiguousarray(faces, np.int64).tobytes(),
        json.dumps([settings, max_points, version("coacd")]).encode(),
    )
    parts = cache.load(kept)
    if parts is None:
        log.info("taking %s apart into convex parts", name)
        raw = _run(vertices, faces, settings, name, limit)
        least = NOTHING * hull_volume(vertices)
        parts = [corners(points, max_points) for points in raw if hull_volume(points) > least]
        if not parts:
            raise RuntimeError(f"coacd found no part in {name}; decompose=False takes its hull")
        cache.store(kept, parts)
    return parts


def _run(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    settings: dict[str, Any],
    name: str,
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
                stdout=messages,
                stderr=messages,
            ) as process,
        ):
            try:
                _wait(process, name, limit)
            except BaseException:
                process.kill()
                process.wait()
                raise
        if process.returncode != 0:
            said = (folder / "messages").read_text(errors="replace").strip().splitlines()
            why = said[-1] if said else f"it ended with {process.returncode}"
            raise RuntimeError(f"coacd fails on {name}: {why}; decompose=False takes its hull")
        with np.load(folder / "parts.npz") as parts:
            return [np.asarray(parts[f"arr_{i}"], float) for i in range(len(parts.files))]


def _wait(process: subprocess.Popen[bytes], name: str, limit: Limit) -> None:
    """Until the process ends; says so if that takes long."""
    start = time.monotonic()
    told = False
    while process.poll() is None:
        time.sleep(POLL)
        limit.require(f"{name} was taken apart")
        if not told and time.monotonic() - start > PATIENCE:
            log.warning(
                "%s is still being taken apart into convex parts, once: they are kept in %s. A "
                "greater threshold is faster, and decompose=False takes the hull at once",
                name,
                cache.cache_folder(),
            )
            told = True
