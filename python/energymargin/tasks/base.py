"""What a manipulation task is: it makes trajectories, and it turns a state into a problem.

A task is found by its name: a package registers its class under the entry point group
`energymargin.tasks`, and the class says what it is in the first line of its docstring. A task whose
robot follows a script in simulation is a `ScriptedTask`, in `scripted`: it says what is special
about it, and gets the rest.
"""

from __future__ import annotations

import inspect
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Contact, Problem, Region, Scene
from energymargin.base.aliases import Floats
from energymargin.tasks.trajectories import Trajectory

Params = Mapping[str, float]
"""What was drawn for one trajectory alone, by name."""
NONE_DRAWN: Params = MappingProxyType({})

Regions = Region | dict[str, Region]
"""A set of states, or the set of each object by its name. With several objects there are two kinds
of labels: whether all of them are captured, and whether at least one is."""

STEP = 1 / 240  # s; the paper's simulator
PLANE = ("x", "y")  # of pictures, of a task without `plane`
# Keywords of a body that moves along x and y and turns about z alone.
PLANAR: Mapping[str, Any] = {"linear_factor": (1.0, 1.0, 0.0), "angular_factor": (0.0, 0.0, 1.0)}


class Task(Protocol):
    """A manipulation task; its constructor's keywords are its parameters.

    This is all that a task needs. It may also have `parameters`, the keywords that make it again
    (else those are its attributes of the same names), and `plane`, the axes of the plane in which
    pictures show it: ("x", "y"), which is the default, or ("x", "z").
    """

    name: str
    """Under which it is registered."""

    def rollout(self, seed: int, frames: int = 10) -> Trajectory:
        """One random trajectory, the same for the same seed."""
        ...

    @abstractmethod
    def problem(
        self, state: Floats, params: Params | None = None, contacts: Sequence[Contact] | None = None
    ) -> Problem:
        """How robust is the manipulation at this state, shape (n,)?

        `params` and `contacts` are those that the trajectory recorded.
        """
        ...


def parameters_of(task: Task) -> dict[str, Any]:
    """The keywords that make a task again: its `parameters`, or else its constructor's keywords.

    Raises ValueError on a task that has no attribute for one.
    """
    parameters: dict[str, Any] | None = getattr(task, "parameters", None)
    return constructor_keywords(task) if parameters is None else parameters


def plane_of(task: Task) -> tuple[str, str]:
    """The axes of the plane in which pictures show a task."""
    plane: tuple[str, str] = getattr(task, "plane", PLANE)
    return plane


def constructor_keywords(task: object) -> dict[str, Any]:
    """The constructor's keywords, with the values of the attributes of those names."""
    keywords = inspect.signature(type(task)).parameters.values()
    names = [k.name for k in keywords if k.kind not in (k.VAR_KEYWORD, k.VAR_POSITIONAL)]
    missing = [name for name in names if not hasattr(task, name)]
    if missing:
        wrong = f"{type(task).__name__} has no attribute for its parameter {missing[0]!r}"
        raise ValueError(f"{wrong}: set one of that name, or give the task `parameters`")
    return {name: getattr(task, name) for name in names}


def set_of_object(sets: Regions, name: str | None) -> Region:
    """The set of an object, or the one for all if it has no name."""
    if isinstance(sets, dict) and name is not None:
        return sets[name]
    if isinstance(sets, dict) or name is not None:
        raise ValueError("`captured` gives one set for some states, and several for others")
    return sets


def inside(sets: Regions, scene: Scene, states: Floats) -> NDArray[np.bool_]:
    """Whether each object is in its set, of one state (n,) or of several (N, n): shape (k,) or
    (k, N). One set for all counts as one object."""
    by_object = sets.values() if isinstance(sets, dict) else [sets]
    return np.array([region.contains(scene, states) for region in by_object], dtype=bool)


def any_inside(sets: Regions, scene: Scene, states: Floats) -> NDArray[np.bool_] | None:
    """Whether at least one object is in its set; None if there is one set for all."""
    return np.any(inside(sets, scene, states), axis=0) if isinstance(sets, dict) else None
