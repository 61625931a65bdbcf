"""More problems whose effort of escape is known on paper: the least work is a potential difference.

Each is a machine that stores what the disturbance does: in weights, in a counterweight, in two
joints. The answer is the work of infinitely slow motion up to the barrier.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from known_answers import GRAVITY, KnownAnswer, ball_problem, ramp, tray
from scipy.optimize import minimize_scalar

from energymargin import regions
from energymargin._core import Box, Capsule, Compound, Part, Problem, Scene, Sphere

__all__ = ["BARRIERS"]

RADIUS, MASS = 0.015, 0.05  # m, kg: of the balls
WEIGHT = MASS * GRAVITY  # N
STILL = (0.0, 0.0, 0.0)
LINK_RADIUS = 0.006  # m, of the finger


def _counterweight() -> KnownAnswer:
    rim, share = 0.03, 0.6  # m, and of the ball's weight that the counterweight holds
    scene, inside, height = tray(rim)
    return KnownAnswer(
        "counterweight",
        "a ball in a tray, most of whose weight a counterweight holds, is lifted over the rim",
        "(m - c) g h",
        ball_problem(scene, height, inside, counterweight=share * WEIGHT),
        (1.0 - share) * WEIGHT * rim,
        planar=False,
    )


def _ring() -> KnownAnswer:
    inner, thick, sides, top = 0.1, 0.01, 144, math.radians(60.0)  # m, m, of a full circle, rad
    turn = 2.0 * math.pi / sides
    length = 2.0 * (inner + thick) * math.tan(turn / 2)
    plates = []
    for angle in turn * np.arange(-sides // 4, sides // 4 + 1):
        place = (inner + thick / 2) * np.array([math.sin(angle), 0.0, -math.cos(angle)])
        half = (0.0, -math.sin(angle / 2), 0.0, math.cos(angle / 2))
        plates.append(Part(Box((length, 0.1, thick)), tuple(place), half))
    scene = _scene()
    scene.add_body("ring", Compound(plates), mass=0.0, friction=0.0)
    way = inner - RADIUS  # m, from the ring's middle to the ball's
    _add_ball(scene, (0.0, 0.0, -way))
    problem = Problem(
        scene,
        scene.pack(),
        force=(2.0 * WEIGHT, 0.0, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=regions.HalfSpace("ball", (0.0, 0.0, 1.0), -way * math.cos(top)),
    )
    return KnownAnswer(
        "ring",
        "a ball is pushed up the inside of a ring",
        "m g (R - r)(1 - cos θ)",
        problem,
        WEIGHT * way * (1.0 - math.cos(top)),
        planar=True,
    )


def _lid() -> KnownAnswer:
    gap, way, lid = 0.01, 0.03, 0.1  # m below the lid, m up to the way out, kg
    thick, width, tall = 0.01, 0.08, 0.12  # m, of the box
    wall = Box((thick, width, tall))
    scene = _scene()
    walls = [Part(wall, (side * (width + thick) / 2, 0.0, tall / 2)) for side in (-1, 1)]
    floor = Part(Box((width + 2 * thick, width, thick)), (0.0, 0.0, -thick / 2))
    scene.add_body("box", Compound([floor, *walls]), mass=0.0, friction=0.0)
    scene.add_body("lid", Box((0.9 * width, width, thick)), mass=lid, friction=0.0)
    scene.add_joint(
        "rail",
        type="prismatic",
        parent="box",
        child="lid",
        origin=(0.0, 0.0, 2 * RADIUS + gap + thick / 2),
        limits=(0.0, 0.1),
    )
    _add_ball(scene, (0.0, 0.0, RADIUS))
    force = 2.0 * (MASS + lid) * GRAVITY
    problem = Problem(
        scene,
        scene.pack(),
        force=(force, 0.0, force),
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=regions.HalfSpace("ball", (0.0, 0.0, 1.0), RADIUS + way),
    )
    return KnownAnswer(
        "lid",
        "a ball in a box lifts the box's lid",
        "m g h + M g (h - gap)",
        problem,
        WEIGHT * way + lid * GRAVITY * (way - gap),
        planar=True,
    )


def _hump() -> KnownAnswer:
    slope, length, thick, flat = math.radians(20.0), 0.08, 0.01, 0.1  # rad, m, m, m
    rise, reach = length * math.sin(slope), length * math.cos(slope)
    parts = [Part(Box((flat + 2 * thick, 0.1, thick)), (0.0, 0.0, -thick / 2))]
    for turn in (0.0, math.pi):
        side = ramp(turn, slope, (length, 0.1, thick))
        shift = np.array([math.cos(turn) * flat / 2, 0.0, 0.0])
        parts.append(Part(side.shape, tuple(np.array(side.position) + shift), side.orientation))
    scene = _scene()
    scene.add_body("ground", Compound(parts), mass=0.0, friction=0.0)
    _add_ball(scene, (0.0, 0.0, RADIUS))
    top = flat / 2 + reach
    problem = Problem(
        scene,
        scene.pack(),
        force=(2.0 * WEIGHT * math.tan(slope), 0.0, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=regions.Box("ball", center=(0.0, 0.0, 0.0), size=(2 * top, 1.0, 1.0)),
    )
    return KnownAnswer(
        "hump",
        "a ball is pushed from a hollow over a hump",
        "m g h",
        problem,
        WEIGHT * rise,
        planar=True,
    )


def _two_link_finger() -> KnownAnswer:
    (first, second), lean = (0.08, 0.06), math.radians(45.0)  # m, of the links; rad, of the second
    stiffness, way, side = (0.4, 0.3), 0.02, 0.04  # N m/rad, m, m
    tip = (side / 2 + LINK_RADIUS, 0.0)
    base = (tip[0] + second * math.sin(lean), -first - second * math.cos(lean), 0.0)
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body("hand", Box((0.02, 0.02, 0.02)), mass=0.0, position=base)
    _add_link(
        scene, "proximal", "hand", length=first, origin=STILL, lean=0.0, stiffness=stiffness[0]
    )
    _add_link(
        scene,
        "distal",
        "proximal",
        length=second,
        origin=(0.0, first / 2, 0.0),
        lean=lean,
        stiffness=stiffness[1],
    )
    scene.add_body(
        "part",
        Box((side, side, side)),
        mass=0.1,
        friction=0.0,
        role="object",
        linear_factor=(1.0, 1.0, 0.0),
        angular_factor=(0.0, 0.0, 0.0),
    )
    problem = Problem(
        scene,
        scene.pack(),
        force=(2.0, 0.0, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=regions.HalfSpace("part", normal=(1.0, 0.0, 0.0), offset=way),
    )

    def energy(q: float) -> float:
        """Energy of both joints [J] with the tip `way` farther, and the first joint at q [rad]."""
        reach = second * math.sin(lean) - way - first * math.sin(q)
        other = math.asin(reach / second) - lean - q
        return 0.5 * (stiffness[0] * q**2 + stiffness[1] * other**2)

    least = minimize_scalar(energy, bounds=(-0.5, 0.0), method="bounded", options={"xatol": 1e-9})
    return KnownAnswer(
        "two-link finger",
        "a part is pushed against the tip of a finger, both of whose joints give way",
        "min (k₁ q₁² + k₂ q₂²)/2, x(q) = x₀ + d",
        problem,
        float(least.fun),
        planar=True,
    )


def _add_link(
    scene: Scene,
    name: str,
    parent: str,
    *,
    length: float,
    origin: tuple[float, float, float],
    lean: float,
    stiffness: float,
) -> None:
    """A capsule along y, which hangs on its parent by its lower end."""
    along_y = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    link = Compound([Part(Capsule(LINK_RADIUS, length), (0.0, 0.0, 0.0), along_y)])
    scene.add_body(name, link, mass=0.02, friction=0.0, role="effector")
    scene.add_joint(
        f"{name} joint",
        parent=parent,
        child=name,
        origin=origin,
        orientation=(0.0, 0.0, math.sin(lean / 2), math.cos(lean / 2)),
        child_origin=(0.0, -length / 2, 0.0),
        stiffness=stiffness,
        torque_limit=10.0,
    )


def _scene() -> Scene:
    return Scene(gravity=(0.0, 0.0, -GRAVITY))


def _add_ball(scene: Scene, position: tuple[float, float, float]) -> None:
    """One that moves in the plane y = 0."""
    scene.add_body(
        "ball",
        Sphere(RADIUS),
        mass=MASS,
        position=position,
        friction=0.0,
        role="object",
        linear_factor=(1.0, 0.0, 1.0),
        angular_factor=(0.0, 1.0, 0.0),
    )


BARRIERS: dict[str, Callable[[], KnownAnswer]] = {
    "two-link finger": _two_link_finger,
    "counterweight": _counterweight,
    "ring": _ring,
    "lid": _lid,
    "hump": _hump,
}
