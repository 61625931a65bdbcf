"""What of a large tree is drawn, and its edges as a glTF file.

Nodes and edges that fall on the same spot are drawn once: a million dots on a thousand spots look
like a thousand dots, and are a thousand times slower. The browser draws glTF lines as the graphics
card's own; viser's, which have a width, are each made of triangles, and ten times slower.
"""

from __future__ import annotations

import json
import struct

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOST_EDGES", "MOST_POINTS", "lines_glb", "shown_edges", "shown_points"]

LINES = 1  # glTF's mode of a primitive
FLOAT, UNSIGNED_BYTE = 5126, 5121

MOST_POINTS, MOST_EDGES = 20_000, 8_000  # what a browser without a graphics card still moves
SPOTS = (500, 350, 250, 175, 125)  # along the view's longest side; the coarsest is a dot's size


def lines_glb(segments: NDArray[np.float64], colors: NDArray[np.uint8]) -> bytes:
    """A binary glTF 2.0 file of line segments.

    segments: both ends of each, shape (N, 2, 3) [m], N > 0; colors: sRGB of each, shape (N, 3).
    """
    points = segments.reshape(-1, 3).astype("<f4")
    rgba = np.full((len(points), 4), 255, dtype=np.uint8)
    rgba[:, :3] = np.repeat(_linear(colors), 2, axis=0)
    binary = points.tobytes() + rgba.tobytes()
    accessor = {"count": len(points), "byteOffset": 0}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": LINES}]}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": rgba.nbytes},
        ],
        "accessors": [
            {
                **accessor,
                "bufferView": 0,
                "componentType": FLOAT,
                "type": "VEC3",
                "min": points.min(axis=0).tolist(),
                "max": points.max(axis=0).tolist(),
            },
            {
                **accessor,
                "bufferView": 1,
                "componentType": UNSIGNED_BYTE,
                "normalized": True,
                "type": "VEC4",
            },
        ],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _linear(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """glTF's colours of points are proportional to light, those of a screen are not (sRGB)."""
    share = colors / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.round(255.0 * light), dtype=np.uint8)


def shown_points(
    points: NDArray[np.float64], kinds: NDArray[np.bool_], order: NDArray[np.float64], size: float
) -> NDArray[np.int64]:
    """Rows of points, shape (N, 3), that are drawn: of those of one kind, shape (N,), on a spot the
    one that comes first in `order`, shape (N,); and at most MOST_POINTS. size: of the view [m]."""
    return _one_a_spot(points, kinds, order, size, MOST_POINTS)


def shown_edges(
    edges: NDArray[np.float64], kinds: NDArray[np.bool_], order: NDArray[np.float64], size: float
) -> NDArray[np.int64]:
    """As `shown_points`, of edges from spot to spot, shape (N, 2, 3); at most MOST_EDGES."""
    return _one_a_spot(edges.reshape(-1, 6), kinds, order, size, MOST_EDGES)


def _one_a_spot(
    values: NDArray[np.float64],
    kinds: NDArray[np.bool_],
    order: NDArray[np.float64],
    size: float,
    most: int,
) -> NDArray[np.int64]:
    first = np.argsort(order, kind="stable")
    if len(values) <= most:
        return first
    shown = first
    for spots in SPOTS:
        places = np.round(values[first] * (spots / size)).astype(np.int64)
        keys = np.column_stack([places, kinds[first]])
        shown = first[np.sort(np.unique(keys, axis=0, return_index=True)[1])]
        if len(shown) <= most:
            return shown
    return shown[:most]
