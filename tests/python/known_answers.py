"""Problems whose effort of escape is known on paper.

Each is a small machine with one barrier: friction work, a rim, an edge, a spring. The answer is the
least work that a disturbance has to do, in the limit of infinitely slow motion at the barrier. All
have the default stepping (240 Hz, 50 iterations).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from energymargin import regions
from energymargin._core import Box, Compound, Part, Problem, Scene, Sphere

__all__ = ["KNOWN", "KnownAnswer", "ball_problem", "known_answers", "ramp", "tray"]

GRAVITY = 9.81  # m/s^2


@dataclass(frozen=True)
class KnownAnswer:
    """A problem and its effort of escape in closed form."""

    name: str
    text: str
    """What has to happen, in a few words."""
    formula: str
    problem: Problem
    answer: float
    """Effort of escape [J]; inf for a cage."""
    planar: bool
    """The least-effort way out lies in a plane."""
    timed: bool = False
    """It has to be out within a horizon."""


def known_answers(
    names: list[str] | None = None, of: Mapping[str, Callable[[], KnownAnswer]] | None = None
) -> list[KnownAnswer]:
    """All problems, or those of these names; by default without those of `timed_answers`. Raises
    ValueError on an unknown name."""
    of = KNOWN if of is None else of
    for name in names or ():
        if name not in of:
            raise ValueError(f"problems has {name!r}, expected some of {', '.join(of)}")
    return [of[name]() for name in names or of]


def _scene() -> Scene:
    return Scene(gravity=(0.0, 0.0, -GRAVITY))


MASS, FRICTION, RADIUS = 0.5, 0.4, 0.05  # kg, 1, m: of the block, and of the disc around it
FRICTION_WORK = FRICTION * MASS * GRAVITY * RADIUS  # J


def _block(speed: float) -> Problem:
    scene = _scene()
    scene.add_plane("table", friction=1.0)
    scene.add_body(
        "block",
        Box((0.1, 0.06, 0.04)),
        mass=MASS,
        position=(0.0, 0.0, 0.02),
        velocity=(speed, 0.0, 0.0),
        friction=FRICTION,
        role="object",
    )
    return Problem(
        scene,
        scene.pack(),
        force=(3.0, 3.0, 0.0),
        torque=(0.0, 0.0, 0.05),
        duration=0.5,
        captured=regions.Disc("block", center=(0.0, 0.0), radius=RADIUS),
    )


def _push() -> KnownAnswer:
    return KnownAnswer(
        "push",
        "a block at rest on a rough table is pushed out of a disc",
        "μ m g R",
        _block(0.0),
        FRICTION_WORK,
        planar=True,
    )


def _moving() -> KnownAnswer:
    speed = math.sqrt(FRICTION * GRAVITY * RADIUS)  # half of what carries it out
    return KnownAnswer(
        "moving",
        "the same block, already on its way, but too slow",
        "μ m g R - m v²/2",
        _block(speed),
        FRICTION_WORK - 0.5 * MASS * speed**2,
        planar=True,
    )


def _leaving() -> KnownAnswer:
    return KnownAnswer(
        "leaving",
        "the same block, fast enough to slide out by itself",
        "0",
        _block(0.75),
        0.0,
        planar=True,
    )


BALL_RADIUS, BALL_MASS = 0.015, 0.05  # m, kg
BALL_FORCE = (1.0, 1.0, 1.0)  # N: twice its weight


def ball_problem(
    scene: Scene, height: float, captured: regions.Region, counterweight: float = 0.0
) -> Problem:
    """A ball at a height [m] above the origin; `counterweight` [N] pulls it up."""
    scene.add_body(
        "ball",
        Sphere(BALL_RADIUS),
        mass=BALL_MASS,
        position=(0.0, 0.0, height),
        friction=0.5,
        role="object",
        force=(0.0, 0.0, counterweight),
    )
    return Problem(
        scene,
        scene.pack(),
        force=BALL_FORCE,
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=captured,
    )


def tray(rim: float) -> tuple[Scene, regions.Region, float]:
    """A square tray with a rim of this height [m], its inside, and the height of a ball in it."""
    width, thick = 0.1, 0.01  # m
    across, along = (thick, width, rim), (width, thick, rim)
    middle, height = (width - thick) / 2, thick + rim / 2
    parts = [
        Part(Box((width, width, thick)), (0.0, 0.0, thick / 2)),
        *(Part(Box(across), (side * middle, 0.0, height)) for side in (-1, 1)),
        *(Part(Box(along), (0.0, side * middle, height)) for side in (-1, 1)),
    ]
    scene = _scene()
    scene.add_body("tray", Compound(parts), mass=0.0, friction=0.5)
    inside = regions.Box("ball", center=(0.0, 0.0, 0.0), size=(width - thick, width - thick, 1.0))
    return scene, inside, thick + BALL_RADIUS


def _rim() -> KnownAnswer:
    rim = 0.03  # m
    scene, inside, height = tray(rim)
    return KnownAnswer(
        "rim",
        "a ball in a tray is lifted over the tray's rim",
        "m g h",
        ball_problem(scene, height, inside),
        BALL_MASS * GRAVITY * rim,
        planar=False,
    )


def _bowl() -> KnownAnswer:
    slope, length, thick = math.radians(30.0), 0.1, 0.01  # rad, m, m
    reach, top = length * math.cos(slope), length * math.sin(slope)
    turns = (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)
    plates = [ramp(turn, slope, (length, 2 * reach, thick)) for turn in turns]
    scene = _scene()
    scene.add_body("bowl", Compound(plates), mass=0.0, friction=0.5)
    bottom = BALL_RADIUS / math.cos(slope)
    inside = regions.Box("ball", center=(0.0, 0.0, 0.0), size=(2 * reach, 2 * reach, 1.0))
    return KnownAnswer(
        "bowl",
        "a ball at the bottom of a four-sided bowl gets out over its edge",
        "m g h",
        ball_problem(scene, bottom, inside),
        BALL_MASS * GRAVITY * (top + BALL_RADIUS - bottom),
        planar=False,
    )


def ramp(turn: float, slope: float, size: tuple[float, float, float]) -> Part:
    """A plate whose upper side rises from the origin at an angle, to a direction in the plane."""
    length, _, thick = size
    out = length / 2 * math.cos(slope) + thick / 2 * math.sin(slope)
    up = length / 2 * math.sin(slope) - thick / 2 * math.cos(slope)
    place = (out * math.cos(turn), out * math.sin(turn), up)
    return Part(Box(size), place, _turned(turn, -slope))


def _turned(yaw: float, pitch: float) -> tuple[float, float, float, float]:
    """Quaternion of a turn by `pitch` about y and then by `yaw` about z."""
    cz, sz, cy, sy = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    return (-sz * sy, cz * sy, sz * cy, cz * cy)


def _edge() -> KnownAnswer:
    width, height, mass = 0.1, 0.2, 0.3  # m, m, kg
    scene = _scene()
    scene.add_plane("table", friction=1.0)
    scene.add_body(
        "box",
        Box((width, 0.1, height)),
        mass=mass,
        position=(0.0, 0.0, height / 2),
        friction=1.0,
        role="object",
        linear_factor=(1.0, 0.0, 1.0),
        angular_factor=(0.0, 1.0, 0.0),
    )
    upright = (0.0, 0.0, 1.0)
    problem = Problem(
        scene,
        scene.pack(),
        force=(3.0, 0.0, 3.0),
        torque=(0.0, 0.2, 0.0),
        duration=0.5,
        captured=regions.Tilt(
            "box", axis=upright, reference=upright, limit=math.atan(width / height)
        ),
    )
    return KnownAnswer(
        "edge",
        "a box is tipped over its edge, to where it falls by itself",
        "m g (√(w² + h²) - h)/2",
        problem,
        mass * GRAVITY * (math.hypot(width, height) - height) / 2,
        planar=True,
    )


def _notch() -> KnownAnswer:
    slope, length, thick = math.radians(45.0), 0.03, 0.01  # rad, m, m
    radius, mass, stiffness, rest = 0.01, 0.05, 100.0, 0.1  # m, kg, N/m, m
    reach, top = length * math.cos(slope), length * math.sin(slope) + radius
    sides = [ramp(turn, slope, (length, 0.1, thick)) for turn in (0.0, math.pi)]
    scene = _scene()
    scene.add_body("notch", Compound(sides), mass=0.0, friction=0.0)
    bottom = radius / math.cos(slope)
    scene.add_body(
        "part",
        Sphere(radius),
        mass=mass,
        position=(0.0, 0.0, bottom),
        friction=0.0,
        role="object",
        linear_factor=(1.0, 0.0, 1.0),
        angular_factor=(0.0, 1.0, 0.0),
    )
    scene.add_spring("notch", "part", stiffness=stiffness, rest_length=rest, point_a=(0, 0, -rest))
    problem = Problem(
        scene,
        scene.pack(),
        force=(8.0, 0.0, 8.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=regions.Box("part", center=(0.0, 0.0, 0.0), size=(2 * reach, 1.0, 1.0)),
    )

    def energy(x: float, z: float) -> float:
        return 0.5 * stiffness * (math.hypot(x, z + rest) - rest) ** 2 + mass * GRAVITY * z

    return KnownAnswer(
        "notch",
        "a part that a spring pulls into a notch is pushed out of it",
        "k (s₁² - s₀²)/2 + m g h",
        problem,
        energy(reach, top) - energy(0.0, bottom),
        planar=True,
    )


def _finger() -> KnownAnswer:
    stiffness, way, mass = 200.0, 0.03, 0.2  # N/m, m, kg
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body("hand", Box((0.02, 0.1, 0.04)), mass=0.0, position=(0.15, 0.0, 0.0))
    scene.add_body("finger", Box((0.02, 0.1, 0.04)), mass=0.05, role="effector")
    scene.add_joint(
        "slide",
        type="prismatic",
        parent="hand",
        child="finger",
        origin=(-0.1, 0.0, 0.0),
        axis=(-1.0, 0.0, 0.0),
        limits=(-0.08, 0.05),
        stiffness=stiffness,
        torque_limit=100.0,
    )
    scene.add_body(
        "part",
        Box((0.04, 0.04, 0.04)),
        mass=mass,
        position=(0.02, 0.0, 0.0),
        friction=0.0,
        role="object",
        linear_factor=(1.0, 1.0, 0.0),
        angular_factor=(0.0, 0.0, 1.0),
    )
    problem = Problem(
        scene,
        scene.pack(),
        force=(8.0, 0.0, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=regions.HalfSpace("part", normal=(1.0, 0.0, 0.0), offset=0.02 + way),
    )
    return KnownAnswer(
        "finger",
        "a part is pushed against a compliant finger, whose joint gives way",
        "k d²/2",
        problem,
        0.5 * stiffness * way**2,
        planar=True,
    )


def _cage() -> KnownAnswer:
    width, thick = 0.1, 0.01  # m
    walls = []
    for axis in range(3):
        for side in (-1, 1):
            size, place = [width] * 3, [0.0] * 3
            size[axis], place[axis] = thick, side * (width - thick) / 2
            walls.append(Part(Box(size), place))
    scene = _scene()
    scene.add_body("cage", Compound(walls), mass=0.0, friction=0.5)
    inside = regions.Box("ball", center=(0.0, 0.0, 0.0), size=(width, width, width))
    return KnownAnswer(
        "cage",
        "a ball in a closed box",
        "∞",
        ball_problem(scene, -width / 2 + thick + BALL_RADIUS, inside),
        math.inf,
        planar=False,
    )


KNOWN: dict[str, Callable[[], KnownAnswer]] = {
    "push": _push,
    "moving": _moving,
    "edge": _edge,
    "notch": _notch,
    "finger": _finger,
    "rim": _rim,
    "bowl": _bowl,
    "leaving": _leaving,
    "cage": _cage,
}
