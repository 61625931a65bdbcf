"""What is not known for sure, and how well it is known: friction, masses, poses and velocities.

An uncertainty names no problem. Bound to a scene it is a list of sources: each one quantity of one
body, and a function from the unit cube, in which quasi-random points are drawn, to its values.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from energymargin._core import Body, Scene
from energymargin.base.aliases import Floats
from energymargin.base.checks import not_negative_number, numbers_of, shown
from energymargin.model.engines import Engine
from energymargin.model.scenes.overlaps import require_untied

VALUES = ("friction", "mass", "torsional_friction", "rolling_friction", "engine")
ERRORS = ("pose", "velocity")
QUANTITIES = (*VALUES[:2], *ERRORS, *VALUES[2:])
AXES = {
    "pose": ("x", "y", "z", "turn about x", "turn about y", "turn about z"),
    "velocity": ("vx", "vy", "vz", "rate about x", "rate about y", "rate about z"),
}
SYMMETRIC = 1e-9  # of a covariance, as a share of its largest entry

Quantiles = Callable[[Floats], Floats]
"""From numbers of the open unit interval, shape (N,), to values."""


@dataclass(frozen=True)
class Source:
    """One quantity of one body that is not known for sure."""

    quantity: str
    """One of QUANTITIES."""
    body: str
    inputs: tuple[str, ...]
    """The independent numbers behind it, D of them, as "x"; of a covariance its principal axes."""
    values: Callable[[Floats], Floats]
    """From points of the unit cube, shape (N, D), to values (N, 1), or of a pose or a velocity to
    errors (N, 6)."""
    given: Any = None
    """How well it is known, as the Uncertainty has it."""
    other: str | None = None
    """The other body of a pair's coefficient of friction."""

    @property
    def name(self) -> str:
        """As "pose of object"."""
        if self.quantity == "engine":
            return f"{self.body} of the engine"
        return f"{self.quantity} of {self.body}{f' and {self.other}' if self.other else ''}"


