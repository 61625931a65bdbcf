"""Whether scores stay what they are with others' Bullet and OMPL in the process.

They are loaded in the order of the arguments: bullet (Debian's, of single precision, for all to
see), ompl, pybullet, energymargin.
"""

import ctypes
import importlib
import json
import os
import sys
from pathlib import Path

GOLDEN = Path(__file__).parents[1] / "golden"


def load(name: str) -> None:
    """Loads one of them, and lets it work where that is easy."""
    if name == "bullet":
        for part in ("LinearMath", "BulletCollision", "BulletDynamics"):
            ctypes.CDLL(f"lib{part}.so.3.24", mode=os.RTLD_GLOBAL | os.RTLD_NOW)
    elif name == "ompl":
        importlib.import_module("ompl.base")
    else:
        importlib.import_module(name)


def main() -> None:
    """The scores of one problem, beside all of them."""
    for name in sys.argv[1:]:
        load(name)
    import pybullet
    from ompl import base

    client = pybullet.connect(pybullet.DIRECT)
    pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[1, 1, 1])
    pybullet.stepSimulation()
    space = base.RealVectorStateSpace(2)

    sys.path.insert(0, str(GOLDEN))
    import make

    import energymargin as em

    file = GOLDEN / "problem-push.json"
    golden = json.loads((GOLDEN / "values.json").read_text())["values"][file.stem]
    found = make.values(file.stem, em.Problem.load(file))
    pybullet.stepSimulation()
    pybullet.disconnect(client)
    if found != golden:
        sys.exit(f"beside {sys.argv[1:]}: {found}, expected {golden}")
    print(
        f"loaded as {', '.join(sys.argv[1:])}: golden values, "
        f"and a space of {space.getDimension()} dimensions"
    )


if __name__ == "__main__":
    main()
