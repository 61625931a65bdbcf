"""Checks of arguments: each returns the value, or raises a ValueError that names it.

Numbers of numpy count as those of Python, and become them.
"""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from energymargin.base.aliases import Floats

LONGEST = 60  # characters of a value in an error
Thing = TypeVar("Thing")
MOST_COUNT, MOST_SEED = 2**31 - 1, 2**64 - 1  # of the core


WAYS = {
    "a Plan": "em.Plan(1 / 240, velocities={'BODY': rows}), as rows of em.motions, or "
    "em.Plan.hold(scene, state, duration)",
    "a Problem": "em.Problem(scene, scene.pack(), captured=em.regions.Ball(...), ...); of another "
    "plan problem.replace(plan=plan), of another state problem.with_state(state)",
    "a Scene": "em.Scene(), then add_body, em.scenes.from_urdf(path) or from_mjcf(path)",
    "an em.grasps.GraspObject": "em.grasps.GraspObject.load(path, mass=0.3)",
    "a mujoco.MjModel": "mujoco.MjModel.from_xml_path(path)",
    "something that a robot can hold": "without a robot a problem has horizon=0.5 and no plan",
    "a Region": "em.regions.Ball('BODY', center=(0, 0, 0), radius=0.05), or another of em.regions",
}


def with_way(text: str) -> str:
    """An error's text, with how the kind of object is made that it ends with."""
    kind = next((kind for kind in WAYS if text.endswith(f"expected {kind}")), None)
    return text if kind is None else f"{text}: {WAYS[kind]}"