@dataclass(frozen=True)
class Uncertainty:
    """How well the numbers of a problem are known. Everything that is left out is known exactly.

    Each is for all objects of a scene, or a dict by the names of bodies, fixed ones too; errors of
    several bodies are independent. A distribution is a frozen one of scipy.stats.

    - `friction`, `mass`: a standard deviation, of a normal distribution about the problem's own
      coefficient or mass [kg]; or the distribution of the coefficient or mass itself. A pair that
      has a coefficient of its own is a dict in it: friction={"finger": {"object": 0.05}}.
    - `torsional_friction`, `rolling_friction`: the same of a body's `em.Surface` [m].
    - `pose`, `velocity`: of the error, which is added: six numbers, each a standard deviation or a
      distribution, or a covariance (6, 6). Position [m] and rotation vector [rad] of the body's
      frame, along and about the world's axes; its velocity [m/s] and angular velocity [rad/s].

    - `engine`: by names that the problem's engine `varies`, as those of MuJoCo's, {"gain.finger":
      5.0}; a standard deviation or a distribution. Its friction and masses are varied there, too.

    Raises ValueError on what cannot be, and if nothing is given.
    """

    friction: Any = None
    mass: Any = None
    pose: Any = None
    velocity: Any = None
    torsional_friction: Any = None
    rolling_friction: Any = None
    engine: Any = None

    def __post_init__(self) -> None:
        """Checks all of it."""
        given = self.given
        if not given:
            expected = f"expected one at least of {', '.join(QUANTITIES)}"
            raise ValueError(f"nothing is uncertain, {expected}")
        for quantity, value in given.items():
            if quantity == "engine" and not isinstance(value, Mapping):
                expected = "expected a dict by names that it varies"
                raise ValueError(f"engine is {shown(value)}, {expected}")
            for name, one in _by_body(quantity, value):
                _check(f"{quantity}[{name!r}]" if name else quantity, quantity, one)

    def __eq__(self, other: object) -> bool:
        """Whether both say the same; distributions are compared by name and parameters."""
        return isinstance(other, Uncertainty) and self.to_json() == other.to_json()

    def __hash__(self) -> int:
        """Equal uncertainties have equal hashes."""
        return hash(self.to_json())

    @property
    def given(self) -> dict[str, Any]:
        """What is not known exactly, by quantity."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if value is not None}

    def sources(self, scene: Scene) -> list[Source]:
        """Sources of the bodies of a scene, in the order of QUANTITIES and bodies.

        Raises ValueError on a body that is not there, the mass of a fixed one, and the pose or
        velocity of one that is fixed, tied by a loop, or a link; on a pair without a coefficient of
        its own, and on the friction of a body that has one with another, where that pair is not
        named.
        """
        bodies = {body.name: body for body in scene.bodies}
        objects = [body.name for body in bodies.values() if body.role == "object"]
        sources = []
        if isinstance(scene.engine, Engine):
            sources += _engine_sources(scene.engine, self.given, objects)
        elif self.engine is not None:
            raise ValueError(
                f"engine is {shown(self.engine)}, which the engine {scene.engine!r} does not vary, "
                "expected friction and mass by body"
            )
        for quantity, value in self.given.items():
            if isinstance(scene.engine, Engine) and quantity not in ERRORS:
                continue
            known = _by_name(quantity, value, objects)
            for name in known:
                _check_body(scene, bodies, quantity, name)
            pairs = {n: one for n, one in known.items() if isinstance(one, Mapping)}
            alone = [name for name in bodies if name in known and name not in pairs]
            for name in alone:
                turns = quantity.startswith(("torsional", "rolling"))
                at = bodies[name].surface if turns else bodies[name]
                center = getattr(at, quantity, 0.0) if quantity in VALUES else 0.0
                sources.append(source_of(quantity, name, known[name], center))
            if quantity == "friction":
                sources += _pair_sources(scene, pairs, alone)
        return [source for source in sources if source.inputs]

    def to_json(self) -> str:
        """As JSON text, the same for equal ones. Raises ValueError on a distribution that
        scipy.stats does not have by name."""
        given = {quantity: _to_plain(quantity, value) for quantity, value in self.given.items()}
        return json.dumps(given, sort_keys=True)

    @staticmethod
    def from_json(text: str) -> Uncertainty:
        """What `to_json` wrote. Raises ValueError on other text."""
        try:
            plain = json.loads(text)
        except json.JSONDecodeError as error:
            raise ValueError(f"uncertainty is {shown(text)}, expected JSON: {error}") from error
        unknown = set(plain) - set(QUANTITIES) if isinstance(plain, dict) else {shown(plain)}
        if unknown:
            expected = f"expected some of {', '.join(QUANTITIES)}"
            raise ValueError(f"uncertainty has {sorted(unknown)[0]!r}, {expected}")
        return Uncertainty(**{quantity: _from_plain(value) for quantity, value in plain.items()})


def _by_body(quantity: str, value: Any) -> list[tuple[str, Any]]:
    """By the name of a body; "" is for all objects."""
    if not isinstance(value, Mapping):
        return [("", value)]
    if not value or not all(isinstance(name, str) and name for name in value):
        raise ValueError(f"{quantity} is {shown(value)}, expected names of bodies as its keys")
    return list(value.items())


def _by_name(quantity: str, value: Any, objects: Sequence[str]) -> dict[str, Any]:
    """By the name of a body, or of what an engine varies; what is of all objects is of each."""
    given = _by_body(quantity, value)
    return {own: one for name, one in given for own in ([name] if name else objects)}


def is_distribution(value: Any) -> bool:
    """Whether it has quantiles, as a frozen one of scipy.stats."""
    return callable(getattr(value, "ppf", None))


def _check(place: str, quantity: str, value: Any) -> None:
    """Raises ValueError unless a body's uncertainty is one of its quantity."""
    if not (quantity == "friction" and isinstance(value, Mapping)):
        source_of(quantity, "", value, place=place)
        return
    for other, one in _by_body(place, value):
        if isinstance(one, Mapping):
            raise ValueError(f"{place}[{other!r}] is {shown(one)}, expected that of a pair")
        _check(f"{place}[{other!r}]", quantity, one)


