"""Tasks that ask one question by keywords, with uniform draws, as the paper's four do."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from energymargin._core import Contact, Problem, Scene
from energymargin.base.aliases import Floats
from energymargin.base.checks import positive_number
from energymargin.tasks.base import NONE_DRAWN, Params, Regions
from energymargin.tasks.scripted import EFFECTORS, Drive, ScriptedTask


class Means:
    """Draws the means: what a random generator does on average."""

    def uniform(self, low: float, high: float, size: Any = ()) -> Floats:
        """The mean of `Generator.uniform`, of shape `size`."""
        return np.full(size, (low + high) / 2)


class QuestionTask(ScriptedTask):
    """A scripted task whose draws are uniform, and which says by keywords what it asks.

    Its script is its drive in which each draw is the mean.
    """

    longest_edge: float
    """Longest edge of a search [s]."""
    rate: float
    """Lambda of eq. 4 [1/J]."""
    usual: ClassVar[Params] = {}
    """Parameters of a problem whose own params leave them out."""
    _last: tuple[Params, Scene] | None = None

    @cached_property
    def layout(self) -> Scene:
        """Which numbers of a state are whose."""
        return self.scene(self.usual)

    def script(self, params: Params) -> Drive:
        """The mean of `drive`."""
        means: Any = Means()
        return self.drive(params, means)

    @abstractmethod
    def question(self, state: Floats, params: Params) -> dict[str, Any]:
        """Keywords of a Problem: the disturbance, and what else the task asks at a state, (n,)."""

    def asked_scene(self, params: Params) -> Scene:
        """The scene of a problem; by default that of the script."""
        return self.scene(params)

    def known(self, params: Params) -> dict[str, float]:
        """The parameters of a problem whose own are these."""
        return {**self.usual, **params}

    def problem(
        self, state: Floats, params: Params | None = None, contacts: Sequence[Contact] | None = None
    ) -> Problem:
        """The problem P of Section V-A at a state, shape (n,), of a trajectory of these params."""
        known = self.known(params or {})
        last = self._last
        if last is None or last[0] != known:  # one scene for all frames of a trajectory
            last = self._last = (known, self.asked_scene(known))
        asked: dict[str, Any] = dict(
            effector=self.effector,
            duration=self.longest_edge,
            rate=self.rate,
            captured=self.captured(state, known),
            succeeded=self.succeeded(known),
            **self.question(state, known),
        )
        return Problem(last[1], state, contacts=contacts, start_outside=True, **asked)

    def captured(self, state: Floats, params: Params = NONE_DRAWN) -> Regions:
        """Z_cap(z) of a state, shape (n,); by default that of every instant."""
        return self.captured_throughout(params)


class FrictionTask(QuestionTask):
    """A task whose friction is a parameter, or else drawn for each trajectory.

    `friction`: a positive coefficient; None draws one for each trajectory.
    """

    friction_range: tuple[float, float]
    """Least and largest friction that is drawn."""

    def __init__(self, friction: float | None = None, effector: str = EFFECTORS[0]) -> None:
        """A task of these parameters; raises ValueError on others."""
        super().__init__(effector)
        self.friction = None if friction is None else positive_number("friction", friction)

    @cached_property
    def layout(self) -> Scene:
        """Which numbers of a state are whose: the same with every friction."""
        return self.scene({"friction": self.friction_range[0]})

    def draw(self, random: Generator) -> dict[str, float]:
        """The friction, if the task leaves it open; it takes one draw either way."""
        friction = random.uniform(*self.friction_range)
        return {"friction": friction if self.friction is None else self.friction}

    def known(self, params: Params) -> dict[str, float]:
        """With the friction of `params`, or else the task's own; ValueError if neither is given."""
        return {**super().known(params), "friction": drawn("friction", params, self.friction)}


def drawn(name: str, params: Params | None, own: float | None) -> float:
    """A parameter of a trajectory, or else the task's own value; ValueError if neither is given."""
    value = (params or {}).get(name, own)
    if value is None:
        way = f"pass params=trajectory.params, or make the task with a {name}"
        raise ValueError(f"the {name} is drawn for each trajectory: {way}")
    return value


def places_apart(random: Generator, area: ArrayLike, count: int, gap: float) -> list[Floats]:
    """Random places (2,) more than `gap` [m] apart; `area`: (low, high) of x and of y [m]."""
    places: list[Floats] = []
    while len(places) < count:
        place = random.uniform(*np.transpose(area))
        if all(np.hypot(*(place - other)) > gap for other in places):
            places.append(place)
    return places


def swept_from(scene: Scene, state: Floats, body: str) -> dict[str, Any]:
    """The planar motion of a body in a state, shape (n,), as `regions.Swept` takes it."""
    now = scene.unpack(state)[body]
    position, velocity = now["position"][:2], now["velocity"][:2]
    return {"position": position, "velocity": velocity, "yaw_rate": now["angular_velocity"][2]}
