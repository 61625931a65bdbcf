"""Problems with a horizon whose answers are known."""

import numpy as np

import energymargin as em

STEP = 1 / 240


def carried(horizon=0.6, **keywords):
    """A box in space that its effector pushes along x, out of its set after 0.35 s.

    The captured ball has a radius of 5 cm; the pusher moves at 0.2 m/s, and touches the box after
    0.1 s.
    """
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body("box", em.Box((0.1,) * 3), mass=0.2, role="object")
    scene.add_body(
        "pusher", em.Box((0.1,) * 3), mass=5.0, position=(-0.12, 0.0, 0.0), role="effector"
    )
    state = scene.pack(pusher={"velocity": (0.2, 0.0, 0.0)})
    plan = em.Plan.hold(scene, state, horizon)
    return em.Problem(
        scene,
        state,
        force=(0.05, 0.05, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.2,
        captured=em.regions.Ball("box", (0.0, 0.0, 0.0), 0.05),
        **{"horizon": horizon, "plan": plan, **keywords},
    )


def resting(horizon=0.4, force=1.3, **keywords):
    """A box on a floor that nothing holds: it stays unless it is pushed."""
    scene = em.Scene()
    scene.add_plane("floor", friction=0.5)
    scene.add_body(
        "box", em.Box((0.1,) * 3), mass=0.2, position=(0, 0, 0.05), friction=1.0, role="object"
    )
    return em.Problem(
        scene,
        scene.pack(),
        force=(force, force, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.2,
        captured=em.regions.Ball("box", (0.0, 0.0, 0.05), 0.01),
        succeeded=em.regions.Ball("box", (0.0, 0.0, 0.05), 0.02),
        horizon=horizon,
        **keywords,
    )


def two_balls(horizon=0.3):
    """Two balls in space, each with a capture set of its own."""
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    places = {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0)}
    for name, place in places.items():
        scene.add_body(name, em.Sphere(0.05), mass=1.0, position=place, role="object")
    return em.Problem(
        scene,
        scene.pack(),
        force=(10.0, 0.0, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.2,
        captured={name: em.regions.Ball(name, place, 0.1) for name, place in places.items()},
        horizon=horizon,
    )


def waving(horizon=0.5):
    """As `carried`, but the pusher goes back and forth by wrenches."""
    rows = np.zeros((round(horizon / STEP), 6))
    rows[:, 0] = 3.0 * np.sin(np.arange(len(rows)) / 15)
    return carried(horizon, plan=em.Plan(STEP, wrenches={"pusher": rows}))


def falling():
    """A ball in free fall that 15 N hold on to for most of a search; without a horizon."""
    scene = em.Scene()
    scene.add_body("ball", em.Sphere(0.05), mass=1.0, role="object")
    return em.Problem(
        scene,
        scene.pack(),
        force=(15.0,) * 3,
        torque=(0.0, 0.0, 0.0),
        duration=0.5,
        captured=em.regions.Ball("ball", (0.0, 0.0, 0.0), 0.5),
    )
