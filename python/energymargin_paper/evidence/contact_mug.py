"""Grasps of a mug by a hand of hulls, here and in MuJoCo: which are held?

The grasps, the mug and the hand are of ACRONYM (Eppner, Mousavian and Fox, 2021), in a folder that
the project does not have: NAME.h5, NAME.obj and the hand's mesh. The hand closes on the mug without
gravity; then a load pulls the mug in six directions in turn. A grasp is judged where MuJoCo says
the same at two steps and two softnesses of its contacts. Nearly rigid contacts, at a tenth of the
step, show how much of its answer is their softness.
"""

from __future__ import annotations

import itertools
import os
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin._core import ConvexHull, Mimic, Plan, Scene
from energymargin.base.aliases import Floats
from energymargin.meshes import mesh
from energymargin.model.scenes.mjcf_model import engine
from energymargin.mujoco.mjcf import model_of
from energymargin.mujoco.simulation import Simulation
from energymargin_paper.evidence.contact_traces import GRAVITY, simulated
from energymargin_paper.evidence.grasps_data import FOLDER

__all__ = ["FOLDER", "Grasp", "Grasps", "Here", "There", "given", "here", "there"]

HAND = "franka_gripper_collision_mesh.stl"
OPEN = 0.0395  # m, way of a finger

SPEED = 0.12  # m/s, of a finger that closes
STIFFNESS, DAMPING = 3000.0, 20.0  # N/m and N s/m, of the drive
FORCE = 20.0  # N of the drive, which both fingers share
CLOSING, LOADED = 0.5, 0.15  # s, the latter in each direction
WEIGHTS = 3.0  # of the mug, the load
LOST = 0.05  # m from its place in the closed hand

STEPS = (0.0005, 0.00025)  # s, of MuJoCo
SOFTNESSES = (0.001, 0.004)  # s, time constants of its contacts
HARD = (0.00005, 0.0001)  # s, step and time constant: nearly rigid
LOOK = 0.002  # s, between two looks at MuJoCo's speeds
FAST, STILL = 0.2, 1e-9  # m/s of a finger and m of the mug: a step that stands still
DIRECTIONS = tuple(side * axis for axis in np.eye(3) for side in (1.0, -1.0))


@dataclass(frozen=True)
class Here:
    """What our simulation does."""

    held: bool
    still: int
    """Steps in which nothing moves although a finger has a speed."""
    fastest: float
    """Speed of the mug while the hand closes, at most [m/s]."""


@dataclass(frozen=True)
class There:
    """What MuJoCo does."""

    held: bool | None
    """None where its steps and softnesses say different things."""
    held_hard: bool
    """With nearly rigid contacts."""
    fastest: float
    """As that of `Here`, the largest of all steps and softnesses [m/s]."""


@dataclass(frozen=True)
class Grasp:
    """A scene with its plan and the wrenches on the mug."""

    scene: Scene
    plan: Plan
    load: float
    """[N]"""

    def wrenches(self, step: float) -> Floats:
        """On the mug, shape (steps, 6)."""
        closing, loaded = round(CLOSING / step), round(LOADED / step)
        rows = np.zeros((closing + loaded * len(DIRECTIONS), 6))
        for number, direction in enumerate(DIRECTIONS):
            first = closing + number * loaded
            rows[first : first + loaded, :3] = self.load * direction
        return rows


