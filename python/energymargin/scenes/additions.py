"""What a file of a robot adds to a scene, whatever its format: all of it, or nothing.

What a caller says of its bodies and joints is checked here, and what is left out is told.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from energymargin._core import Scene, World
from energymargin.errors import EnergyMarginError
from energymargin.limits import Limit
from energymargin.plausibility import warn

# What `joints` may set of a robot's joints; the rest is the file's.
CONTROL = (
    "start",
    "start_velocity",
    "held",
    "target",
    "target_velocity",
    "stiffness",
    "damping",
    "torque_limit",
    "armature",
    "limits",
)
Control = Mapping[str, Mapping[str, Any]]

OVERLAP = 1e-4  # m; links that overlap by less are pushed apart without harm
Pair = tuple[str, str]


class NotSimulatedError(EnergyMarginError, ValueError):
    """A file asks for what a scene does not simulate."""

    features: dict[str, int]
    """How many there are, by the name that `ignore` takes."""

    def __init__(self, source: str, features: Mapping[str, int]) -> None:
        """Names all of them."""
        super().__init__(
            f"{source} asks for what is not simulated: {counted(features)}; "
            f"ignore={tuple(features)!r} does without"
        )
        self.features = dict(features)


def counted(features: Mapping[str, int]) -> str:
    """Names, each with its number, as "mesh (2), plane (1)"."""
    return ", ".join(f"{name} ({count})" for name, count in features.items())


def warn_of_loose(source: str, ignored: str, names: Collection[str], fingerprint: str) -> None:
    """Warns, once for a fingerprint, of what moves freely without what is ignored."""
    if names:
        text = f"{source}: without {ignored!r} nothing drives or holds {', '.join(names)}."
        warn([(text, f"{text} joints={{name: ...}} drives or holds a joint.")], fingerprint)


def driven_by(control: Control) -> set[str]:
    """The joints that a caller drives or holds."""
    return {name for name, own in control.items() if {"held", "stiffness"} & own.keys()}


def several(name: str, given: Iterable[Any]) -> tuple[Any, ...]:
    """An argument of several values; ValueError with `name` on a word alone."""
    if isinstance(given, str):
        raise ValueError(f"{name} is {given!r}, expected a tuple: ({given!r},)")
    return tuple(given)


def check_control(control: Control, settable: Mapping[str, Sequence[str]]) -> None:
    """Raises ValueError unless a caller sets only what is `settable`: by joint, the keywords."""
    for name, own in control.items():
        if name not in settable:
            raise ValueError(f"joints has {name!r}, expected one of {', '.join(settable)}")
        for keyword in own:
            if keyword not in settable[name]:
                none = "none of a joint that is fixed or follows another one"
                expected = ", ".join(settable[name]) or none
                raise ValueError(f"joints[{name!r}] has {keyword!r}, expected {expected}")


def pairs_of(disabled: Iterable[Sequence[str]], what: str) -> list[Pair]:
    """`disable_collisions`; ValueError on what is no pair of two bodies or links."""
    pairs = [tuple(pair) for pair in disabled]
    for pair in pairs:
        if len(pair) != 2 or pair[0] == pair[1]:
            raise ValueError(f"disable_collisions has {pair!r}, expected pairs of two {what}")
    return [(pair[0], pair[1]) for pair in pairs]


@dataclass(frozen=True, eq=False)
class Additions:
    """Keywords of what is added to a scene."""

    bodies: list[dict[str, Any]]
    joints: list[dict[str, Any]]
    disabled: list[Pair]
    frictions: list[tuple[str, str, float]] = field(default_factory=list)
    """Coefficients of pairs of bodies."""
    planes: list[dict[str, Any]] = field(default_factory=list)

    def add_to(self, scene: Scene, limit: Limit) -> Scene:
        """The scene with all of it; with less where it raises TimeoutError or Cancelled."""
        for keywords in self.planes:
            scene.add_plane(**keywords)
        for keywords in self.bodies:
            limit.require(f"body {keywords['name']!r} was added")
            scene.add_body(**keywords)
        for keywords in self.joints:
            limit.require(f"joint {keywords['name']!r} was added")
            scene.add_joint(**keywords)
        for body_a, body_b in self.disabled:
            limit.require(f"collisions of {body_a!r} and {body_b!r} were disabled")
            scene.disable_collisions(body_a, body_b)
        for body_a, body_b, friction in self.frictions:
            scene.set_friction(body_a, body_b, friction)
        return scene


def added(
    scene: Scene | None,
    new: Additions,
    prefix: str,
    limit: Limit,
    *,
    self_collision: bool,
    overlapping: bool = False,
) -> Scene:
    """The scene, or a new one, with a robot; an error leaves a given scene as it was.

    `overlapping`: whether links may overlap at the start; those that do never collide.
    """
    if scene is not None:
        _check_names(scene, new)
    made = new.add_to(Scene() if scene is None else _empty(scene), limit)
    if self_collision:
        limit.require("links that overlap were looked for")
        depths = _overlaps(made)
        if depths and not overlapping:
            _refuse(depths, prefix)
        for pair in depths:
            new.disabled.append(pair)
            made.disable_collisions(*pair)
    limit.require("the scene was made")
    return made if scene is None else new.add_to(scene, Limit())


def _check_names(scene: Scene, new: Additions) -> None:
    """No two bodies of a scene, and no two joints, have the same name."""
    for what, there, added in (
        ("body", scene.bodies, new.planes + new.bodies),
        ("joint", scene.joints, new.joints),
    ):
        taken = {item.name for item in there}
        for name in (keywords["name"] for keywords in added):
            if name in taken:
                raise ValueError(f"the scene has a {what} {name!r}; prefix=... gives other names")


def _empty(scene: Scene) -> Scene:
    """A scene without bodies, stepped as the given one."""
    return Scene(
        scene.gravity,
        scene.step,
        scene.solver_iterations,
        scene.solver_tolerance,
        scene.margin,
        scene.friction_rule,
    )


def _overlaps(robot: Scene) -> dict[Pair, float]:
    """How deep [m] links overlap each other, or fixed bodies, at the start.

    What moves apart from a link, as an object in a gripper, touches it: that is a contact.
    """
    carriers = {joint.child: joint.parent for joint in robot.joints}
    fixed = {body.name for body in robot.bodies if body.fixed}
    depths: dict[Pair, float] = {}
    for contact in World(robot).contacts(robot.pack()) if carriers else ():
        a, b = contact.body_a, contact.body_b
        together = base_of(a, carriers) == base_of(b, carriers) or {a, b} & fixed
        if together and {a, b} & carriers.keys() and -contact.distance > OVERLAP:
            depths[a, b] = max(depths.get((a, b), 0.0), -contact.distance)
    return dict(sorted(depths.items()))


def base_of(body: str, carriers: Mapping[str, str]) -> str:
    """The body at the end of the chain that carries one; `carriers`: by body, what carries it."""
    while body in carriers:
        body = carriers[body]
    return body


def _refuse(depths: dict[Pair, float], prefix: str) -> None:
    """Raises ValueError that lists the links which overlap at the start."""
    deep = {(a.removeprefix(prefix), b.removeprefix(prefix)): d for (a, b), d in depths.items()}
    found = ", ".join(f"{a!r} and {b!r} by {1e3 * d:.3g} mm" for (a, b), d in deep.items())
    raise ValueError(
        f"links overlap at the start: {found}. Where they touch and press, start them apart, "
        "joints={name: {'start': ...}}, and give the problem the state in which they touch "
        "(em.mujoco.state reads it from MuJoCo). Where their shapes always overlap, "
        f"disable_collisions={list(deep)}: these never collide then, and bear nothing"
    )
