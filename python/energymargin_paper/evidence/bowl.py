"""A ball in a bowl: the escape energy of Definition 2 against its closed form.

The ball has to be lifted over the rim, and no higher: m g (height of the rim + radius - height of
the ball's centre). The bowl is a concave mesh, taken apart into convex parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull as Hull

from energymargin import regions
from energymargin._core import (
    Compound,
    ConvexHull,
    EscapeEnergy,
    Problem,
    Scene,
    Sphere,
    World,
    escape_energy,
)
from energymargin.base.checks import whole_number
from energymargin.base.errors import needs_extra
from energymargin.base.table_text import csv_text, markdown_table
from energymargin.meshes import mesh as mesh_shape
from energymargin.model.scenes.corners import shape_corners
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D

__all__ = [
    "PLANNERS",
    "STUDY",
    "Bowl",
    "Search",
    "Settings",
    "figure_bowl",
    "problem",
    "write_mesh",
]

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
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    samples: int = setting(2000, "Poses of the ball that each search draws.")
    seeds: int = setting(10, "Searches with each planner.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        whole_number("samples", self.samples, 1)
        whole_number("seeds", self.seeds, 1)


@dataclass(frozen=True)
class Search:
    """One search."""

    planner: str
    seed: int
    found: EscapeEnergy


@dataclass(frozen=True, eq=False)
class Bowl:
    """The result."""

    shape: Compound
    """The bowl's convex parts."""
    problem: Problem
    """At the start of the searches: the ball at rest in the bowl."""
    closed_form: float
    """Escape energy of the ball where it came to rest [J]."""
    rolled: NDArray[np.float64]
    """States of the ball and the bowl from the drop to the rest, shape (K, n)."""
    runs: list[Search] = field(default_factory=list)

    def ratios(self, planner: str) -> NDArray[np.float64]:
        """Energies found by a planner over the closed form, one a seed."""
        found = [run.found.energy for run in self.runs if run.planner == planner]
        return np.array(found) / self.closed_form

    def to_csv(self) -> str:
        """One line for each improvement of each search."""
        rows = [
            (run.planner, run.seed, samples, energy, self.closed_form)
            for run in self.runs
            for samples, energy in run.found.history
        ]
        return csv_text(("planner", "seed", "samples", "energy", "closed_form"), rows)

    def to_markdown(self) -> str:
        """The ratios as a table."""
        ball = self.rolled[-1, self.problem.scene.slice("ball")]
        text = (
            f"A bowl of {len(self.shape.parts)} convex parts. A ball that is dropped into it is "
            f"{np.hypot(*ball[:2]) * 1e3:.1f} mm from the axis after {SECONDS:g} s. "
            f"Closed form of its escape energy: {1e3 * self.closed_form:.4f} mJ."
        )
        rows = []
        for planner in dict.fromkeys(run.planner for run in self.runs):
            ratios = self.ratios(planner)
            values = (f"{f(ratios):.4f}" for f in (np.min, np.median, np.max))
            rows.append([planner, str(len(ratios)), *values])
        header = ("planner", "seeds", "lowest found / closed form", "median", "highest")
        return f"{text}\n\n{markdown_table(header, rows)}\n"


def write_mesh(path: Path) -> None:
    """The bowl as a mesh file. Raises ImportError without the extra [urdf]."""
    with needs_extra("this study", "urdf"):
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


class BowlStudy(Study[Settings, Bowl]):
    """The escape energy of a ball in a bowl (Definition 2), beside its closed form.

    The bowl is a mesh that is taken apart into convex parts. The folder gets bowl.md, bowl.csv,
    bowl.png, the mesh and the problem file.

    Example: `energymargin reproduce bowl --seeds 3`
    """

    name = "bowl"
    title, unit = "Searching ways out of the bowl", "searches"
    settings = Settings()
    quick = Settings(samples=500, seeds=2)
    packages = ("coacd",)
    resumes = threaded = False

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Bowl:
        """Takes the bowl apart, lets the ball roll in it, and searches for its way out.

        The folder gets bowl.obj, problem.json and, after each search, the tables of those so far.
        """
        mesh = folder / "bowl.obj"
        write_mesh(mesh)
        shape = mesh_shape(mesh)
        made = problem(shape)
        made.save(folder / "problem.json")
        height = RIM + BALL_RADIUS - made.state[made.scene.slice("ball")][2]
        bowl = Bowl(shape, made, BALL_MASS * GRAVITY * height, _rolled(made.scene))
        for planner, seed in product(PLANNERS, range(settings.seeds)):
            found = escape_energy(made, planner=planner, samples=settings.samples, seed=seed)
            bowl.runs.append(Search(planner, seed, found))
            self.write(bowl, folder)
            progress(len(bowl.runs), len(PLANNERS) * settings.seeds)
        return bowl

    def figures(self, result: Bowl) -> Iterator[tuple[str, Figure]]:
        """The bowl's convex parts with the ball's way out, and the bound's fall."""
        yield "bowl.png", figure_bowl(result)


