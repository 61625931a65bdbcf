"""A process of its own that decomposes one mesh, so that Ctrl-C can end it at any time.

Run by path with a folder, it reads `mesh.npz` there and writes `parts.npz`. It does not import
the package, which would take it longer than most meshes do.
"""

import json
import os
import shutil
import sys
import threading
from pathlib import Path

STDIN = 0


def main(folder: Path) -> None:
    """Reads vertices, faces and the settings of coacd, and writes the parts' points."""
    threading.Thread(target=end_with_parent, args=(folder,), daemon=True).start()
    sys.path.pop(0)  # this file's folder holds no modules
    import coacd
    import numpy as np

    coacd.set_log_level("error")
    with np.load(folder / "mesh.npz") as mesh:
        solid = coacd.Mesh(mesh["vertices"], mesh["faces"])
        settings = json.loads(str(mesh["settings"]))
    parts = coacd.run_coacd(solid, **settings)
    np.savez(folder / "parts.npz", *[points for points, _ in parts])


def end_with_parent(folder: Path) -> None:
    """Ends the process, and removes the folder, once the parent has closed its end of stdin.

    The system does that for a parent that is killed, and coacd leaves this thread running.
    """
    while os.read(STDIN, 1):  # not sys.stdin, whose lock would hold up the end of the interpreter
        pass
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(1)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
