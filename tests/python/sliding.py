"""A box that slides without friction between two edges: its answers are known on paper."""

import numpy as np

import energymargin as em

EDGE = 1.0  # m from the middle to either edge
MASS = 2.0  # kg
HORIZON = 1.0  # s


def problem(x=0.0, speed=0.0, **changes):
    """The box at x with a speed along x; captured while it is within the edges, and in the success
    set to the right of the middle."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body(
        "object", em.Box((0.1,) * 3), mass=MASS, position=(x, 0, 0), friction=0, role="object"
    )
    state = scene.pack(object={"velocity": (speed, 0, 0)})
    edges = em.regions.Box("object", center=(0, 0, 0), size=(2 * EDGE, np.inf, np.inf))
    question = {
        **{"force": (10, 0, 0), "torque": (0, 0, 0), "duration": 0.5, "captured": edges},
        "succeeded": em.regions.HalfSpace("object", (-1, 0, 0), 0.0),
        **{"horizon": HORIZON, "start_outside": True},
    }
    return em.Problem(scene, state, **question | changes)


def still(values):
    """A box at rest at values["x"]."""
    return problem(values["x"])


def diverging(count):
    """A disturbance of random pushes, whose first `count` rollouts diverge: on one thread."""
    left = count

    def pushes(random, times):
        nonlocal left
        wrenches = np.zeros((len(times), 6))
        wrenches[:, 0] = random.normal(scale=6.0)
        if left > 0:
            wrenches[:] = 1e308
            left -= 1
        return wrenches

    return pushes
