"""What problems have in common, by name: a mass, a size, a set, a bound, the horizon."""

from __future__ import annotations

import json
import math
from typing import Any

from energymargin import Problem

Facts = dict[str, Any]
"""Values of a problem by their places in its file, as "scene.bodies.object.mass"."""

OTHER = ("format", "version", "state", "contacts", "plan")  # of the file, or of one state
NEAR = 0.01  # of a number: a horizon of frames is rounded to steps


def facts_of(problem: Problem) -> Facts:
    """All facts of a problem; if its sets have no file, its bodies and horizon alone."""
    try:
        whole = json.loads(problem.to_json())
    except ValueError:  # a Predicate
        bodies = [{"name": body.name} for body in problem.scene.bodies]
        whole = {"scene": {"bodies": bodies}, "horizon": problem.horizon}
    return _leaves("", {k: v for k, v in whole.items() if k not in OTHER})


def same(first: Facts, second: Facts) -> Facts:
    """The facts of the first that the second shares, numbers to 1 %."""
    return {name: value for name, value in first.items() if _is_near(value, second.get(name))}


def _is_near(first: Any, second: Any) -> bool:
    numbers = isinstance(first, float) and isinstance(second, float)
    return bool(first == second) or (numbers and math.isclose(first, second, rel_tol=NEAR))


def _leaves(place: str, value: Any) -> Facts:
    if isinstance(value, list) and value and isinstance(value[0], dict):
        value = {str(each.get("name", k)): each for k, each in enumerate(value)}
    if not isinstance(value, dict):
        return {place: value}
    inner = (_leaves(f"{place}.{key}".lstrip("."), each) for key, each in value.items())
    return dict(fact for facts in inner for fact in facts.items())
