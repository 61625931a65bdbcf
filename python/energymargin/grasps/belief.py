"""What is not known of a grasp, and its draws: the same for all grasps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin.base.checks import one_of
from energymargin.beliefs import Source, Uncertainty, source_of

OPEN = (2.0**-31, 1 - 2.0**-31)  # ends of the unit interval: no quantile is infinite
TRIES = 100  # draws of one number that has to be positive


class GraspDraw(NamedTuple):
    """One draw of what is not known, but for the pose."""

    number: int
    friction: float
    """Coefficient of the object."""
    mass: float
    """Of the object [kg]."""
    force: float
    """Of the grip [N]."""


@dataclass(frozen=True)
class GraspBelief:
    """How well a grasp is known. Everything that is left out is known exactly.

    Args:
        pose: error of the hand's pose in the object, or of the object's in the hand: six numbers,
            each a standard deviation or a distribution of scipy.stats, or a covariance (6, 6).
            Position [m] and rotation vector [rad] along and about the axes of the grasp frame: x is
            the way the fingers open, z the approach.
        about: where the rotation turns: about the origin of the "grasp" frame, or the object's
            "center_of_mass". Never about the origin of a file.
        friction: of the object's coefficient: a standard deviation, or a distribution.
        mass: of its mass [kg], likewise.
        force: of the grip's force [N], likewise.
        relative: friction, mass and force are factors, about 1, of what is asked.

    Raises ValueError on what cannot be.
    """

    pose: Any = None
    friction: Any = None
    mass: Any = None
    force: Any = None
    about: str = "grasp"
    relative: bool = False

    def __post_init__(self) -> None:
        """Checks all of it."""
        one_of("about", self.about, ("grasp", "center_of_mass"))
        self._sources(1.0, 1.0, 1.0)

    def __bool__(self) -> bool:
        """Whether anything is not known."""
        return bool(self._given("pose", "friction", "mass", "force"))

    @property
    def text(self) -> dict[str, Any]:
        """All of it, as JSON. Raises ValueError on a distribution that scipy.stats does not have by
        name."""
        given, force = self._given("pose", "friction", "mass"), self.force
        known = Uncertainty(**given).to_json() if given else None
        of_force = None if force is None else Uncertainty(mass=force).to_json()
        relative = {"relative": True} if self.relative else {}
        return relative | {"about": self.about, "of": known, "force": of_force}

    def draw(
        self, number: int, seed: int, *, friction: float, mass: float, force: float
    ) -> GraspDraw:
        """Draw `number` about the values that are believed most.

        Raises ValueError if hardly any draw can be, as of a mass below 0.
        """
        random = np.random.default_rng([seed, number, 0])
        values = {"friction": friction, "mass": mass, "force": force}
        centers = (1.0, 1.0, 1.0) if self.relative else (friction, mass, force)
        for name, known in self._sources(*centers).items():
            if name != "pose":
                scale = values[name] if self.relative else 1.0
                values[name] = scale * _positive(name, known, random)
        return GraspDraw(number, **values)

    def poses(self, number: int, seed: int) -> Iterator[NDArray[np.float64]]:
        """Errors of the pose, (6,), for draw `number`: the first, and others for where it cannot
        be."""
        random = np.random.default_rng([seed, number, 1])
        known = self._sources(1.0, 1.0, 1.0).get("pose")
        while True:
            yield np.zeros(6) if known is None else _value(known, random)

    def fixes(self, name: str) -> bool:
        """Whether it says what the friction, mass or force is, whatever is asked."""
        given = getattr(self, name)
        return given is not None and not self.relative and not isinstance(given, Real)

    def _given(self, *names: str) -> dict[str, Any]:
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}

    def _sources(self, friction: float, mass: float, force: float) -> dict[str, Source]:
        """By name, about the values that are believed most."""
        centers = {"pose": 0.0, "friction": friction, "mass": mass, "force": force}
        found: dict[str, Source] = {}
        for name, given in self._given(*centers).items():
            quantity = "mass" if name == "force" else name
            source = source_of(quantity, "object", given, centers[name], place=name)
            found |= {name: source} if source.inputs else {}
        return found


def lab() -> GraspBelief:
    """What is not known of a grasp in a laboratory that has measured nothing.

    The pose errs by 7 mm and .05 rad along and about each axis, about as recorded poses of GRASPA's
    robot do. The others are chosen wide, not measured: friction is even from half of what is asked
    to one and a half times that, the mass errs by a tenth and the force by a fifth.
    """
    from scipy.stats import uniform

    pose = [0.007] * 3 + [0.05] * 3
    return GraspBelief(pose, friction=uniform(0.5, 1.0), mass=0.1, force=0.2, relative=True)


def _value(source: Source, random: np.random.Generator) -> NDArray[np.float64]:
    point = np.clip(random.random((1, len(source.inputs))), *OPEN)
    return np.asarray(source.values(point)[0])


def _positive(name: str, source: Source, random: np.random.Generator) -> float:
    for _ in range(TRIES):
        value = float(_value(source, random)[0])
        if value > 0 or (name == "friction" and value == 0):
            return value
    raise ValueError(f"{TRIES} draws of {name} are not above 0, expected a smaller error")
