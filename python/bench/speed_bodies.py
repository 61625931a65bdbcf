"""Part `bodies`: how a step grows with the number of bodies, beside Bullet's own world.

Boxes lie on a plane in clumps, three side by side and two on top of them: most pairs of bodies are
far apart, as in a field, and each body touches some, as in a tower.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from math import ceil, sqrt
from statistics import median

import energymargin as em
from measurements import Pairs, Settings, Tell, rollouts
from tables import markdown

__all__ = ["Bodies", "clumps", "measure_bodies"]

EDGE = 0.1  # m, of a box
MASS = 1.0  # kg
CLUMP = ((-1.0, 0), (0.0, 0), (1.0, 0), (-0.5, 1), (0.5, 1))  # edges along x, and layers
APART = 0.6  # m, from the middle of a clump to that of the next


@dataclass
class Bodies:
    """What there is so far."""

    settings: Settings
    runs: dict[int, Pairs] = field(default_factory=dict)
    """Against Bullet alone, by the number of bodies."""

    def tables(self) -> str:
        """In Markdown."""
        rows = [
            [
                f"{count:,}",
                f"{1e6 * median(pairs.ours) / pairs.steps:.1f}",
                f"{1e6 * median(pairs.others) / pairs.others_steps:.1f}",
                f"{pairs.ratio():.3f}",
                f"{1e6 * median(pairs.ours) / pairs.steps / count:.2f}",
            ]
            for count, pairs in self.runs.items()
        ]
        text = (
            "Boxes that lie on a plane in clumps of five, a rollout of"
            f" {self.settings.steps} steps without a wrench; CPU time.\n\n"
        )
        headers = ["bodies", "a step [us]", "Bullet [us]", "ours / Bullet", "a body [us]"]
        return text + markdown(headers, rows) if rows else ""


def measure_bodies(bodies: Bodies, tell: Tell) -> None:
    """Fills it scene by scene."""
    settings = bodies.settings
    for count in settings.bodies:
        tell(f"{count:,} bodies")
        (run,) = rollouts(clumps(count), "--rounds", settings.rounds, "--steps", settings.steps)
        bodies.runs[count] = Pairs(**run)


def clumps(count: int) -> em.Problem:
    """So many boxes at rest, in clumps on a square grid."""
    scene = em.Scene()
    scene.add_plane("ground")
    side = ceil(sqrt(ceil(count / len(CLUMP))))
    places = product(range(side), range(side), CLUMP)
    for number, (x, y, (along, layer)) in zip(range(count), places, strict=False):
        scene.add_body(
            f"box_{number}",
            em.Box((EDGE,) * 3),
            mass=MASS,
            position=(APART * x + EDGE * along, APART * y, EDGE * (layer + 0.5)),
            role="none" if number else "object",
        )
    return em.Problem(
        scene,
        scene.pack(),
        force=(1.0, 1.0, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=1.0,
        captured=em.regions.Speed("box_0", 1.0),
    )
