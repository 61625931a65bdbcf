"""Loops of what turns fast keep the energy, or say that they cannot."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import energymargin as em

ARM = 0.05


def tied(spin: float, kind: str, seed: int = 0, ratio: float = 1.0) -> em.Scene:
    """Two boxes that a loop ties in the middle between them, without gravity."""
    random = np.random.default_rng(seed)
    spins = spin * random.normal(size=(2, 3)) / np.sqrt(3)
    if kind == "weld":
        spins[1] = spins[0]
    scene = em.Scene(gravity=(0, 0, 0))
    for name, at, own in (("a", (-ARM, 0, 0), spins[0]), ("b", (ARM, 0, 0), spins[1])):
        size = (0.06, 0.05, 0.04) if name == "a" else (0.05, 0.06, 0.03)
        scene.add_body(
            name,
            em.Box(size),
            mass=0.05 if name == "a" else 0.05 * ratio,
            position=at,
            velocity=np.cross(own, at),
            angular_velocity=own,
            role="object" if name == "a" else "none",
        )
    scene.add_loop("a", "b", type=kind, point_a=(ARM, 0, 0), point_b=(-ARM, 0, 0))
    scene.disable_collisions("a", "b")
    return scene


def on_a_ball_joint(spin: float, mass: float = 0.2) -> em.Scene:
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("post", em.Box((0.01,) * 3), mass=0)
    own = spin * np.array([0.3, 0.1, 1]) / np.linalg.norm([0.3, 0.1, 1])
    at = (0, 0, ARM)
    moving = {"velocity": np.cross(own, at), "angular_velocity": own, "role": "object"}
    scene.add_body("b", em.Box((0.04, 0.06, 0.02)), mass=mass, position=at, **moving)
    scene.add_loop("post", "b", point_b=(0, 0, -ARM))
    scene.disable_collisions("post", "b")
    return scene


def energies(scene: em.Scene, seconds: float) -> tuple[np.ndarray, int]:
    """The energy as a share of that of the start, every 12 steps; and unconverged steps."""
    world = em.World(scene)
    steps = round(seconds / scene.step)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", em.PlausibilityWarning)
        run = world.simulate(scene.pack(), steps, record=range(0, steps + 1, 12))
    energy = np.array([world.energy(state) for state in run.states])
    return energy / energy[0], run.unconverged


@pytest.mark.parametrize("spin", [20.0, 80.0, 200.0])
@pytest.mark.parametrize("kind", ["point", "weld"])
@pytest.mark.parametrize("ratio", [1.0, 20.0])
def test_two_tied_bodies_keep_their_energy(spin: float, kind: str, ratio: float) -> None:
    for seed in range(2):
        energy, unconverged = energies(tied(spin, kind, seed, ratio), seconds=2)
        assert energy.max() < 1.002
        assert energy[-1] > 0.97
        assert unconverged == 0


@pytest.mark.parametrize("spin", [20.0, 100.0, 160.0, 200.0])
def test_a_body_on_a_ball_joint_keeps_its_energy(spin: float) -> None:
    energy, unconverged = energies(on_a_ball_joint(spin), seconds=2)
    assert np.abs(energy - 1).max() < 1e-3
    assert unconverged == 0


def test_what_turns_too_fast_for_substeps_counts_as_unconverged() -> None:
    _, unconverged = energies(on_a_ball_joint(2000.0), seconds=0.1)
    assert unconverged == 24


def test_a_start_that_turns_by_radians_in_a_step_warns() -> None:
    scene = on_a_ball_joint(100.0, mass=0.3)  # one that has not warned yet
    with pytest.warns(em.PlausibilityWarning, match=r"turn of body 'b', which is in a loop.*0\.41"):
        em.World(scene).simulate(scene.pack(), 1)