def _six(place: str, value: Any) -> list[Any]:
    if isinstance(value, (Sequence, np.ndarray)) and len(value) == 6:
        return list(value)
    expected = "expected six standard deviations or distributions, or a covariance (6, 6)"
    raise ValueError(f"{place} is {shown(value)}, {expected}")


def is_covariance(value: Any) -> bool:
    """Whether it is a matrix in place of six numbers."""
    if isinstance(value, np.ndarray):
        return value.ndim == 2
    return isinstance(value, Sequence) and len(value) > 0 and isinstance(value[0], Sequence)


def covariance_root(place: str, value: ArrayLike) -> Floats:
    """A square root of the matrix, (6, D): its principal axes, each as long as its deviation."""
    matrix = numbers_of(place, value, "a covariance (6, 6) of finite numbers", (6, 6))
    most = SYMMETRIC * np.abs(matrix).max()
    variances, axes = np.linalg.eigh((matrix + matrix.T) / 2)
    if np.abs(matrix - matrix.T).max() > most or variances.min() < -most:
        expected = "expected a symmetric matrix without negative axes"
        raise ValueError(f"{place} is no covariance, {expected}")
    there = variances > most
    return np.asarray(axes[:, there] * np.sqrt(variances[there]))[:, ::-1]


def _check_body(scene: Scene, bodies: Mapping[str, Body], quantity: str, name: str) -> None:
    body = bodies.get(name)
    if body is None:
        raise ValueError(f"{quantity} names the body {name!r}, expected one of {', '.join(bodies)}")
    if not quantity.endswith("friction") and body.fixed:
        expected = "expected one that moves"
        raise ValueError(f"{quantity} names the body {name!r}, which is fixed, {expected}")
    if quantity in ERRORS:
        scene.slice(name)  # which a link does not have, and says so
        require_untied(scene, quantity, name)


def source_of(
    quantity: str, body: str, value: Any, center: float = 0.0, *, place: str = ""
) -> Source:
    """One quantity of one body. `center`: the problem's own coefficient or mass. Raises ValueError
    with `place` on a value that is none of the quantity."""
    if quantity in VALUES:
        return _of_columns(quantity, body, value, {quantity: _quantiles(place, value, center)})
    if is_covariance(value):
        root = covariance_root(place, value)
        names = tuple(f"axis {k + 1}" for k in range(root.shape[1]))
        return Source(quantity, body, names, lambda u: standard_normal(u) @ root.T, value)
    axes = zip(AXES[quantity], _six(place, value), strict=True)
    columns = {name: _quantiles(f"{place}, {name},", one, 0.0) for name, one in axes}
    return _of_columns(quantity, body, value, columns)


def _engine_sources(engine: Engine, given: Mapping[str, Any], objects: list[str]) -> list[Source]:
    """Sources of what an engine varies. Raises ValueError on what it does not."""
    sources = []
    for quantity, value in given.items():
        if quantity in ERRORS:
            continue
        for own, one in _by_name(quantity, value, objects).items():
            name = own if quantity == "engine" else f"{quantity}.{own}"
            if name not in engine.varies or isinstance(one, Mapping):
                known = ", ".join(engine.varies) or "nothing"
                raise ValueError(
                    f"{quantity} is {shown(value)}, but the engine {engine.name!r} does not "
                    f"vary {name!r}, expected some of {known}"
                )
            sources.append(source_of("engine", name, one, engine.varies[name]))
    return sources


