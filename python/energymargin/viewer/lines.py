"""Many thin lines as a glTF file.

The browser draws them as the graphics card's own lines: viser's, which have a width, are each made
of triangles, and ten times slower.
"""

from __future__ import annotations

import json
import struct

import numpy as np
from numpy.typing import NDArray

__all__ = ["lines_glb"]

LINES = 1  # glTF's mode of a primitive
FLOAT, UNSIGNED_BYTE = 5126, 5121


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
