"""Robots that react: a ball that their feedback or policy holds, in space or on a rail."""

import numpy as np

import energymargin as em

AXES = ("x", "y", "z")
SEEN = [*(f"ball.{a}" for a in AXES), *(f"ball.v{a}" for a in AXES)]
PUSHED = [f"ball.f{a}" for a in AXES]
STIFFNESS, DAMPING = 50.0, 2.0
GAINS = np.hstack([STIFFNESS * np.eye(3), DAMPING * np.eye(3)])


def problem(plan=None, spring=False, **options):
    """A ball that is held by nothing but its plan, or by a spring."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("ball", em.Sphere(0.05), mass=1.0, role="object")
    if spring:
        scene.add_body("wall", em.Sphere(0.01), mass=0.0, position=(0, 0, 5))
    captured = em.regions.Ball("ball", (0, 0, 0), 0.1)
    bounds = {"force": (5, 5, 5), "torque": (0.1, 0.1, 0.1), "duration": 0.1}
    return em.Problem(scene, scene.pack(), captured=captured, plan=plan,
                      **{"horizon": 1.0, **bounds, **options})  # fmt: skip


def feedback(period=1 / 240, **options):
    return em.Feedback(GAINS, observed=SEEN, corrected=PUSHED, period=period, **options)


def policy(act=None, period=1 / 20, observe=SEEN, **options):
    act = act or (lambda seen, memory, time: -seen @ GAINS.T)
    return em.Policy(act, period=period, observe=observe, command=PUSHED, **options)


def asked(plan, rollouts=60, **options):
    return em.capture_probability(problem(plan), rollouts=rollouts, seed=1, **options)


def on_a_rail(plan=None, spring=False, **options):
    """A ball that moves along x alone."""
    scene = em.Scene(gravity=(0, 0, 0))
    axis = {"linear_factor": (1, 0, 0), "angular_factor": (0, 0, 0)}
    scene.add_body("ball", em.Sphere(0.05), mass=1.0, role="object", **axis)
    scene.add_body("wall", em.Sphere(0.01), mass=0.0, position=(0, 0, 5))
    if spring:
        ends = {"point_a": (0, 0, -5), "stiffness": STIFFNESS, "damping": DAMPING}
        scene.add_spring("wall", "ball", **ends)
    bounds = {"force": (5, 0, 0), "torque": (0, 0, 0), "duration": 0.1, "horizon": 1.0, **options}
    captured = em.regions.Ball("ball", (0, 0, 0), 0.1)
    return em.Problem(scene, scene.pack(), captured=captured, plan=plan, **bounds)


def along_x(period=1 / 240, stiffness=STIFFNESS):
    return em.Feedback(
        [[stiffness, DAMPING]],
        observed=["ball.x", "ball.vx"],
        corrected=["ball.fx"],
        period=period,
    )