def _pair_sources(
    scene: Scene, given: Mapping[str, Mapping[str, Any]], alone: Sequence[str]
) -> list[Source]:
    """Sources of pairs' coefficients, in the order of the scene. `alone`: bodies whose own friction
    is not known either."""
    named: dict[frozenset[str], Any] = {}
    for a, b, one in [(a, b, one) for a, of_a in given.items() for b, one in of_a.items()]:
        if frozenset((a, b)) in named:
            raise ValueError(f"friction names the pair {a!r} and {b!r} twice, expected it once")
        named[frozenset((a, b))] = one
    for pair in named.keys() - set(map(frozenset, scene.pair_frictions)):
        a, b = sorted(pair) if len(pair) == 2 else (*pair, *pair)
        raise ValueError(
            f"friction names the pair {a!r} and {b!r}, which has no coefficient of its own, "
            f"expected one of scene.set_friction({a!r}, {b!r}, ...), or the friction of a body"
        )
    sources = []
    for (a, b), coefficient in scene.pair_frictions.items():
        one = named.get(frozenset((a, b)))
        if one is not None:
            sources.append(replace(source_of("friction", a, one, coefficient), other=b))
        elif a in alone or b in alone:
            name, other = (a, b) if a in alone else (b, a)
            raise ValueError(
                f"friction names the body {name!r}, whose coefficient with {other!r} was set for "
                f"the pair and does not follow it, expected {{{other!r}: {{{name!r}: ...}}}} too, "
                "0 if that is known exactly, or frictions of other bodies"
            )
    return sources


def _of_columns(
    quantity: str, body: str, given: Any, columns: Mapping[str, Quantiles | None]
) -> Source:
    """A source of independent numbers; those that are known exactly take no input."""
    drawn = [(k, name, of) for k, (name, of) in enumerate(columns.items()) if of is not None]

    def values(u: Floats) -> Floats:
        found = np.zeros((len(u), len(columns)))
        for column, (k, _, of) in enumerate(drawn):
            found[:, k] = of(u[:, column])
        return found

    return Source(quantity, body, tuple(name for _, name, _ in drawn), values, given)


def _quantiles(place: str, value: Any, center: float) -> Quantiles | None:
    """Quantiles of a distribution, or of a standard deviation about the center; None of 0."""
    if is_distribution(value):
        return lambda u: np.asarray(value.ppf(u), dtype=float)
    try:
        deviation = not_negative_number(place, value)
    except ValueError as error:
        raise ValueError(
            f"{error}, a standard deviation, or a frozen distribution of scipy.stats"
        ) from None
    return (lambda u: center + deviation * standard_normal(u)) if deviation else None


def standard_normal(u: Floats) -> Floats:
    """Its quantiles at numbers of the open unit interval."""
    from scipy.special import ndtri

    return np.asarray(ndtri(u))


def _to_plain(quantity: str, value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _to_plain(quantity, one) for name, one in value.items()}
    if is_distribution(value):
        return _distribution_to_plain(value)
    if quantity in VALUES:
        return float(value)
    if is_covariance(value):
        return {"covariance": np.asarray(value, dtype=float).tolist()}
    return [_to_plain("friction", one) for one in value]


def _distribution_to_plain(value: Any) -> dict[str, Any]:
    kind = getattr(value, "dist", None)
    name = getattr(kind, "name", None)
    if kind is None or type(kind) is not type(_of_scipy(name)):  # one of a user may have its name
        raise ValueError(
            f"distribution is {shown(value)}, expected a frozen one of scipy.stats, as "
            "uniform(0, 1): others have no name by which they could be written down"
        )
    args, kwds = [float(one) for one in value.args], {k: float(v) for k, v in value.kwds.items()}
    return {"distribution": name, "args": args, "kwds": kwds}


def _from_plain(plain: Any) -> Any:
    if isinstance(plain, list):
        return [_from_plain(one) for one in plain]
    if not isinstance(plain, dict):
        return plain
    if "covariance" in plain:
        return plain["covariance"]
    if "distribution" not in plain:
        return {name: _from_plain(one) for name, one in plain.items()}
    distribution = _of_scipy(plain["distribution"])
    if distribution is None:
        expected = "expected the name of one of scipy.stats"
        raise ValueError(f"distribution is {plain['distribution']!r}, {expected}")
    return distribution(*plain.get("args", ()), **plain.get("kwds", {}))


def _of_scipy(name: object) -> Any:
    """The distribution of scipy.stats with this name; None if there is none."""
    import scipy.stats

    found = getattr(scipy.stats, name, None) if isinstance(name, str) else None
    return found if is_distribution(found) else None
