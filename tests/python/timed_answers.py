"""Problems with a horizon whose effort of escape is known on paper.

A body has to be out within a time T. Of all pushes that lead as far, the earliest leave the least
speed, so the cheapest one is as strong as the bounds let it be, starts at once, lasts for

    t = T - sqrt(T² - 2 d / a),    with a the acceleration and d the way that is left to it,

and then lets the body coast to where it is out, at T. Its work is the kinetic energy that it gives,
plus what friction, gravity or a spring take on the way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import reduce
from operator import and_, or_
from typing import Any

import numpy as np
from known_answers import FRICTION, GRAVITY, KnownAnswer

from energymargin import regions
from energymargin._core import Box, Plan, Problem, Scene

__all__ = ["TIMED"]

WAY, HORIZON, LONGEST = 0.2, 1.0, 0.3  # m, s, s: of all but a few
SIDE = 0.1  # m, of the bodies
STILL = (0.0, 0.0, 0.0)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def push_time(acceleration: float, way: float, horizon: float) -> float:
    """Least time [s] of a push from the start on that leads `way` [m] far within the horizon."""
    return horizon - math.sqrt(horizon**2 - 2 * way / acceleration)


def _kinetic(mass: float, speed: float) -> float:
    return 0.5 * mass * speed**2


def _scene(gravity: Sequence[float] = STILL, **body: Any) -> Scene:
    scene = Scene(gravity=gravity)
    _add(scene, "block", **body)
    return scene


def _add(scene: Scene, name: str, **body: Any) -> None:
    settings = {"mass": 1.0, "role": "object", "linear_factor": X, "angular_factor": STILL}
    scene.add_body(name, Box((SIDE, SIDE, SIDE)), **{**settings, **body})


def _problem(
    scene: Scene,
    force: Sequence[float],
    captured: regions.Region,
    horizon: float = HORIZON,
    **settings: Any,
) -> Problem:
    return Problem(
        scene,
        scene.pack(),
        force=force,
        torque=settings.pop("torque", STILL),
        duration=LONGEST,
        captured=captured,
        horizon=horizon,
        **settings,
    )


def _beyond(way: float, name: str = "block", normal: Sequence[float] = X) -> regions.Region:
    return regions.HalfSpace(name, normal=normal, offset=way)


def _answer(
    name: str, text: str, formula: str, problem: Problem, answer: float, *, planar: bool = True
) -> KnownAnswer:
    return KnownAnswer(name, text, formula, problem, answer, planar=planar, timed=True)


def _in_time() -> KnownAnswer:
    time = push_time(1.0, WAY, HORIZON)
    return _answer(
        "in time",
        "a block in space, with more force than it takes",
        "F² t²/2m",
        _problem(_scene(), X, _beyond(WAY)),
        _kinetic(1.0, time),
    )


def _barely() -> KnownAnswer:
    force = 0.5
    time = push_time(force, WAY, HORIZON)
    return _answer(
        "barely",
        "the same with just enough force",
        "F² t²/2m",
        _problem(_scene(), (force, 0.0, 0.0), _beyond(WAY)),
        _kinetic(1.0, force * time),
    )


def _corner() -> KnownAnswer:
    force = math.sqrt(2.0)  # along the diagonal, where both axes push
    disc = regions.Disc("block", center=(0.0, 0.0), radius=WAY)
    return _answer(
        "corner",
        "the same in a plane: along the diagonal, where both axes push, it is cheapest",
        "F² t²/m, a = √2 F/m",
        _problem(_scene(linear_factor=(1.0, 1.0, 0.0)), (1.0, 1.0, 0.0), disc),
        _kinetic(1.0, force * push_time(force, WAY, HORIZON)),
    )


def _space() -> KnownAnswer:
    force = math.sqrt(3.0)
    ball = regions.Ball("block", center=STILL, radius=WAY)
    return _answer(
        "space",
        "the same in space",
        "3 F² t²/2m, a = √3 F/m",
        _problem(_scene(linear_factor=(1.0, 1.0, 1.0)), (1.0, 1.0, 1.0), ball),
        _kinetic(1.0, force * push_time(force, WAY, HORIZON)),
        planar=False,
    )


def _table(force: float, horizon: float) -> Problem:
    scene = Scene(gravity=(0.0, 0.0, -GRAVITY))
    scene.add_plane("table", friction=1.0)
    _add(
        scene,
        "block",
        position=(0.0, 0.0, SIDE / 2),
        friction=FRICTION,
        linear_factor=(1.0, 0.0, 1.0),
    )
    return _problem(scene, (force, 0.0, 0.0), _beyond(WAY), horizon)


def _sliding() -> KnownAnswer:
    force, horizon, friction = 10.0, 0.3, FRICTION * GRAVITY
    time = push_time(force, WAY + 0.5 * friction * horizon**2, horizon)
    return _answer(
        "sliding",
        "a block on a rough table, faster than it would have to be",
        "m (F t/m - μ g T)²/2 + μ m g d",
        _table(force, horizon),
        _kinetic(1.0, force * time - friction * horizon) + friction * WAY,
    )


def _unhurried() -> KnownAnswer:
    return _answer(
        "unhurried",
        "the same with time enough: it may stop where it is out",
        "μ m g d",
        _table(10.0, 2.0),
        FRICTION * GRAVITY * WAY,
    )


def _lifted() -> KnownAnswer:
    force, horizon = 20.0, 0.25
    time = push_time(force, WAY + 0.5 * GRAVITY * horizon**2, horizon)
    scene = _scene((0.0, 0.0, -GRAVITY), linear_factor=Z)
    return _answer(
        "lifted",
        "a block is lifted against gravity",
        "m (F t/m - g T)²/2 + m g d",
        _problem(scene, (0.0, 0.0, force), _beyond(WAY, normal=Z), horizon),
        _kinetic(1.0, force * time - GRAVITY * horizon) + GRAVITY * WAY,
    )


def _moving(speed: float) -> tuple[Problem, float]:
    """The block that has a speed, and the speed [m/s] with which it has to come out."""
    problem = _problem(_scene(velocity=(speed, 0.0, 0.0)), X, _beyond(WAY))
    return problem, speed + push_time(1.0, WAY - speed * HORIZON, HORIZON)


def _hurried() -> KnownAnswer:
    problem, last = _moving(0.1)
    return _answer(
        "hurried",
        "a block on its way out, but too slow",
        "m ((v + F t/m)² - v²)/2",
        problem,
        _kinetic(1.0, last) - _kinetic(1.0, 0.1),
    )


def _turned_back() -> KnownAnswer:
    problem, last = _moving(-0.1)
    return _answer(
        "turned back",
        "a block on its way to the other side; to brake it is work too",
        "m ((v + F t/m)² + v²)/2",
        problem,
        _kinetic(1.0, last) + _kinetic(1.0, 0.1),
    )


def _sprung() -> KnownAnswer:
    stiffness, force, rest = 1.0, 1.0, 1.0  # N/m, N, m; the mass is 1 kg, so 1 rad/s
    scene = _scene()
    scene.add_body("wall", Box((SIDE,) * 3), mass=0.0, position=(-rest, 0.0, 0.0))
    scene.add_spring("wall", "block", stiffness=stiffness, rest_length=rest)
    # A push for t leads to F/k (cos w(T - t) - cos w T) at T.
    turn = HORIZON - math.acos(WAY * stiffness / force + math.cos(HORIZON))
    return _answer(
        "sprung",
        "a spring pulls the block back",
        "F² (1 - cos ω t)/k, t = T - acos(k d/F + cos ω T)/ω",
        _problem(scene, (force, 0.0, 0.0), _beyond(WAY)),
        force**2 / stiffness * (1 - math.cos(turn)),
    )


def _spun() -> KnownAnswer:
    torque, angle = 0.01, 1.0  # N m, rad
    inertia = SIDE**2 / 6  # kg m^2
    scene = _scene(linear_factor=STILL, angular_factor=Z)
    captured = regions.Tilt("block", axis=X, reference=X, limit=angle)
    problem = _problem(scene, STILL, captured, torque=(0.0, 0.0, torque))
    acceleration = torque / inertia
    return _answer(
        "spun",
        "a block is turned about an axis",
        "M² t²/2I",
        problem,
        _kinetic(inertia, acceleration * push_time(acceleration, angle, HORIZON)),
    )


def _carried() -> KnownAnswer:
    speed = 0.1  # m/s
    scene = _scene()
    _add(scene, "hand", position=(0.0, 0.0, 0.3), role="effector")
    rows = np.zeros((round(HORIZON / scene.step), 6))
    rows[:, 0] = speed
    plan = Plan(step=scene.step, velocities={"hand": rows}, limits={"hand": (1e3, 1e3)})
    captured = regions.HalfSpace("block", normal=(-1.0, 0.0, 0.0), offset=WAY, frame="hand")
    return _answer(
        "carried",
        "a hand goes away by a plan, and helps",
        "F² t²/2m, with d - V T",
        _problem(scene, X, captured, plan=plan),
        _kinetic(1.0, push_time(1.0, WAY - speed * HORIZON, HORIZON)),
    )


MASSES = (1.0, 2.0)  # kg


def _blocks(
    join: Callable[[regions.Region, regions.Region], regions.Region],
) -> tuple[Problem, list[float]]:
    """Two blocks, and the least work of each."""
    scene = Scene(gravity=STILL)
    names = [f"block {i}" for i in range(len(MASSES))]
    for i, (name, mass) in enumerate(zip(names, MASSES, strict=True)):
        _add(scene, name, mass=mass, position=(0.0, float(i), 0.0))
    captured = reduce(join, [_beyond(WAY, name) for name in names])
    works = [
        _kinetic(mass, force / mass * push_time(force / mass, WAY, HORIZON))
        for mass, force in zip(MASSES, (2.0, 2.0), strict=True)
    ]
    return _problem(scene, (2.0, 0.0, 0.0), captured), works


def _either() -> KnownAnswer:
    problem, works = _blocks(and_)
    return _answer("either", "one of two blocks, the lighter", "F² t²/2m", problem, min(works))


def _both() -> KnownAnswer:
    problem, works = _blocks(or_)
    return _answer("both", "both blocks", "Σ F² t²/2m", problem, sum(works))


TIMED: dict[str, Callable[[], KnownAnswer]] = {
    "in time": _in_time,
    "barely": _barely,
    "corner": _corner,
    "space": _space,
    "sliding": _sliding,
    "unhurried": _unhurried,
    "lifted": _lifted,
    "hurried": _hurried,
    "turned back": _turned_back,
    "sprung": _sprung,
    "spun": _spun,
    "carried": _carried,
    "either": _either,
    "both": _both,
}
