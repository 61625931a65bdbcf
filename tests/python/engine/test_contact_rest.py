"""What statics let stand stands, and what they do not falls."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from energymargin_paper.evidence.contact_rest import (
    Structure,
    arch,
    card_house,
    heavy_on_light,
    stands,
    tower,
)
from energymargin_paper.evidence.contact_statics import Mass, Touch, required_friction

STRUCTURES = pytest.mark.parametrize("make", [arch, card_house])


@pytest.mark.parametrize("cubes", [5, 10, 15])
@pytest.mark.parametrize("seed", [0, 1])
def test_tower_settles_within_half_a_millimetre_and_stands_still(cubes: int, seed: int) -> None:
    found = tower(cubes, seed)
    assert found.settled < 0.5
    assert found.wander < 0.1
    assert found.fastest < 1.0


def test_box_of_10_kg_on_one_of_10_g_stays() -> None:
    assert heavy_on_light() < 1.0


@pytest.mark.parametrize("seed", [0, 1])
def test_arch_with_more_friction_than_it_needs_stands(seed: int) -> None:
    assert stands(arch, 1.2, seed)[0] < 1.0


@pytest.mark.parametrize("seed", [0, 1])
def test_card_house_with_more_friction_than_it_needs_stands(seed: int) -> None:
    assert stands(card_house, 1.2, seed)[0] < 1.0


@STRUCTURES
@pytest.mark.parametrize("seed", [0, 1])
def test_structure_with_less_friction_than_it_needs_falls(
    make: Callable[[float, int], Structure], seed: int
) -> None:
    assert stands(make, 0.8, seed)[0] > 20.0


def test_statics_of_a_ladder_at_a_wall_are_those_of_the_textbook() -> None:
    """One that leans at 45 degrees, with the same friction at both ends, needs tan(45 / 2)."""
    foot, top = np.zeros(3), np.array((1.0, 0.0, 1.0))
    up, back = np.array((0.0, 0.0, 1.0)), np.array((-1.0, 0.0, 0.0))
    ladder = {"ladder": Mass(3.0, (foot + top) / 2)}
    ends = [Touch("ladder", "floor", foot, up), Touch("ladder", "wall", top, back)]
    assert required_friction(ladder, ends) == pytest.approx(2**0.5 - 1, rel=3e-3)
