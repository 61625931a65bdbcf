"""The pictures that move at the top of the README, docs/push.gif and docs/grip.gif.

`python tools/moving.py`: a push that fails, along its cheapest escape, and the README's bar, lifted
by its end. It needs the extra [screenshot] and a Chromium.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import energymargin as em

DOCS = Path(__file__).parent.parent / "docs"
SIZE = (440, 400)  # pixels


def main() -> None:
    """Draws both."""
    em.viewer.view("push").draw(DOCS / "push.gif", SIZE)
    hand = em.grasps.ParallelGripper(opening=0.08, pad=(0.02, 0.02), force=6)
    bar = em.grasps.GraspObject(em.Box((0.04, 0.18, 0.03)), mass=0.4, friction=0.7)
    poses = np.array([np.diag([1.0, -1.0, -1.0, 1.0])])
    poses[0, 1:3, 3] = 0.06, 0.01
    end = em.grasps.score(em.grasps.GraspSet(poses, names=("end",)), hand, bar, "lift", rollouts=1)
    em.viewer.view(end).draw(DOCS / "grip.gif", SIZE)


if __name__ == "__main__":
    main()
