"""Policies against known answers: white noise on a grid, a spring, a delay that swings a loop up.

A ball of 1 kg on a rail, or in space, that a law pulls back with a force -k x - d v.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import map_coordinates, spline_filter

import energymargin as em

STEP, HALF = 1 / 240, 0.1  # s; m, until where the ball is held
LAW = (50.0, 2.0)  # N/m, N s/m
AXES = "xyz"


def law(axes: str, stiffness: float, damping: float, delay: int = 0) -> em.Feedback:
    eye = np.eye(len(axes))
    return em.Feedback(
        np.hstack([stiffness * eye, damping * eye]),
        observed=[*(f"ball.{a}" for a in axes), *(f"ball.v{a}" for a in axes)],
        corrected=[f"ball.f{a}" for a in axes],
        period=STEP,
        delay=delay,
    )


def ball(
    axes: str, plan: Any = None, spring: tuple[float, float] | None = None, **options: Any
) -> em.Problem:
    """A ball without weight, free along some axes, that a plan or a spring holds."""
    free = [float(axis in axes) for axis in AXES]
    scene = em.Scene(gravity=(0, 0, 0), step=STEP)
    stiffness, damping = spring or (0.0, 0.0)
    aside = damping if len(axes) > 1 else 0.0  # a spring's own damping acts along it alone
    locks = {"linear_factor": free, "angular_factor": (0, 0, 0), "linear_damping": aside}
    scene.add_body("ball", em.Sphere(0.05), mass=1.0, role="object", **locks)
    scene.add_body("wall", em.Sphere(0.01), mass=0.0, position=(0, 0, 5))
    if spring:
        own = {"stiffness": stiffness, "damping": damping - aside}
        scene.add_spring("wall", "ball", point_a=(0, 0, -5), **own)
    return em.Problem(
        scene,
        scene.pack(),
        captured=em.regions.Ball("ball", (0, 0, 0), HALF),
        plan=plan,
        force=5.0 * np.array(free),
        torque=(0, 0, 0),
        duration=0.1,
        **{"horizon": 1.0, **options},
    )


def on_grid(stiffness: float, damping: float, noise: float, steps: int) -> float:
    """Backward recursion of the probability of staying, over position and velocity."""
    size, fastest = 241, 4.0
    middle, sides = (size - 1) // 2, np.linspace(-1.0, 1.0, size)
    x, v = np.meshgrid(HALF * sides, fastest * sides)
    nodes, weights = np.polynomial.hermite_e.hermegauss(9)
    later = np.ones_like(x)
    for _ in range(steps):
        now, later = np.zeros_like(x), spline_filter(later)
        for node, weight in zip(nodes, weights / weights.sum(), strict=True):
            faster = v + STEP * (noise * node - stiffness * x - damping * v)
            farther = x + STEP * faster
            at = [(faster / fastest + 1) * middle, (farther / HALF + 1) * middle]
            stays = map_coordinates(later, at, mode="nearest", prefilter=False)
            now += weight * np.where(np.abs(farther) <= HALF, stays, 0.0)
        later = now
    return float(later[middle, middle])


@pytest.mark.parametrize(("stiffness", "damping", "noise"), [(50, 2, 40), (50, 8, 60), (10, 4, 30)])
def test_a_probability_under_white_noise_is_that_of_the_backward_recursion(
    stiffness: float, damping: float, noise: float
) -> None:
    asked = ball("x", law("x", stiffness, damping), horizon=120 * STEP, check=STEP)
    white = em.disturbances.Gaussian(force=noise, torque=0.0, correlation_time=1e-9)
    found = em.capture_probability(asked, disturbance=white, rollouts=9000)
    low, high = found.interval(0.999)
    assert low < on_grid(stiffness, damping, noise, 120) < high


@pytest.mark.parametrize("axes", ["x", AXES])
def test_a_virtual_spring_costs_and_holds_what_a_spring_does(axes: str) -> None:
    virtual = law("x", *LAW)
    if axes == AXES:
        six = [[value] * 3 + [0.0] * 3 for value in LAW]
        virtual = em.Feedback.impedance("ball", stiffness=six[0], damping=six[1], period=STEP)
    both = ball(axes, virtual), ball(axes, spring=LAW)
    efforts = [
        np.median([em.escape_effort(p, nodes=1000, seed=seed).effort for seed in range(8)])
        for p in both
    ]
    assert efforts[0] == pytest.approx(efforts[1], rel=0.02)
    one, other = (em.capture_probability(p, rollouts=900) for p in both)
    low, high = one.interval()
    assert low <= other.captured <= high


@pytest.mark.parametrize(("stiffness", "damping"), [(50.0, 2.0), (50.0, 8.0), (200.0, 10.0)])
def test_the_delay_that_swings_the_loop_up_is_that_of_its_eigenvalues_near_the_margin(
    stiffness: float, damping: float
) -> None:
    known = next(n for n in itertools.count() if growth(stiffness, damping, n) > 1.0)
    found = next(n for n in itertools.count(max(known - 5, 0)) if swings(stiffness, damping, n))
    assert found == known
    # Phase margin over crossover of (d s + k) / s^2; a held command is half a step late, too.
    crossover = np.sqrt((damping**2 + np.sqrt(damping**4 + 4 * stiffness**2)) / 2)
    margin = np.arctan2(damping * crossover, stiffness) / crossover - STEP / 2
    assert known * STEP == pytest.approx(margin, abs=2 * STEP)
    held = [
        em.capture_probability(
            ball("x", law("x", stiffness, damping, delay), horizon=2.0), rollouts=100
        ).captured
        for delay in (0, round(1.5 * margin / STEP))
    ]
    assert held[0] > held[1]


def growth(stiffness: float, damping: float, delay: int) -> float:
    """Largest absolute eigenvalue of a step of the loop, with the forces under way in its state."""
    eye, step, asked = np.eye(delay + 3), np.zeros((delay + 3, delay + 3)), np.zeros(delay + 3)
    asked[:2] = -stiffness, -damping
    queue = eye[2:]  # from the force that acts to the one that was just asked for
    faster = eye[1] + STEP * (asked if delay == 0 else queue[0])
    step[0], step[1] = eye[0] + STEP * faster, faster
    if delay:
        step[2 : delay + 1], step[delay + 1] = queue[1:delay], asked
    return float(np.abs(np.linalg.eigvals(step)).max())


def swings(stiffness: float, damping: float, delay: int) -> bool:
    """Whether an undisturbed ball a millimetre off its place swings wider and wider."""
    asked = ball("x", law("x", stiffness, damping, delay))
    start = asked.scene.pack(ball={"position": (1e-3, 0.0, 0.0)})
    states = np.asarray(em.World(asked.scene, asked.plan).simulate(start, round(60 / STEP)).states)
    far = np.abs(states[:, 0])
    return bool(far[-len(far) // 6 :].max() > far[: len(far) // 6].max())
