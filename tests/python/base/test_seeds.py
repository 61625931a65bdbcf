"""One rule for seeds, whatever they are of: a whole number from 0 to 2^64 - 1."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import energymargin as em
from energymargin.base.checks import seed_number
from energymargin.records.evaluation.table import evaluate


def problem() -> em.Problem:
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("box", em.Box((0.1,) * 3), mass=1, role="object")
    inside = em.regions.Ball("box", (0, 0, 0), 0.1)
    push = {"force": (1, 1, 1), "torque": (0, 0, 0), "duration": 0.1, "horizon": 0.1}
    return em.Problem(scene, scene.pack(), captured=inside, **push)


DOORS: dict[str, Callable[[Any], object]] = {
    "a search": lambda seed: em.escape_effort(problem(), nodes=3, seed=seed),
    "a probability": lambda seed: em.capture_probability(problem(), rollouts=3, seed=seed),
    "scores of many": lambda seed: em.score([problem()], ["effort/est"], nodes=3, seed=seed),
    "a stream": lambda seed: em.stream(seed, 0),
    "a trajectory": lambda seed: em.tasks.make("push").rollout(seed, frames=2),
    "a function's own check": seed_number,
}


@pytest.mark.parametrize("seed", [None, -1, 2**64, 1.5, "1"])
@pytest.mark.parametrize("door", DOORS)
def test_what_is_no_seed_is_refused_in_the_same_words_at_every_door(door: str, seed: Any) -> None:
    with pytest.raises(ValueError, match=r"seed is .*, expected a whole number from 0 to 2\^64"):
        DOORS[door](seed)


@pytest.mark.parametrize("door", DOORS)
def test_the_largest_seed_is_one(door: str) -> None:
    DOORS[door](2**64 - 1)


@pytest.mark.parametrize("seed", [None, -1, 1.5])
def test_a_bootstrap_takes_no_other_seed_either(seed: Any) -> None:
    with pytest.raises(ValueError, match="seed is"):
        evaluate(None, draws=5, seed=seed)  # type: ignore[arg-type]  # the seed is looked at first
