"""The bits of an engine: eight digits that change as soon as a score of a task does.

Releases say by their version since when the same settings give the same bits. Between two releases
the physics may move; so a page of results has these digits too, of the engine that made it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from functools import cache
from hashlib import sha256

from energymargin import tasks
from energymargin._core import capture_score, escape_effort, force_score
from energymargin.base.plausibility import PlausibilityWarning

__all__ = ["bits"]

# (seed, frame) of a state of each task of which the scores have something to say.
MOMENTS = {
    "balance": (8, 4),
    "grasp": (8, 5),
    "push": (9, 2),
    "push-multi": (7, 0),
    "scoop": (8, 5),
    "topple": (9, 3),
}
NODES = 30
DECIMALS = 6  # so that what numpy rounds otherwise on another processor is no other engine


@cache
def bits(*, improved: bool = False) -> str:
    """Digits of the physics and the published search; with `improved` of the improved one too.

    They take a second, and are the same in every process and on every thread.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlausibilityWarning)
        words = " ".join(f"{round(value, DECIMALS) + 0.0}" for value in _values(improved=improved))
    return sha256(words.encode()).hexdigest()[:8]


def _values(*, improved: bool) -> Iterator[float]:
    for name, (seed, frame) in MOMENTS.items():
        task = tasks.make(name)
        ran = task.rollout(seed=seed)
        problem = task.problem(ran.states[frame], ran.params, ran.contacts[frame])
        capture = capture_score(problem, nodes=NODES, warn=False)
        yield from problem.state.tolist()
        yield from (capture.capture, capture.success or 0.0, force_score(problem).force)
        yield escape_effort(problem, nodes=NODES, search="published").effort
        if improved:
            yield escape_effort(problem, nodes=NODES).effort
