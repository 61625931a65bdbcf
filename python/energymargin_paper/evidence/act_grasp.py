"""Grasping a mallet: where along it, how high, at which yaw and how hard two fingers grip it.

The mallet is two convex meshes, a handle that widens towards the head, and a head of denser wood.
It lies on a table. A parallel gripper closes from above, lifts it by 12 cm and holds it. It is not
to slip out of the pads, nor to tip by more than 40 degrees.

The nominal script knows the mesh alone: it grips through the mesh's centroid, square to the handle,
at the middle of the forces. Pads must not press harder than the handle's wood allows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.spatial.transform import Rotation

from energymargin import regions
from energymargin._core import (
    Box,
    Compound,
    ConvexHull,
    Inertial,
    Mimic,
    Part,
    Plan,
    Problem,
    Region,
    Scene,
    mass_properties,
)
from energymargin.beliefs import Uncertainty
from energymargin.disturbances import Uniform
from energymargin.tasks.base import STEP
from energymargin_paper.evidence.act_demo import Demo, Values, World, held, noise

__all__ = ["GraspDemo", "joined"]

# The mallet along x, from the handle's end; it lies on z = 0. At each end of a part: x, half of its
# width and its height [m].
HANDLE = ((0.0, 0.012, 0.026), (0.17, 0.020, 0.032))
HEAD = ((0.17, 0.035, 0.036), (0.20, 0.035, 0.036))
CHAMFER = 0.25  # of the upper edges, as a share of half of the width
DENSITIES = (600.0, 1600.0)  # kg/m^3, of handle and head
MASS_SPREAD = 0.1  # share of the mass, standard deviation
PLACE_SPREAD = 0.003  # m, standard deviation of the mallet's place on x and y
YAW_SPREAD = math.radians(4.0)
FRICTION = 0.7  # of the mallet; a contact's coefficient, since that of the pads is 1
TABLE_FRICTION = 0.7

# The gripper: a rail, a palm that it lifts, and two fingers of which one mirrors the other.
PAD = (0.03, 0.01, 0.04)  # m
PAD_MASS, PALM_MASS = 0.1, 1.0  # kg
PALM_SIZE, RAIL_SIZE = (0.03, 0.13, 0.02), (0.05, 0.05, 0.02)  # m
PALM_ABOVE, RAIL_ABOVE = 0.07, 0.5  # m, above the pads' middle
OPEN = 0.075  # m, from the middle to a pad's
FINGER = {"stiffness": 2000.0, "damping": 40.0}  # N/m, N s/m
RAIL_STIFFNESS, RAIL_DAMPING = 2e4, 400.0  # N/m, N s/m
PRESSURE = 20e3  # N/m^2 that the wood bears

# The motion.
LENGTH = 1.8  # s
CLOSE_TIME = 0.2  # s
LIFT_BEGIN, LIFT_TIME, LIFT = 0.3, 0.5, 0.12  # s, s, m

# The sets.
HOLD_SIZE = 0.06  # m, of the cube about the place in the hand where it is gripped
LARGEST_TILT = math.radians(40.0)
SUCCESS_LIFT = 0.08  # m

# The disturbance.
FORCE_BOUND, TORQUE_BOUND = 2.0, 0.05  # N, a weight, and N m
LONGEST_EDGE = 0.1  # s

# Held out: frictions of an even range, and noise with a memory in place of even pieces.
FRICTION_RANGE = (0.4, 1.0)
FORCE, TORQUE = 0.5, 0.01  # N, N m, standard deviations
CORRELATION = 0.1  # s


class GraspDemo(Demo):
    """Where and how hard to grip a mesh object."""

    name = "grasp"
    parameters: ClassVar[dict[str, tuple[float, float, float]]] = {
        "along": (-0.05, 0.0, 0.03),  # m, from the mesh's centroid towards the head, on the handle
        "height": (0.0205, 0.022, 0.035),  # m, of the pads' middle
        "yaw": (-0.25, 0.0, 0.25),  # rad, off square to the handle
        "squeeze": (4.0, 10.0, 16.0),  # N, of each finger
    }
    objective = "probability/success"
    disturbance = Uniform(0.5)
    budget = 3_000_000
    plane = ("x", "z")

    def __init__(self) -> None:
        """Makes the mallet."""
        self._parts = [_part(*HANDLE), _part(*HEAD)]
        _, self._centroid, _ = joined(self._parts, (1.0, 1.0))
        self._mass, self._center, self._inertia = joined(self._parts, DENSITIES)
        self.uncertainty = Uncertainty(
            friction={"mallet": stats.uniform(0.5, 0.4)},
            mass={"mallet": MASS_SPREAD * self._mass},
            pose=(PLACE_SPREAD, PLACE_SPREAD, 0.0, 0.0, 0.0, YAW_SPREAD),
        )

    @property
    def constraints(self) -> tuple[Callable[[dict[str, float]], float], ...]:
        """The wood bears the squeeze."""
        return (lambda values: self._allowed(values) - values["squeeze"],)

    def _allowed(self, values: Values) -> float:
        """The force that the wood bears where the pads touch it [N]."""
        at = self._centroid[0] + values["along"]
        ends = np.array([*HANDLE, *HEAD])
        top = float(np.interp(at, ends[:, 0], ends[:, 2]))
        low = values["height"] - PAD[2] / 2
        return PRESSURE * PAD[0] * max(0.0, min(top, low + PAD[2]) - low)

    def problem(self, values: Values, world: World | None = None) -> Problem:
        """As Demo.problem; a world has friction, share of the mass, x, y and yaw of the mallet."""
        made = self._scene(values, world or {})
        captured = self._captured(values)
        high = self._centroid[2] + SUCCESS_LIFT
        return Problem(
            made,
            made.pack(),
            force=(FORCE_BOUND,) * 3,
            torque=(TORQUE_BOUND,) * 3,
            duration=LONGEST_EDGE,
            captured=captured,
            succeeded=captured & regions.HalfSpace("mallet", (0.0, 0.0, -1.0), -high),
            horizon=LENGTH,
            plan=_plan(),
            start_outside=True,
        )

    def _captured(self, values: Values) -> Region:
        """It is where it was gripped, about, and level."""
        to_mallet = (-values["along"], 0.0, self._centroid[2] - values["height"] - PALM_ABOVE)
        turned = Rotation.from_euler("z", -values["yaw"]).apply(to_mallet)
        held_there = regions.Box("mallet", turned, (HOLD_SIZE,) * 3, frame="palm")
        up = (0.0, 0.0, 1.0)
        return held_there & regions.Tilt("mallet", up, up, LARGEST_TILT)

    def _scene(self, values: Values, world: World) -> Scene:
        made = Scene(step=STEP)
        made.add_plane("table", friction=TABLE_FRICTION)
        share = world.get("mass", 1.0)
        made.add_body(
            "mallet",
            Compound([Part(ConvexHull(points - self._centroid)) for points in self._parts]),
            mass=share * self._mass,
            inertial=Inertial(self._center - self._centroid, inertia=share * self._inertia),
            position=(world.get("x", 0.0), world.get("y", 0.0), self._centroid[2]),
            yaw=world.get("yaw", 0.0),
            friction=world.get("friction", FRICTION),
            role="object",
        )
        _add_gripper(made, values)
        return made

    def draw(self, random: np.random.Generator) -> World:
        """Friction, mass, and where the mallet lies."""
        return {
            "friction": random.uniform(*FRICTION_RANGE),
            "mass": max(0.5, random.normal(1.0, MASS_SPREAD)),
            "x": random.normal(scale=PLACE_SPREAD),
            "y": random.normal(scale=PLACE_SPREAD),
            "yaw": random.normal(scale=YAW_SPREAD),
        }

    def wrenches(
        self, random: np.random.Generator, times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """As Demo.wrenches."""
        deviations = np.array([FORCE] * 3 + [TORQUE] * 3)
        return held(times, lambda pieces: noise(random, pieces, deviations, CORRELATION))


def _part(*ends: tuple[float, float, float]) -> NDArray[np.float64]:
    """Corners of a convex mesh with chamfered upper edges, shape (12, 3)."""
    corners = []
    for x, half, height in ends:
        cut = CHAMFER * half
        for side in (-1.0, 1.0):
            corners += [(x, side * half, 0.0), (x, side * half, height - cut)]
            corners += [(x, side * (half - cut), height)]
    return np.array(corners)


def joined(
    parts: list[NDArray[np.float64]], densities: tuple[float, ...]
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Mass [kg], centre of mass [m] and inertia about it (3, 3) [kg m^2] of parts together."""
    solids = [mass_properties(ConvexHull(points)) for points in parts]
    masses = [one.volume * density for one, density in zip(solids, densities, strict=True)]
    mass = sum(masses)
    center = np.sum([m * one.center for m, one in zip(masses, solids, strict=True)], axis=0) / mass
    inertia = np.zeros((3, 3))
    for m, one in zip(masses, solids, strict=True):
        axes, off = Rotation.from_quat(one.axes).as_matrix(), one.center - center
        inertia += m * (axes @ np.diag(one.moments) @ axes.T)
        inertia += m * (off @ off * np.eye(3) - np.outer(off, off))
    return mass, center, inertia


