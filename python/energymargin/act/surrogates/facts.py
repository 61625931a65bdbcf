"""What the problems that a surrogate learned from have in common, by which it knows others."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Iterator
from typing import Any

from energymargin._core import Problem

Facts = dict[str, Any]
"""By its place in a problem file, as "scene.bodies.object.mass": a value that all have."""

OTHER = ("format", "version", "state", "contacts", "plan")  # of the file, or of one state
NEAR = 0.01  # of a number: a horizon of frames is rounded to steps
LONG = 200  # characters of a list, as of a hull's vertices, that is kept as its digest


def common_facts(problems: Iterable[Problem]) -> Facts:
    """Those that are equal in all problems, numbers to 1 %."""
    first, *more = [facts_of(problem) for problem in problems]
    return {
        name: value
        for name, value in first.items()
        if all(is_same(other.get(name), value) for other in more)
    }


def facts_of(problem: Problem) -> Facts:
    """All facts of a problem; of one whose sets have no file, its bodies and horizon alone."""
    try:
        text = problem.to_json()
    except ValueError:  # a Predicate
        names = [body.name for body in problem.scene.bodies]
        return {"scene.bodies": names, "horizon": problem.horizon}
    whole = json.loads(text)
    return dict(_leaves("", {k: v for k, v in whole.items() if k not in OTHER}))


def is_same(first: Any, second: Any) -> bool:
    """Whether two values are equal, numbers to 1 %."""
    if isinstance(first, float) and isinstance(second, float):
        return math.isclose(first, second, rel_tol=NEAR)
    return bool(first == second)


def _leaves(place: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, list) and value and all(isinstance(e, dict) for e in value):
        value = {str(each.get("name", k)): each for k, each in enumerate(value)}
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _leaves(f"{place}.{key}" if place else key, each)
        return
    text = json.dumps(value)
    long = len(text) > LONG
    yield place, hashlib.sha256(text.encode()).hexdigest() if long else value
