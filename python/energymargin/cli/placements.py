"""The command `energymargin placements`: where to set a thing down."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

import energymargin as em
from energymargin.base.bars import bar
from energymargin.base.checks import whole_number
from energymargin.cli import terminal
from energymargin.cli.grasp_words import OF_OBJECT, Thing, arguments_as_options, chosen_hand
from energymargin.cli.options import Outputs, Where, chosen_sampling, given, panel

GRID = panel("The grid, without a file of poses")


@panel("A hand that sets it down", "*")
@dataclass(frozen=True)
class Release:
    """Arguments of `em.placements`."""

    hand: str | None = None
    """panda, robotiq_2f85, or another of `energymargin grasps`, or numbers; left out: nothing
    holds it."""
    grasp: Path | None = None
    """A table of grasps in the object's frame, whose first one the hand has."""

    def chosen(self) -> dict[str, Any]:
        """Both as `em.placements` takes them. Raises ValueError on one without the other."""
        if self.hand is None and self.grasp is None:
            return {}
        if self.hand is None or self.grasp is None:
            lacks, has = ("--hand", "--grasp") if self.hand is None else ("--grasp", "--hand")
            raise ValueError(f"{lacks} is not given, expected it with {has}")
        return {"hand": chosen_hand(self.hand), "grasp": em.grasps.read(self.grasp).poses[0]}


@panel("What a trial is", "*")
@dataclass(frozen=True)
class Trials:
    """Arguments of `em.placements`."""

    rollouts: int = 60
    """The most draws of each candidate."""
    height: float = 0.005
    """From which it is let go, above where it is meant to rest [m]."""
    radius: float = 0.05
    """It stays if its centre of mass stays so near to its place along each axis [m],"""
    angle: float = 0.35
    """and if it leans by at most so much [rad]."""
    knock: float = 0.1
    """Largest random force along each axis, as a share of its weight, for at most 0.1 s."""
    shake: float = 0.0
    """Largest peak of the support's acceleration [m/s^2]."""
    tilt: float = 0.0
    """Largest slope of the support [rad]."""
    horizon: float = 1.0
    """After the release [s]."""
    pushed: int = 5
    """For so many of the best, the least push that makes it fall is searched."""
    seed: int = 0
    """The same seed gives the same numbers, to the last bit."""
    store: Path | None = None
    """A file of draws, without a shake and a tilt: the same command goes on from there."""


def placements(
    poses: Path | None = None,
    /,
    *,
    on: list[Path],
    on_friction: float = 0.5,
    on_scale: float = 1.0,
    belief: str | None = None,
    spacing: Annotated[float | None, GRID] = None,
    turns: Annotated[int | None, GRID] = None,
    pose: Annotated[int | None, GRID] = None,
    output: Outputs = None,
    overwrite: bool = False,
    thing: Thing = Thing(),
    release: Release = Release(),
    trials: Trials = Trials(),
    where: Where = Where(),
) -> None:
    """Where shall I put it? Ranks places by how likely a thing stays where it is set down.

    Each candidate is tried `--rollouts` times: the thing is let go above its place, and knocked at
    random. All candidates meet the same draws. The table has 95 % intervals, and for the best the
    least work of a push that makes it fall.

    Example: `energymargin placements poses.csv --object mug.obj --mass 0.3 --on shelf.obj`

    A grid on the shelf, the mug as it lies most often when dropped, put down to 5 mm and 2 degrees:
    `energymargin placements --object mug.obj --mass 0.3 --on shelf.obj --pose 0 --belief '{"pose":
    [0.005, 0.005, 0, 0, 0, 0.035]}' -o places.csv -o places.png`

    Args:
        poses: A table of poses of the object in the frame of the supports (.csv: x, y, z, qx, qy,
            qz, qw, name). Left out: a grid on the supports.
        on: A mesh of a support, which is fixed; may be repeated.
        on_friction: Friction coefficient of the supports; a contact's is the product of two.
        on_scale: What makes metres of the supports' lengths.
        belief: How well the object is known at its release, as JSON or a file of it: pose (3 errors
            in m, 3 in rad), friction, mass, velocity.
        spacing: Of the grid [m]; 0.05 if left out.
        turns: So many turns about the vertical, evenly; 1 if left out.
        pose: Number of the way in which it lies, as of `em.resting_poses`, 0 the most probable;
            left out: as its file has it.
        output: Also the table as .csv or .md, or a picture: .png, .pdf, .svg. May be repeated.
        overwrite: Replace files that exist.
    """
    with terminal.loading():
        import energymargin.grasps
        import energymargin.placing  # noqa: F401

        suffixes = terminal.TEXTS + terminal.PICTURES
        terminal.require_outputs(output or (), overwrite=overwrite, suffixes=suffixes)
    grid = {"spacing": spacing, "turns": turns, "pose": pose}
    if poses is not None and (given_too := [name for name in grid if grid[name] is not None]):
        text = f"--{given_too[0]} is {grid[given_too[0]]}, but it is of a grid"
        raise ValueError(f"{text}, and {poses} has the poses: leave one of them out")
    sampling, held = chosen_sampling(belief, None), release.chosen()
    with arguments_as_options(OF_OBJECT):
        object = em.grasps.GraspObject.of(None, **given(thing))
    scene = _scene(object, on, on_friction, on_scale, pose)
    many = whole_number("turns", 1 if turns is None else turns, 1, 3600)
    with bar("Ranking", "draws") as progress:
        found = em.placements(
            scene,
            "object",
            None if poses is None else em.grasps.read_poses(poses),
            on=[body.name for body in scene.bodies if body.name != "object"],
            spacing=0.05 if spacing is None else spacing,
            yaws=[2 * np.pi * turn / many for turn in range(many)],
            uncertainty=None if sampling is None else sampling.uncertainty,
            executor=where.executor(),
            progress=progress,
            timeout=where.timeout,
            **held,
            **asdict(trials),
        )
    done, draw = "all draws were made", lambda: em.plots.plot_ranking(found.ranking)
    terminal.show_table(found, output or (), done, draw)


def _scene(
    object: em.grasps.GraspObject, on: list[Path], friction: float, scale: float, pose: int | None
) -> em.Scene:
    """The supports, fixed, and the object."""
    scene = em.Scene()
    facts: dict[str, Any] = {}
    names = {"object"}
    for number, path in enumerate(on):
        name = path.stem if number == 0 else f"{path.stem}-{number}"
        while name in names:
            name += "-"
        names.add(name)
        scene.add_body(name, em.mesh(path, scale=scale), mass=0.0, friction=friction)
    if pose is not None:
        ways = em.resting_poses(object.shape, mass=object.mass, inertial=object.inertial)
        if not 0 <= pose < len(ways):
            raise ValueError(f"--pose is {pose}, expected 0 to {len(ways) - 1}: it lies so")
        facts["orientation"] = ways[pose].orientation
    for name in ("mass", "friction", "inertial"):
        facts[name] = getattr(object, name)
    scene.add_body("object", object.shape, role="object", **facts)
    return scene
