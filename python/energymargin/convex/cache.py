"""What took long to compute, kept on disk by what it was computed from."""

from __future__ import annotations

import hashlib
import logging
import os
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin.replacing import replaced

__all__ = ["cache_folder", "key", "load", "store"]

log = logging.getLogger("energymargin")


def cache_folder() -> Path:
    """ENERGYMARGIN_CACHE, or else `energymargin` in the user's cache folder."""
    if own := os.environ.get("ENERGYMARGIN_CACHE"):
        return Path(own)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "energymargin"


def key(*contents: bytes) -> str:
    """A name for what follows from the contents."""
    digest = hashlib.sha256()
    for content in contents:
        digest.update(len(content).to_bytes(8, "little"))
        digest.update(content)
    return digest.hexdigest()


def load(name: str) -> list[NDArray[np.float64]] | None:
    """The point sets of a name, each (k, 3); None if there are none, or the file is damaged."""
    try:
        with np.load(_file(name), allow_pickle=False) as kept:
            found = [np.asarray(kept[f"arr_{i}"], float) for i in range(len(kept.files))]
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile):
        return None
    whole = all(p.ndim == 2 and p.shape[1] == 3 and np.isfinite(p).all() for p in found)
    return found if found and whole else None


def store(name: str, points: Sequence[NDArray[np.float64]]) -> None:
    """Keeps point sets; a folder that cannot be written to is no error, only slow next time."""
    file = _file(name)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with replaced(file) as new, new.open("wb") as stream:
            np.savez(stream, *points)
    except OSError as error:
        log.warning("convex parts are not kept for next time: %s", error)


def _file(name: str) -> Path:
    return cache_folder() / "convex" / f"{name}.npz"
