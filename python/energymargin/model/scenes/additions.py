"""What a file of a robot adds to a scene, whatever its format: all of it, or nothing.

What a caller says of its bodies and joints is checked here, and what is left out is told.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from energymargin._core import Compound, Scene, World
from energymargin.base.aliases import Floats
from energymargin.base.errors import EnergyMarginError
from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn
from energymargin.model.scenes import reports
from energymargin.model.scenes.reports import ReportRow

# What `joints` may set of a robot's joints; the rest is the file's.
CONTROL = (
    *("start", "start_velocity", "held", "target", "target_velocity", "limits"),
    *("stiffness", "damping", "torque_limit", "armature", "friction"),
)
Control = Mapping[str, Mapping[str, Any]]
BASES = ("fixed", "free", "kinematic")

NEGLIGIBLE = 1e-9  # share of what hangs on a link without mass, which it gets: a link has one
GYRATION = 0.01  # m; radius of gyration of what has no inertia
OVERLAP = 1e-4  # m; links that overlap by less are pushed apart without harm

POSES = 50  # of a robot's joints, at random: links that overlap in all of them always do
BLOCKED = 0.25  # share of them in which a hull and another link overlap, from which on that is told
DRIVING = ("held", "stiffness", "target_velocity", "mimic")
OVERLAPPING = "overlapping"
NAMED = 3  # bodies in a warning
SETTINGS = (  # of a scene
    *("gravity", "step", "solver_iterations", "solver_tolerance", "margin", "friction_rule"),
)
Pair = tuple[str, str]


class NotSimulatedError(EnergyMarginError, ValueError):
    """A file asks for what a scene does not simulate."""

    features: dict[str, int]
    """How many there are, by the name that `ignore` takes."""

    def __init__(
        self, source: str, features: Mapping[str, int], mistakes: Sequence[str] = ()
    ) -> None:
        """Names all of them, and what else is wrong."""
        super().__init__(
            f"{source} asks for what is not simulated: {counted(features)}; "
            f"ignore={tuple(features)!r} does without" + "".join(f"\n{text}" for text in mistakes)
        )
        self.features = dict(features)


class FileMistakes:
    """What is wrong in a file, and what of it is not simulated, to be told all at once."""

    def __init__(self, source: str, limit: Limit) -> None:
        """`source`: the file, for errors; `limit`: of its reading."""
        self.source, self.limit, self.features = source, limit, Counter[str]()
        self._errors: list[Exception] = []

    def add(self, text: str) -> None:
        """Something is wrong."""
        self._errors.append(ValueError(text))

    @contextmanager
    def listed(self) -> Iterator[None]:
        """Keeps an error of what is done inside, for `check`."""
        try:
            yield
        except (ValueError, FileNotFoundError) as error:
            self._errors.append(error)

    def check(self, *, features: bool = True) -> None:
        """Raises all that was found, if there is any; NotSimulatedError if some is not simulated.

        `features`: whether what is not simulated is an error alone, without a mistake.
        """
        missing = [error for error in self._errors if isinstance(error, FileNotFoundError)]
        # The folders where files are not are those of the first one.
        short: dict[Exception, str] = {
            error: str(error).partition(", which")[0] + ", nor there" for error in missing[1:]
        }
        texts = list(dict.fromkeys(short.get(error, str(error)) for error in self._errors))
        if self.features and (features or texts):
            raise NotSimulatedError(self.source, dict(sorted(self.features.items())), texts)
        if texts:
            kind = FileNotFoundError if len(missing) == len(self._errors) else ValueError
            raise kind("\n".join(texts))


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


def pairs_of(disabled: str | Iterable[Sequence[str]], what: str) -> tuple[bool, list[Pair]]:
    """`disable_collisions`: whether it is "overlapping", and its pairs.

    ValueError on another word, and on what is no pair of two bodies or links.
    """
    if isinstance(disabled, str):
        if disabled != OVERLAPPING:
            expected = f"expected {OVERLAPPING!r} or pairs"
            raise ValueError(f"disable_collisions is {disabled!r}, {expected}")
        return True, []
    pairs = [tuple(pair) for pair in disabled]
    for pair in pairs:
        if len(pair) != 2 or pair[0] == pair[1]:
            raise ValueError(f"disable_collisions has {pair!r}, expected pairs of two {what}")
    return False, [(pair[0], pair[1]) for pair in pairs]


@dataclass(frozen=True, eq=False)
class Additions:
    """Keywords of what is added to a scene."""

    bodies: list[dict[str, Any]]
    joints: list[dict[str, Any]]
    disabled: list[Pair] = field(default_factory=list)
    frictions: list[tuple[str, str, float, float, float]] = field(default_factory=list)
    """Coefficients of pairs of bodies."""
    planes: list[dict[str, Any]] = field(default_factory=list)
    rows: list[ReportRow] = field(default_factory=list)
    """Of the scene's report."""
    tendons: list[dict[str, Any]] = field(default_factory=list)
    loops: list[dict[str, Any]] = field(default_factory=list)
    hulls: list[str] = field(default_factory=list)
    """Bodies that collide as the convex hull of a mesh that is not convex."""
    self_collision: bool = True
    overlapping: bool = False
    """Whether all that overlap at the start never collide."""

    def add_to(self, scene: Scene, limit: Limit) -> Scene:
        """The scene with all of it; with less where it raises TimeoutError or Cancelled."""
        for what, add, items in (
            ("plane", scene.add_plane, self.planes),
            ("body", scene.add_body, self.bodies),
            ("joint", scene.add_joint, self.joints),
            ("tendon", scene.add_tendon, self.tendons),
            ("loop", scene.add_loop, self.loops),
        ):
            for keywords in items:
                name = keywords.get("name", keywords.get("body_a"))  # of a loop
                limit.require(f"{what} {name!r} was added")
                add(**keywords)
        for body_a, body_b in self.disabled:
            limit.require(f"collisions of {body_a!r} and {body_b!r} were disabled")
            scene.disable_collisions(body_a, body_b)
        for a, b, slides, torsional, rolling in self.frictions:
            scene.set_friction(a, b, slides, torsional_friction=torsional, rolling_friction=rolling)
        return scene


