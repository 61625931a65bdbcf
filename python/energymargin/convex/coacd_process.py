"""A process of its own that takes one mesh apart, so that Ctrl-C can end it at any time.

Run by path with a folder, it reads `mesh.npz` there and writes `parts.npz`. It does not import the
package, which would take it longer than most meshes do.
"""

import json
import sys
from pathlib import Path


def main(folder: Path) -> None:
    """Reads vertices, faces and the settings of coacd, and writes the parts' points."""
    sys.path.pop(0)  # this file's folder holds no modules
    import coacd
    import numpy as np

    coacd.set_log_level("off")
    with np.load(folder / "mesh.npz") as mesh:
        solid = coacd.Mesh(mesh["vertices"], mesh["faces"])
        settings = json.loads(str(mesh["settings"]))
    parts = coacd.run_coacd(solid, **settings)
    np.savez(folder / "parts.npz", *[points for points, _ in parts])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
