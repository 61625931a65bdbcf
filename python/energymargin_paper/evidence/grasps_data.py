"""The grasps of others that the study of grasps is made with, from a folder that is not ours."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import uniform

from energymargin._core import Box, Scene, World
from energymargin.grasps import GraspBelief, GraspObject, GraspSet, Protocol, read
from energymargin.grasps.hands import ParallelGripper, preset
from energymargin.grasps.outcomes import Grasp
from energymargin.grasps.protocols import protocol_of
from energymargin.grasps.scores import grasp_of
from energymargin.grasps.trials import GraspTrials

__all__ = ["FOLDER", "LITTLE", "MUG", "OF_ROBOT", "PAIRED", "RIGID", "Noise", "Posed"]
__all__ += ["acronym", "data_folder", "graspa", "robot_objects", "sampled", "trials_of"]

FOLDER = "ENERGYMARGIN_GRASPS"
MUG = "mug"
OF_ROBOT = {
    "YcbBanana": 0.066,
    "YcbChipsCan": 0.205,
    "YcbCrackerBox": 0.411,
    "YcbGelatinBox": 0.097,
    "YcbHammer": 0.665,
    "YcbMustardBottle": 0.603,
    "YcbPear": 0.049,
    "YcbTennisBall": 0.058,
}
"""Masses of the YCB objects [kg], as published with them."""
PAIRED = ("YcbBanana", "YcbChipsCan", "YcbCrackerBox", "YcbHammer", MUG)
"""Objects of both engines: curved, round, boxy, heavy and long, and hollow."""
RIGID = replace(preset("panda"), pads=None)  # as the fingers of other engines are
SLIPPED, TURNED = 0.03, float(np.radians(30))  # m and rad in the hand; what slides on is chaotic
REACHED = 0.01  # m; how far the object has to reach into the space between the fingers
TRIES = 400  # candidates for each grasp that is sampled


class Noise(NamedTuple):
    """Even noise of a pose, to either side along and about each axis."""

    position: float
    """[m]"""
    angle: float
    """[rad]"""


LITTLE = Noise(0.005, np.radians(10))


def data_folder(data: str) -> Path:
    """The folder of the data. Raises ValueError if there is none."""
    folder = Path(data or os.environ.get(FOLDER, ""))
    if not (folder / "graspa").is_dir() and not (folder / "acronym").is_dir():
        raise ValueError(
            f"data is {str(folder)!r}, expected a folder with graspa/ or acronym/ in it; the "
            f"environment variable {FOLDER} may name it"
        )
    return folder


def robot_objects(folder: Path) -> list[str]:
    """Objects of the robot's grasps whose meshes are there."""
    return [name for name in OF_ROBOT if (folder / "graspa" / "meshes" / f"{name}.stl").is_file()]


@lru_cache
def graspa(folder: Path, name: str, friction: float) -> tuple[GraspSet, GraspObject]:
    """The grasps of a real robot, and the object."""
    own = folder / "graspa"
    grasps = read(own / "grasps.csv", object=own / "objects.csv", where={"object": name})
    return grasps, GraspObject.of(grasps.object, mass=OF_ROBOT[name], friction=friction)


@lru_cache
def acronym(folder: Path, name: str, friction: float | None = None) -> tuple[GraspSet, GraspObject]:
    """The grasps of another engine, and the object."""
    grasps = read(folder / "acronym" / f"{name}.h5")
    mesh = folder / "acronym" / f"{name}.obj"
    return grasps, GraspObject.of(grasps.object, mesh=mesh, friction=friction)


class Posed(NamedTuple):
    """Trials of an object."""

    object: str
    friction: float
    protocol: str
    noise: Noise
    seed: int


@lru_cache
def trials_of(folder: Path, asked: Posed) -> tuple[GraspSet, GraspTrials]:
    """The recorded grasps of an object, and trials without a table with poses that are off."""
    name, friction, protocol, noise, seed = asked
    grasps, thing = (graspa if name in OF_ROBOT else acronym)(folder, name, friction)
    given: Protocol = replace(
        protocol_of(protocol), table=False, gravity="closed", radius=SLIPPED, angle=TURNED
    )
    errors = [uniform(-most, 2 * most) for most in noise]
    belief = GraspBelief(pose=[errors[0]] * 3 + [errors[1]] * 3)
    return grasps, GraspTrials(RIGID, thing, given, belief, colliding="redraw", seed=seed)


def sampled(grasps: GraspSet, trials: GraspTrials, number: int) -> Grasp:
    """Grasp `number` near recorded ones: the open hand is free, and the object reaches between
    its fingers. Raises ValueError if there is none."""
    random = np.random.default_rng([trials.seed, number, 3])
    exact, hand = replace(trials, colliding="lost"), trials.hand
    assert isinstance(hand, ParallelGripper)
    between = Scene()
    size = (hand.opening, hand.pad[0], hand.pad[1])
    between.add_body("space", Box(size), mass=1.0, role="effector", kinematic=True)
    between.add_body("object", trials.object.shape, mass=1.0, role="object")
    world = World(between)
    for _ in range(TRIES):
        grasp = grasp_of(grasps, int(random.integers(len(grasps))))
        pose = grasp.pose.copy()
        pose[:3, 3] += random.uniform(-1, 1, 3) * LITTLE.position
        turn = Rotation.from_rotvec(random.uniform(-1, 1, 3) * LITTLE.angle)
        pose[:3, :3] = pose[:3, :3] @ turn.as_matrix()
        grasp = grasp._replace(number=number, pose=pose, opening=np.nan)
        middle = pose.copy()
        middle[:3, 3] += pose[:3, 2] * (hand.reach - hand.pad[1] / 2)
        at = {
            "position": middle[:3, 3],
            "orientation": Rotation.from_matrix(middle[:3, :3]).as_quat(),
        }
        if world.distance(between.pack(space=at), "space", "object") > -REACHED:
            continue
        if exact.start(grasp, exact.draw(-1)).state is not None:
            return grasp
    raise ValueError(f"no grasp in {TRIES} candidates reaches the object with the hand free")