def _add_gripper(made: Scene, values: Values) -> None:
    """Open, about the place where it grips."""
    place = np.array([values["along"], 0.0, values["height"]])
    above = np.array([0.0, 0.0, 1.0])
    rail, palm = place + RAIL_ABOVE * above, place + PALM_ABOVE * above
    made.add_body("rail", Box(RAIL_SIZE), mass=0.0, position=rail, yaw=values["yaw"])
    made.add_body(
        "palm",
        Box(PALM_SIZE),
        mass=PALM_MASS,
        position=palm,
        yaw=values["yaw"],
        role="effector",
    )
    made.add_joint(
        "lift",
        parent="rail",
        child="palm",
        type="prismatic",
        origin=palm - rail,
        axis=above,
        stiffness=RAIL_STIFFNESS,
        damping=RAIL_DAMPING,
    )
    _add_finger(made, "left", 1.0, values["squeeze"])
    _add_finger(made, "right", -1.0, None)


def _add_finger(made: Scene, name: str, side: float, squeeze: float | None) -> None:
    """With the drive of both, which takes twice the force of each [N], or the one that mirrors."""
    drive: dict[str, Any] = {"mimic": Mimic("left")}
    if squeeze is not None:
        limits, force = (0.0, 1.2 * OPEN), 2 * squeeze
        drive = {"start": OPEN, "limits": limits, "torque_limit": force, **FINGER}
    made.add_body(name, Box(PAD), mass=PAD_MASS, friction=1.0, role="effector")
    made.add_joint(
        name,
        parent="palm",
        child=name,
        type="prismatic",
        origin=(0.0, 0.0, -PALM_ABOVE),
        axis=(0.0, side, 0.0),
        **drive,
    )


def _plan() -> Plan:
    """The fingers close until the drive's limit holds them, and the palm rises."""
    times = np.arange(round(LENGTH / STEP)) * STEP
    closing = OPEN * (1.0 - np.clip(times / CLOSE_TIME, 0.0, 1.0))
    rising = LIFT * np.clip((times - LIFT_BEGIN) / LIFT_TIME, 0.0, 1.0)
    return Plan(STEP, targets={"left": closing, "lift": rising})