class Grasps:
    """The grasps of an object in a folder."""

    def __init__(self, folder: Path, name: str = "mug") -> None:
        """Reads them. Raises ImportError without h5py or trimesh, and OSError."""
        import trimesh

        from energymargin.base import hdf5

        with hdf5.opened(folder / f"{name}.h5") as file:
            self.scale = float(file["object/scale"][()])
            self.mass = float(file["object/mass"][()])
            self.poses: Floats = file["grasps/transforms"][:]
        self.path = folder / f"{name}.obj"
        self.hulls = {}
        for part in trimesh.load_mesh(folder / HAND).split(only_watertight=False):
            low, high = part.bounds[:, 0]
            side = "left" if high < 0 else "right" if low > 0 else "hand"
            self.hulls[side] = ConvexHull(part.vertices)

    @cached_property
    def shape(self) -> Any:
        """Shape of the mug."""
        return mesh(self.path, scale=self.scale)

    def chosen(self, count: int, seed: int) -> list[int]:
        """Numbers of grasps, by chance."""
        random = np.random.default_rng(seed)
        return [int(n) for n in random.choice(len(self.poses), count, replace=False)]

    def grasp(self, number: int, friction: float, target: float = 0.0) -> Grasp:
        """One of them, with a coefficient of the mug and the hand; the hand's axes are the world's.

        `target`: of the fingers without the plan [m]. Raises ValueError if hand and mug overlap.
        """
        scene = Scene(gravity=(0, 0, 0))
        scene.add_body("hand", self.hulls["hand"], mass=0.0, friction=1.0, role="effector")
        for side in ("left", "right"):
            scene.add_body(side, self.hulls[side], mass=0.1, friction=1.0, role="effector")
        scene.add_joint(
            "left",
            type="prismatic",
            parent="hand",
            child="left",
            axis=(1, 0, 0),
            limits=(0.0, OPEN),
            target=target,
            stiffness=STIFFNESS,
            damping=DAMPING,
            torque_limit=FORCE,
        )
        scene.add_joint(
            "right",
            type="prismatic",
            parent="hand",
            child="right",
            axis=(-1, 0, 0),
            mimic=Mimic("left"),
        )
        inverse = np.linalg.inv(self.poses[number])
        scene.add_body(
            "object",
            self.shape,
            mass=self.mass,
            friction=friction,
            role="object",
            position=inverse[:3, 3],
            orientation=Rotation.from_matrix(inverse[:3, :3]).as_quat(),
        )
        times = scene.step * np.arange(1, round(CLOSING / scene.step) + 1)
        plan = Plan(step=scene.step, targets={"left": SPEED * times})
        return Grasp(scene, plan, WEIGHTS * GRAVITY * self.mass)


@cache
def given() -> Grasps | None:
    """Those of the folder that the environment names; None if it names none."""
    folder = os.environ.get(FOLDER)
    return Grasps(Path(folder) / "acronym") if folder else None


def here(grasp: Grasp) -> Here:
    """A grasp in our simulation."""
    scene = grasp.scene
    wrenches = grasp.wrenches(scene.step)
    targets = grasp.plan.targets["left"]
    rows = np.append(targets, np.full(len(wrenches) - len(targets), targets[-1]))
    trace = simulated(
        scene,
        len(wrenches) * scene.step,
        drives={"object": wrenches},
        targets={"left": rows},
    )
    path = trace.position("object")
    finger = np.abs(trace.states[1:, scene.joint_slice("left").stop - 1])
    moved = np.abs(np.diff(path, axis=0)).max(axis=1)
    closed = trace.at(CLOSING)
    speeds = np.linalg.norm(trace.of("object", "velocity")[: closed + 1], axis=1)
    held = np.linalg.norm(path[closed:] - path[closed], axis=1).max() < LOST
    still = (moved < STILL) & (finger > FAST)
    return Here(bool(held), int(still.sum()), float(speeds.max()))


def there(grasp: Grasp) -> There:
    """A grasp in MuJoCo, at all steps and softnesses, and with nearly rigid contacts."""
    played = [_played(grasp, *how) for how in itertools.product(STEPS, SOFTNESSES)]
    answers = {held for held, _ in played}
    held = answers.pop() if len(answers) == 1 else None
    held_hard, _ = _played(grasp, *HARD)
    return There(held, held_hard, max(speed for _, speed in played))


def _played(grasp: Grasp, step: float, softness: float) -> tuple[bool, float]:
    """Whether MuJoCo holds a grasp, and the mug's largest speed while the hand closes [m/s]."""
    mujoco, scene = engine(), grasp.scene
    model = model_of(scene, step=step)
    model.pair_solref[:, 0] = softness
    model.opt.impratio = 10.0  # or what is held creeps
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    simulation, mug, fastest = (
        Simulation(scene, model, data, grasp.plan),
        scene.slice("object"),
        0.0,
    )
    for _ in range(round(CLOSING / LOOK)):
        simulation.advance(round(LOOK / step))
        fastest = max(fastest, float(np.linalg.norm(simulation.state()[mug][7:10])))
    start = simulation.state()[mug][:3]
    for direction in DIRECTIONS:
        simulation.push(np.append(grasp.load * direction, np.zeros(3))[None])
        simulation.advance(round(LOADED / step))
        if np.linalg.norm(simulation.state()[mug][:3] - start) > LOST:
            return False, fastest
    return True, fastest
