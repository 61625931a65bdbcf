"""A ball in a bowl: the escape energy of Definition 2 against its closed form.

The ball has to be lifted over the rim, and no higher: m g (height of the rim + radius - height of
the ball's centre). The bowl is a concave mesh, taken apart into convex parts.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import (
    Compound,
    EscapeEnergy,
    Problem,
    Scene,
    Sphere,
    World,
    escape_energy,
)
from energymargin.meshes import mesh as solid_of
from energymargin.meshes import needs_extra

__all__ = ["PLANNERS", "Bowl", "Run", "problem", "reproduce", "write_mesh"]

PLANNERS = ("bit*", "rrt*")
GRAVITY = 9.81  # m/s^2

# Radius and height of the bowl's profile [m], from the middle of the foot over the rim and back.
PROFILE = (
    *((0.0, 0.0), (0.025, 0.0), (0.045, 0.012), (0.060, 0.050)),
    *((0.056, 0.050), (0.042, 0.015), (0.024, 0.005), (0.0, 0.005)),
)
SECTIONS = 32  # of a turn
RIM = 0.050  # m, height
FLOOR = 0.005  # m, height of the inside
BOWL_MASS = 0.3  # kg
BALL_RADIUS = 0.012  # m
BALL_MASS = 0.02  # kg
FRICTION = 0.5
OUTSIDE = 0.09  # m, of the ball's centre from the axis, from where on it has left

DROP = (0.02, 0.0, 0.045)  # m, from where the ball is let go
SECONDS = 2.0  # of rolling


@dataclass(frozen=True)
class Run:
    """One search."""

    planner: str
    seed: int
    found: EscapeEnergy


@dataclass(frozen=True)
class Bowl:
    """What came out."""

    shape: Compound
    """The bowl's convex parts."""
    problem: Problem
    """At the start of the searches: the ball at rest in the bowl."""
    closed_form: float
    """Escape energy of the ball where it came to rest [J]."""
    rolled: NDArray[np.float64]
    """States of the ball and the bowl from the drop to the rest, shape (K, n)."""
    runs: list[Run] = field(default_factory=list)

    def ratios(self, planner: str) -> NDArray[np.float64]:
        """Energies found by a planner over the closed form, one a seed."""
        found = [run.found.energy for run in self.runs if run.planner == planner]
        return np.array(found) / self.closed_form

    def to_csv(self) -> str:
        """One line for each improvement of each search."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(("planner", "seed", "samples", "energy", "closed_form"))
        for run in self.runs:
            for samples, energy in run.found.history:
                writer.writerow((run.planner, run.seed, samples, energy, self.closed_form))
        return text.getvalue()

    def to_markdown(self) -> str:
        """The ratios as a table."""
        ball = self.rolled[-1, self.problem.scene.slice("ball")]
        lines = [
            f"A bowl of {len(self.shape.parts)} convex parts. A ball that is dropped into it is "
            f"{np.hypot(*ball[:2]) * 1e3:.1f} mm from the axis after {SECONDS:g} s. "
            f"Closed form of its escape energy: {1e3 * self.closed_form:.4f} mJ.",
            "",
            "| planner | seeds | lowest found / closed form | median | highest |",
            "| --- | --- | --- | --- | --- |",
        ]
        for planner in dict.fromkeys(run.planner for run in self.runs):
            ratios = self.ratios(planner)
            values = " | ".join(f"{f(ratios):.4f}" for f in (np.min, np.median, np.max))
            lines.append(f"| {planner} | {len(ratios)} | {values} |")
        return "\n".join(lines) + "\n"


def write_mesh(path: Path) -> None:
    """The bowl as a mesh file. Raises ImportError without the extra [urdf]."""
    with needs_extra():
        import trimesh

    trimesh.creation.revolve(np.array(PROFILE), sections=SECTIONS).export(path)


def problem(bowl: Compound) -> Problem:
    """The ball where it comes to rest in the bowl."""
    scene = Scene(gravity=(0.0, 0.0, -GRAVITY))
    scene.add_plane("table", friction=FRICTION)
    scene.add_body("bowl", bowl, mass=BOWL_MASS, friction=FRICTION, role="effector")
    scene.add_body(
        "ball", Sphere(BALL_RADIUS), mass=BALL_MASS, position=DROP, friction=FRICTION, role="object"
    )
    rest = scene.pack(ball={"position": (0.0, 0.0, FLOOR + BALL_RADIUS)})
    return Problem(
        scene,
        rest,
        force=(0.1, 0.1, 0.1),
        torque=(0.0, 0.0, 0.0),
        duration=0.2,
        captured=regions.Disc("ball", center=(0.0, 0.0), radius=OUTSIDE),
        rate=1000.0,
    )


def reproduce(
    folder: Path,
    samples: int,
    seeds: int,
    *,
    planners: Sequence[str] = PLANNERS,
    progress: Callable[[int, int], None] | None = None,
) -> Bowl:
    """Takes the bowl apart, lets the ball roll in it, and searches for its way out.

    The folder gets bowl.obj, problem.json and, after each search, bowl.md and bowl.csv of those so
    far. `progress(done, total)` is called after each search.
    """
    mesh = folder / "bowl.obj"
    write_mesh(mesh)
    shape = solid_of(mesh)
    made = problem(shape)
    made.save(folder / "problem.json")
    height = RIM + BALL_RADIUS - made.state[made.scene.slice("ball")][2]
    bowl = Bowl(shape, made, BALL_MASS * GRAVITY * height, _rolled(made.scene))
    total = len(planners) * seeds
    for planner in planners:
        for seed in range(seeds):
            found = escape_energy(made, planner=planner, samples=samples, seed=seed)
            bowl.runs.append(Run(planner, seed, found))
            (folder / "bowl.md").write_text(bowl.to_markdown())
            (folder / "bowl.csv").write_text(bowl.to_csv())
            if progress is not None:
                progress(len(bowl.runs), total)
    return bowl


def _rolled(scene: Scene) -> NDArray[np.float64]:
    """The ball is let go above the bowl's wall."""
    steps = round(SECONDS / scene.step)
    return World(scene).simulate(scene.pack(), steps).states