STUDY = BowlStudy()


def _rolled(scene: Scene) -> NDArray[np.float64]:
    """The ball is let go above the bowl's wall."""
    steps = round(SECONDS / scene.step)
    return World(scene).simulate(scene.pack(), steps).states


COLORS = {"bit*": "#0072B2", "rrt*": "#CC79A7"}
STRIDE = 7  # neighbours get colours that differ; coprime to most numbers of parts
APART = 0.25  # how far the parts are moved from the middle, as a share of their distance to it


def figure_bowl(bowl: Bowl) -> Figure:
    """The bowl and a way out; its parts moved apart; upper bounds against samples."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 3.8), dpi=200, layout="constrained")
    whole = figure.add_subplot(1, 3, 1, projection="3d")
    apart = figure.add_subplot(1, 3, 2, projection="3d")
    bounds = figure.add_subplot(1, 3, 3)
    _draw_parts(whole, bowl, apart=0.0, alpha=0.25)
    _draw_way(whole, bowl)
    whole.set_title("a way out of the bowl", fontsize=10)
    _draw_parts(apart, bowl, apart=APART, alpha=0.9)
    apart.set_title(f"its {len(bowl.shape.parts)} convex parts, moved apart", fontsize=10)
    _draw_bounds(bounds, bowl)
    return figure


def _draw_parts(ax: Axes3D, bowl: Bowl, *, apart: float, alpha: float) -> None:
    from matplotlib import colormaps
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    count = len(bowl.shape.parts)
    colors = colormaps["cividis"](np.linspace(0.1, 1.0, count)[np.arange(count) * STRIDE % count])
    corners = [_points(part.shape) for part in bowl.shape.parts]
    middle = np.mean([points.mean(axis=0) for points in corners], axis=0)
    for points, color in zip(corners, colors, strict=True):
        moved = points + apart * (points.mean(axis=0) - middle)
        faces = moved[Hull(moved).simplices]
        ax.add_collection3d(Poly3DCollection(faces, facecolor=color, alpha=alpha, linewidth=0))
    limits = np.ptp(np.concatenate(corners), axis=0).max() / 2 * (1 + apart)
    for axis, center in zip("xyz", middle, strict=True):
        getattr(ax, f"set_{axis}lim")(center - limits, center + limits)
        getattr(ax, f"set_{axis}label")(f"{axis} [m]", fontsize=7)
        ax.tick_params(labelsize=6)
    ax.set_box_aspect((1, 1, 1))


def _points(shape: object) -> NDArray[np.float64]:
    return np.asarray(shape.points) if isinstance(shape, ConvexHull) else shape_corners(shape)


def _draw_way(ax: Axes3D, bowl: Bowl) -> None:
    """The cheapest path of all searches, and the ball at its start and at the top."""
    best = min(bowl.runs, key=lambda run: run.found.energy).found
    if best.barrier is None:
        return
    path = best.path[:, bowl.problem.scene.slice("ball")][:, :3]
    ax.plot(*path.T, color="#D55E00", linewidth=1.5)
    turn = np.linspace(0.0, 2.0 * np.pi, 20)
    rise = np.linspace(0.0, np.pi, 12)
    ball = np.stack(
        [
            np.outer(np.cos(turn), np.sin(rise)),
            np.outer(np.sin(turn), np.sin(rise)),
            np.outer(np.ones_like(turn), np.cos(rise)),
        ]
    )
    for row in (0, best.barrier):
        x, y, z = path[row][:, None, None] + BALL_RADIUS * ball
        ax.plot_surface(x, y, z, color="#E69F00", alpha=0.8)


def _draw_bounds(ax: Axes, bowl: Bowl) -> None:
    for run in bowl.runs:
        if not run.found.history:
            continue
        samples, energies = np.transpose(run.found.history)
        first = run.seed == 0
        label = run.planner if first else None
        color = COLORS[run.planner]
        ax.step(samples, 1e3 * energies, where="post", color=color, alpha=0.6, label=label)
    ax.axhline(1e3 * bowl.closed_form, color="black", linewidth=1, linestyle="--", label="m g h")
    ax.set_xscale("log")
    ax.set_xlabel("samples")
    ax.set_ylabel("escape energy [mJ], found from above")
    seeds = 1 + max(run.seed for run in bowl.runs)
    ax.set_title(f"{' and '.join(PLANNERS)}, {seeds} seeds each", fontsize=10)
    ax.grid(alpha=0.25, linewidth=0.5)
    ax.legend(frameon=False, fontsize=8)
