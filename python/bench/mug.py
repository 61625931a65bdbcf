"""States of a hand of hulls that holds a mug, from others' grasps (`ENERGYMARGIN_GRASPS`)."""

from __future__ import annotations

import numpy as np

import energymargin as em
from energymargin_paper.evidence import contact_mug

__all__ = ["mugs"]

FRICTION = 0.6
ROOM = 0.05  # m: the mug is captured within, of where it is held
LEVER = 0.02  # m, of the torque's bound


def mugs(count: int) -> list[em.Problem]:
    """At most so many states that both engines hold; none without the folder."""
    grasps, made = contact_mug.given(), list[em.Problem]()
    if grasps is None:
        return made
    for number in grasps.chosen(100, seed=0):
        if len(made) == count:
            break
        try:
            grasp = grasps.grasp(number, FRICTION, target=contact_mug.SPEED * contact_mug.CLOSING)
        except ValueError:  # the hand is in the mug
            continue
        if contact_mug.here(grasp).held and contact_mug.there(grasp).held:
            made.append(_gripped(grasp))
    return made


def _gripped(grasp: contact_mug.Grasp) -> em.Problem:
    """The state in which our hand has closed."""
    scene, targets = grasp.scene, grasp.plan.targets["left"]
    world = em.World(scene)
    closed = world.simulate(scene.pack(), len(targets), targets={"left": targets}).states[-1]
    place = closed[scene.slice("object")][:3]
    return em.Problem(
        scene,
        closed,
        force=np.full(3, grasp.load),
        torque=np.full(3, LEVER * grasp.load),
        duration=0.25,
        captured=em.regions.Ball("object", place, ROOM),
    )
