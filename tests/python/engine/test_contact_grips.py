"""Grips hold below the limit of friction and slip above it, whatever the fingers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from grippers import held_at_a_slant

import energymargin as em
from energymargin_paper.evidence.contact_checks import CHECKS
from energymargin_paper.evidence.contact_grips import (
    KINDS,
    PADS,
    Grip,
    hold,
    pair_of_fingers,
    pinch,
    star_of_fingers,
)
from energymargin_paper.evidence.contact_problems import lifted, refined_grip
from energymargin_paper.evidence.contact_statics import Pad, largest_weight

SEEDS = 60
SINK, CREEP = 0.2, 0.05  # mm and mm/s: nobody sees it
FALL = 20.0  # mm: the height of a pad


def failing(name: str, seeds: int) -> dict[int, tuple[float, ...]]:
    """What does not hold of a check of the study `contact`, by seed."""
    check = CHECKS[name]
    found = {seed: check.measure(seed) for seed in range(seeds)}
    return {seed: values for seed, values in found.items() if not check.holds(values)}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pad", PADS)
def test_grip_of_two_fingers_holds_just_below_the_limit_and_slips_just_above(
    kind: str, pad: str
) -> None:
    grip = Grip(pair_of_fingers(), kind=kind, pad=pad)
    below = [hold(replace(grip, share=share)) for share in (0.5, 0.8, 0.9, 0.965)]
    assert max(held.sink for held in below) < SINK
    assert max(held.creep for held in below) < CREEP
    assert hold(replace(grip, share=1.035)).sink > FALL


def test_three_fingers_around_a_prism_hold_just_below_the_limit_and_slip_just_above() -> None:
    grip = Grip(star_of_fingers(), share=0.965)
    assert hold(grip).sink < SINK
    assert hold(grip).creep < CREEP
    assert hold(replace(grip, share=1.035)).sink > FALL


def test_random_grips_below_the_limit_neither_sink_nor_creep() -> None:
    assert failing("grip below its limit", SEEDS) == {}


def test_random_grips_above_the_limit_fall() -> None:
    assert failing("grip above its limit", SEEDS) == {}


def test_random_grips_off_their_centre_hold_where_any_even_pressure_holds() -> None:
    assert failing("off-centre grip below its limits", 20) == {}


def test_random_grips_off_their_centre_slip_where_no_pressure_holds() -> None:
    assert failing("off-centre grip above its limits", 20) == {}


@pytest.mark.parametrize("slant", [30, 40, 45])
def test_a_light_body_between_slanted_points_neither_turns_nor_slips(slant: float) -> None:
    """Its weight is a hundredth of what presses it: what gives way there is no slip."""
    scene = held_at_a_slant(slant)
    world, body = em.World(scene), scene.slice("object")
    start = world.simulate(scene.pack(), 120).states[-1]
    random = np.random.default_rng(0)
    for _ in range(6):
        load, lever = (each / np.linalg.norm(each) for each in random.normal(size=(2, 3)))
        push = {"object": np.tile([*(0.4 * load), *(0.01 * lever)], (120, 1))}
        moving = world.simulate(start, 120, drives=push, record=[24, 120]).states
        before, after = moving[-2][body], moving[-1][body]
        turned = 2 * np.arccos(min(1.0, abs(before[3:7] @ after[3:7])))
        assert np.linalg.norm(after[:3] - before[:3]) < 0.1e-3  # m, in 0.4 s
        assert np.degrees(turned) < 0.5


def test_friction_that_a_load_uses_is_not_there_for_another_across() -> None:
    assert failing("preloaded grip", 6) == {}


def test_statics_of_a_grip_with_its_mass_aside_agree_with_a_lever() -> None:
    """Far aside the weight turns the object, which friction at the corners resists at its arm."""
    corners = [np.array((0.0, y, z)) for y in (-0.01, 0.01) for z in (-0.01, 0.01)]
    along = np.array((0.02, 0.0, 0.0))
    pads = [
        Pad([corner - side * along for corner in corners], side * along / 0.02, 10.0)
        for side in (1.0, -1.0)
    ]
    assert largest_weight(pads, np.zeros(3), 0.5) == pytest.approx(10.0, rel=2e-3)
    far = largest_weight(pads, np.array((0.0, 10.0, 0.0)), 0.5, even=True)
    assert far == pytest.approx(0.5 * 20.0 * 0.01 * 2**0.5 / 10.0, rel=5e-3)


@pytest.mark.parametrize("lifts", [True, False])
def test_cube_that_friction_holds_twice_over_is_never_lost(lifts: bool) -> None:
    assert lifted(lifts=lifts) == 1.0


def test_probability_of_a_grip_does_not_depend_on_the_step() -> None:
    found = [refined_grip(seed) for seed in range(4)]
    assert max(abs(probability.default - probability.eighth) for probability in found) <= 0.02


@pytest.mark.parametrize("force", [5.0, 20.0, 80.0])
@pytest.mark.parametrize("step", [1 / 240, 1 / 480])
def test_fingertips_stay_where_they_touch_a_cube_that_swings_between_them(
    force: float, step: float
) -> None:
    assert pinch(force, step=step) < 0.05
