"""Small scenes, each with one cause of error in the energy, undisturbed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from energymargin._core import Audit, Box, Scene, Sphere, World

__all__ = ["CAUSES", "ERRORS", "Cause", "to_markdown"]

GRAVITY = 9.81  # m/s^2
NONE = (0.0, 0.0, 0.0)
ERRORS = ("contacts", "integration", "overlap", "leftover")  # of an audit


@dataclass(frozen=True)
class Cause:
    """One scene."""

    name: str
    scale: float
    """The energy that its errors are compared with [J]."""
    seconds: float
    build: Callable[[float, int], Scene]
    """From the step [s] and the number of solver iterations; it starts as it is built."""

    def audit(self, step: float, iterations: int) -> Audit:
        """Of one rollout without a disturbance."""
        scene = self.build(step, iterations)
        rollout = World(scene).rollout(scene.pack(), np.zeros(6), self.seconds, audit=True)
        assert rollout.audit is not None  # it was asked for
        return rollout.audit


def _fall(step: float, iterations: int) -> Scene:
    scene = Scene(step=step, solver_iterations=iterations)
    scene.add_body("ball", Sphere(0.05), mass=1.0, role="object")
    return scene


def _spin(step: float, iterations: int) -> Scene:
    scene = Scene(gravity=NONE, step=step, solver_iterations=iterations)
    spin = (0.1, 20.0, 0.1)  # rad/s, about the axis of the middle moment: it turns over
    box = Box((0.05, 0.1, 0.2))
    scene.add_body("box", box, mass=1.0, angular_velocity=spin, role="object")
    return scene


def _spring(step: float, iterations: int) -> Scene:
    scene = Scene(gravity=NONE, step=step, solver_iterations=iterations)
    scene.add_body("post", Box((0.02, 0.02, 0.02)), mass=0)
    scene.add_body(
        "ball", Sphere(0.05), mass=1.0, position=(0, 0, 0.3), velocity=(1, 0, 0), role="object"
    )
    scene.add_spring("post", "ball", stiffness=200.0, rest_length=0.3)
    return scene


def _stiff_joint(step: float, iterations: int) -> Scene:
    scene = Scene(gravity=NONE, step=step, solver_iterations=iterations)
    scene.add_body("post", Box((0.02, 0.02, 0.02)), mass=0)
    scene.add_body("rod", Box((0.2, 0.02, 0.02)), mass=0.1)
    scene.add_joint(
        "hinge",
        parent="post",
        child="rod",
        axis=(0, 1, 0),
        child_origin=(-0.1, 0, 0),
        stiffness=20.0,
        start=0.1,
        target=0.0,
    )
    scene.add_body("bystander", Sphere(0.05), mass=1.0, position=(9, 0, 0), role="object")
    return scene


def _overlap(step: float, iterations: int) -> Scene:
    scene = Scene(step=step, solver_iterations=iterations)
    scene.add_plane("table")
    scene.add_body("block", Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.049), role="object")
    return scene


def _landing(step: float, iterations: int) -> Scene:
    scene = Scene(step=step, solver_iterations=iterations)
    scene.add_plane("table")
    scene.add_body(
        "box",
        Box((0.05, 0.1, 0.2)),
        mass=1.0,
        position=(0, 0, 0.3),
        velocity=(0.5, 0, 0),
        angular_velocity=(1, 5, 2),
        role="object",
    )
    return scene


def _stack(upper: float) -> Callable[[float, int], Scene]:
    def build(step: float, iterations: int) -> Scene:
        scene = Scene(step=step, solver_iterations=iterations)
        scene.add_plane("table")
        box = Box((0.1, 0.1, 0.1))
        scene.add_body("lower", box, mass=1.0, position=(0, 0, 0.05), role="object")
        scene.add_body("upper", box, mass=upper, position=(0, 0, 0.15), velocity=(0.3, 0, 0))
        return scene

    return build


CAUSES = (
    Cause("a ball falls for 0.5 s, of its energy", 0.5 * (GRAVITY * 0.5) ** 2, 0.5, _fall),
    Cause(
        "a box spins at 20 rad/s and turns over, of its energy",
        0.5 * (0.05**2 + 0.2**2) / 12 * 20.0**2,
        1.0,
        _spin,
    ),
    Cause("a ball swings on a spring, of its energy", 0.5, 1.0, _spring),
    Cause("a stiff joint without damping, of its energy", 0.5 * 20.0 * 0.1**2, 0.2, _stiff_joint),
    Cause("a block starts 1 mm deep in the table, of m g h", GRAVITY * 0.001, 0.5, _overlap),
    Cause("a box tumbles onto a table, of m g h", GRAVITY * 0.3, 1.0, _landing),
    Cause("a box slides on one like it, of its energy", 0.5 * 0.3**2, 0.5, _stack(1.0)),
    Cause(
        "a box slides on one of 1/50 its mass, of its energy", 0.5 * 50 * 0.3**2, 0.5, _stack(50.0)
    ),
)


def to_markdown(settings: Sequence[tuple[float, int]]) -> str:
    """The errors of each cause with each setting: step [s], solver iterations."""
    lines = [
        "Errors by cause, as shares of the energy that is named.",
        "",
        "| what happens | step | iterations | " + " | ".join(ERRORS) + " |",
        "| --- " * (3 + len(ERRORS)) + "|",
    ]
    for cause in CAUSES:
        for step, iterations in settings:
            audit = cause.audit(step, iterations)
            shares = (100 * getattr(audit, name) / cause.scale for name in ERRORS)
            cells = " | ".join(f"{share:+.2g} %" if abs(share) > 1e-6 else "0" for share in shares)
            lines.append(f"| {cause.name} | 1/{round(1 / step)} s | {iterations} | {cells} |")
    return "\n".join(lines) + "\n"