def added(scene: Scene | None, new: Additions, prefix: str, limit: Limit) -> Scene:
    """The scene, or a new one, with a robot; an error leaves a given scene as it was.

    Links that overlap at the start and wherever their joints are never collide; others touch. The
    scene's report tells of each.
    """
    check_names(scene, new.bodies + new.planes, new.joints)
    _warn_of_no_shape(new.bodies)
    settings = {} if scene is None else {name: getattr(scene, name) for name in SETTINGS}
    made = new.add_to(Scene(**settings), limit)
    moving = [joint for joint in new.joints if joint["type"] != "fixed"]
    driving = (tendon["joints"] for tendon in new.tendons if any(map(tendon.get, DRIVING)))
    by_tendon = {joint for joints in driving for joint in joints}
    rows = list(new.rows)
    for joint in moving:
        if not any(map(joint.get, DRIVING)) and joint["name"] not in by_tendon:
            rows.append(ReportRow(reports.UNDRIVEN, joint["name"]))
        elif joint.get("stiffness") and not joint.get("held") and joint.get("target") is None:
            start = f"{joint.get('start', 0.0):.4g}, for want of a target"
            rows.append(ReportRow(reports.HOLDS, joint["name"], start))
    rows[len(new.rows) :] = sorted(rows[len(new.rows) :], key=lambda row: row.what == reports.HOLDS)
    if new.self_collision and moving:
        limit.require("links that overlap were looked for")
        world = World(made)
        depths = _overlaps(world)
        never = depths.keys() if new.overlapping else _always(world, depths, limit)
        for pair in never:
            new.disabled.append(pair)
            made.disable_collisions(*pair)
        for kind, pairs in ((reports.APART, never), (reports.TOUCHING, depths.keys() - never)):
            found = {pair: f"{1e3 * depths[pair]:.3g} mm" for pair in sorted(pairs)}
            rows += [ReportRow(kind, " and ".join(pair), depth) for pair, depth in found.items()]
            if not new.overlapping:
                _warn_of_overlaps(kind, found, prefix)
        if new.hulls:
            _warn_of_hulls(World(made), new.hulls, prefix, limit)
    limit.require("the scene was made")
    whole = made if scene is None else new.add_to(scene, Limit())
    reports.add_rows(whole, rows)
    return whole


def check_names(
    scene: Scene | None, bodies: Sequence[Mapping[str, Any]], joints: Sequence[Mapping[str, Any]]
) -> None:
    """Raises ValueError on keywords of a body or a joint whose name the scene has."""
    for what, there, added in (
        ("body", scene.bodies if scene else (), bodies),
        ("joint", scene.joints if scene else (), joints),
    ):
        taken = {item.name for item in there}
        for name in (keywords["name"] for keywords in added):
            if name in taken:
                raise ValueError(f"the scene has a {what} {name!r}; prefix=... gives other names")