def shown(value: object) -> str:
    """A value in one short line, for an error."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # a repr of the user's own
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def whole_number(name: str, value: int, least: int, most: int | None = None) -> int:
    """`value`, if it is a whole number from `least` to `most`; else a ValueError with `name`.

    True and False are none. Without `most` it has to fit into 32 bits, as the core's counts do.
    """
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    largest = MOST_COUNT if most is None else most
    if whole and least <= value <= largest:
        return int(value)
    given: object = value
    if isinstance(given, float) and given.is_integer():
        raise ValueError(f"{name} is {value!r}, expected a whole number, as {int(value)}")
    bounded = most is not None or (whole and value > largest)
    end = "2^64 - 1" if largest == MOST_SEED else largest
    expected = f"from {least} to {end}" if bounded else f"of at least {least}"
    raise ValueError(f"{name} is {shown(value)}, expected a whole number {expected}")


def seed_number(value: int) -> int:
    """`value`, if it is a seed: a whole number from 0 to 2^64 - 1; else a ValueError. None is no
    seed but where a function says what it means."""
    return whole_number("seed", value, 0, MOST_SEED)


def core_count(name: str, count: int | None) -> int:
    """`count`, or for None all cores that this process may use; a ValueError if it is below 1."""
    return usable_cores() if count is None else whole_number(name, count, 1)


def usable_cores() -> int:
    """Number of cores that this process may use; all of the machine where the system cannot say."""
    if hasattr(os, "process_cpu_count"):  # Python 3.13
        return os.process_cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):  # Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def positive_number(name: str, value: float) -> float:
    """`value`, if it is a finite number above 0; else a ValueError with `name`."""
    return _number(name, value, lambda number: number > 0, "a positive number")


def not_negative_number(name: str, value: float) -> float:
    """`value` as a float, if it is a finite number of at least 0; else a ValueError with `name`."""
    number = _number(name, value, lambda number: number >= 0, "a finite number of at least 0")
    return float(number) + 0.0  # which makes 0.0 of -0.0


def finite_number(name: str, value: float) -> float:
    """`value` as a float, if it is a finite number; else a ValueError with `name`."""
    return float(_number(name, value, lambda number: True, "a finite number"))


def share(name: str, value: float, least: float = 0.0) -> float:
    """`value` as a float, if it is a number from `least` to below 1; else a ValueError."""
    expected = f"a number from {least:g} to below 1"
    return float(_number(name, value, lambda number: least <= number < 1, expected)) + 0.0


def open_share(name: str, value: float) -> float:
    """`value` as a float, if it is a number between 0 and 1 and neither; else a ValueError."""
    return float(_number(name, value, lambda number: 0 < number < 1, "a number between 0 and 1"))


def yes_or_no(name: str, value: bool) -> bool:
    """`value`, if it is a bool; else a ValueError with `name`."""
    require(isinstance(value, (bool, np.bool_)), name, value, "true or false")
    return bool(value)


def function_of(name: str, value: Any, *arguments: str) -> Any:
    """`value`, if it can be called with so many arguments; else a ValueError with `name`."""
    expected = f"a function ({', '.join(arguments)})"
    is_problem = hasattr(value, "with_state") and "time" in arguments
    way = ": lambda state, time: problem.with_state(state)" * is_problem
    require(callable(value), name, value, expected + way)
    try:
        signature = inspect.signature(value)
    except (TypeError, ValueError):  # of some compiled functions
        return value
    try:
        signature.bind(*arguments)
    except TypeError as error:
        raise ValueError(f"{name} takes {signature}, expected {expected}") from error
    return value


def function_or_none(name: str, value: Any, *arguments: str) -> Any:
    """As `function_of`; None is None."""
    return None if value is None else function_of(name, value, *arguments)


def require(right: object, name: str, value: object, expected: str) -> None:
    """Raises a ValueError with `name`, the value and what was expected, unless it is right."""
    if not right:
        raise ValueError(with_way(f"{name} is {shown(value)}, expected {expected}"))


def one_of(name: str, value: str, choices: Sequence[str]) -> str:
    """`value`, if it is one of these words; else a ValueError with `name`."""
    if value in choices:
        return value
    raise ValueError(f"{name} is {value!r}, expected {' or '.join(map(repr, choices))}")


def by_name(name: str, things: Mapping[str, Thing], kind: str) -> Thing:
    """The thing of a name; KeyError that says which names there are if there is none."""
    if name not in things:
        raise KeyError(f"{name!r} is no {kind}; there are: {', '.join(things)}")
    return things[name]


def each_name(given: str | Iterable[str]) -> tuple[str, ...]:
    """Names, or the one that is given alone."""
    return (given,) if isinstance(given, str) else tuple(given)


def names_of(name: str, value: Sequence[str]) -> Sequence[str]:
    """`value`, if it is no single name; else a ValueError with `name`."""
    if isinstance(value, str):
        raise ValueError(f"{name} is {value!r}, expected a list of names: [{value!r}]")
    if not isinstance(value, Iterable):
        raise TypeError(f"{name} is {value!r}, expected a list of names")
    return value


def check_type(name: str, value: object, kind: Any, expected: str) -> None:
    """Raises a ValueError with `name` unless the value is of this kind, a type or several."""
    require(isinstance(value, kind), name, value, expected)


def numbers_of(
    name: str, value: Any, expected: str = "numbers", shape: tuple[int, ...] | None = None
) -> Floats:
    """`value` as an array of numbers, if there is a shape of that and finite; else a ValueError."""
    try:
        array = np.asarray(value, float)
        whole = shape is None or (array.shape == shape and bool(np.isfinite(array).all()))
        right = whole and value is not None  # which would be a NaN
    except (TypeError, ValueError, OverflowError):
        right = False
    require(right, name, value, expected)
    return array


def check_shape(
    name: str, array: NDArray[Any], shape: tuple[int, ...], kind: type | None = None
) -> None:
    """Raises a ValueError with `name` unless the array is of this shape, and of this kind."""
    right = np.shape(array) == shape and (kind is None or np.asarray(array).dtype == kind)
    if not right:
        found = f"shape {np.shape(array)} of {np.asarray(array).dtype}"
        expected = f"expected {shape}{f' of {kind.__name__}' if kind else ''}"
        raise ValueError(f"{name} has {found}, {expected}")


def _number(name: str, value: object, right: Callable[[float], bool], expected: str) -> float:
    """The value as a number of Python, which goes into JSON, if it is finite and `right`."""
    number: Any = value.item() if isinstance(value, (np.integer, np.floating)) else value
    real: float = number if isinstance(number, (int, float)) else math.nan
    if math.isfinite(real) and right(real) and not isinstance(real, bool):
        return real
    raise ValueError(f"{name} is {value!r}, expected {expected}")