def _overlaps(world: World, state: Floats | None = None) -> dict[Pair, float]:
    """How deep [m] links overlap each other, or fixed bodies, in a state, by default the start.

    What moves apart from a link, as an object in a gripper, touches it: that is a contact.
    """
    robot = world.scene
    carriers = {joint.child: joint.parent for joint in robot.joints}
    fixed = {body.name for body in robot.bodies if body.fixed}
    depths: dict[Pair, float] = {}
    for contact in world.contacts(robot.pack() if state is None else state):
        a, b = contact.body_a, contact.body_b
        together = base_of(a, carriers) == base_of(b, carriers) or {a, b} & fixed
        if together and {a, b} & carriers.keys() and -contact.distance > OVERLAP:
            depths[a, b] = max(depths.get((a, b), 0.0), -contact.distance)
    return dict(sorted(depths.items()))


def _always(world: World, pairs: Iterable[Pair], limit: Limit) -> set[Pair]:
    """Those of pairs that overlap wherever the robot's joints are, within their limits."""
    left = set(pairs)
    for state in _poses(world.scene, limit) if left else ():
        left = {pair for pair in left if world.distance(state, *pair) < -OVERLAP}
    return left


def _poses(robot: Scene, limit: Limit) -> Iterator[Floats]:
    """States, each of shape (n,), with the robot's joints at random within their limits."""
    random = np.random.default_rng(0)
    moving = [j for j in robot.joints if j.type != "fixed" and j.mimic is None and not j.held]
    ends = np.clip([j.limits for j in moving], -math.pi, math.pi).reshape(-1, 2)
    names = [joint.name for joint in moving]
    for _ in range(POSES):
        limit.require("links that overlap in other poses were looked for")
        yield robot.pack(joints=dict(zip(names, random.uniform(*ends.T), strict=True)))


def _warn_of_hulls(world: World, hulls: Collection[str], prefix: str, limit: Limit) -> None:
    """Warns of links that the hull of another one may keep from moving."""
    counts: Counter[Pair] = Counter()
    for state in _poses(world.scene, limit):
        counts.update(list(_overlaps(world, state)))
    for pair in [pair for pair, n in counts.items() if n > BLOCKED * POSES and {*pair} & {*hulls}]:
        first, second = sorted(pair, key=lambda name: name not in hulls)
        hull, other = first.removeprefix(prefix), second.removeprefix(prefix)
        text = f"{hull!r} collides as the convex hull of its mesh, which fills its hollows, and "
        text += f"overlaps {other!r} in {counts[pair] / POSES:.0%} of the poses of the joints: "
        way = "decompose=True makes convex parts of it, "
        way += f"disable_collisions=[{(hull, other)}] lets them pass through each other."
        warn([(text, text + way)], text)


def base_of(body: str, carriers: dict[str, str]) -> str:
    """The body at the end of the chain that carries one; `carriers`: by body, what carries it, or
    what carries that: ways up are made shorter."""
    while body in carriers:
        carriers[body] = carriers.get(carriers[body], carriers[body])
        body = carriers[body]
    return body


def _warn_of_no_shape(bodies: Sequence[Mapping[str, Any]]) -> None:
    """Warns of a robot that passes through everything."""
    shapes = [body["shape"] for body in bodies]
    if shapes and all(isinstance(shape, Compound) and not shape.parts for shape in shapes):
        names = ", ".join(repr(body["name"]) for body in bodies[:NAMED])
        more = ", ..." if len(bodies) > NAMED else ""
        text = f"none of the file's {len(bodies)} bodies collides with anything: {names}{more}"
        why = "has it visuals alone, or geoms with contype and conaffinity of 0?"
        warn([(text, f"{text}; {why}")], text)


def _warn_of_overlaps(kind: str, depths: Mapping[Pair, str], prefix: str) -> None:
    """Warns of links that overlap at the start, and says what becomes of them."""
    if not depths:
        return
    deep = {(a.removeprefix(prefix), b.removeprefix(prefix)): d for (a, b), d in depths.items()}
    found = ", ".join(f"{a!r} and {b!r} by {depth}" for (a, b), depth in deep.items())
    text = f"links overlap wherever their joints are: {found}. They never collide"
    if kind == reports.TOUCHING:
        text = f"links overlap at the start: {found}. They touch, and are pressed apart; where "
        text += "they are too deep in each other for that, joints={name: {'start': ...}} "
        text += "starts them apart"
    warn([(text, f"{text}; disable_collisions={list(deep)} says that they never collide.")], text)
