"""Records the pushes of `push-real`: a simulated stand-in for a camera over a real table.

The recordings of the paper (Section VI-E) are not public. So another physics engine, MuJoCo, takes
the place of the world, an arm is sent 5 to 8 mm beside its commands, somebody steers it by joystick
with a delay, and a camera sees both bodies with noise, 33 times a second. Friction and mass are not
those that are told. 12 trajectories of each of ten combinations, 100 frames each, with the verdict
of an observer who sees where the object really is.

    pip install mujoco
    python data/push_real/record.py            # writes the CSV files beside this script
"""

from __future__ import annotations

import argparse
import csv
import itertools
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from real_world import WALL, RealWorld, Truth

from energymargin_paper.paper.printed import OBJECTS, TOOLS, Printed, printed

TRAJECTORIES = 12
FRAMES = 100
RATE = 33.0  # Hz
FRICTION = 27 / 68  # what was measured
FIELDS = ("x", "y", "yaw")

# The camera.
POSITION_NOISE = 0.0005  # m, standard deviation
YAW_NOISE = math.radians(0.5)
TIME_JITTER = 0.001  # s, to both sides

# The truth, as a share of what is told, to both sides.
FRICTION_ERROR = 0.2
MASS_ERROR = 0.1

# The start.
OBJECT_Y = (0.0, 0.02)  # m
OBJECT_SPREAD = 0.01  # m, of x, to both sides
OBJECT_YAW = math.radians(15)  # to both sides
GAP = (0.004, 0.012)  # m, between tool and object
FAR, NEARER = 0.15, 0.001  # m: the tool comes from there, in such steps

# The arm.
ARM_ERROR = (0.005, 0.008)  # m, how far it is from its command
ARM_DRIFT = 0.5  # rad/s^0.5, by which the direction of that wanders

# The person at the joystick.
DELAY = 0.25  # s, until what was seen has an effect
SPEED = (0.055, 0.075)  # m/s
TREMOR = 0.012  # m/s, standard deviation of each axis
TREMOR_TIME = 0.3  # s, for which it stays alike
SKILL = (0.0, 1.5)  # 1/s, how fast a deviation is steered against
AIM = {"jaw": 0.9, "round": 0.8}  # how far off the middle some aim, as a share of half the width
SIDEWAYS = 0.03  # m/s, at most
ARRIVED = 0.002  # m from where the object lies at the wall: there the person stops
CLEAR = 0.005  # m, that the tool stays off the wall

# The observer.
AT_WALL = 0.02  # m
ALIGNED = math.radians(25)


class Operator:
    """Pushes the object ahead, and steers behind its middle: with delay, tremor and some skill."""

    def __init__(self, random: np.random.Generator, aim: float) -> None:
        """Aims up to `aim` [m] off the object's middle."""
        self._random = random
        self._aim = random.uniform(-aim, aim)  # m, off the object's middle
        self._skill = random.uniform(*SKILL)
        self._speed = random.uniform(*SPEED)
        self._tremor = np.zeros(2)
        self._seen: list[float] = []

    @property
    def aim(self) -> float:
        """Where behind the object the push begins [m]."""
        return self._aim

    def velocity(self, body: NDArray[np.float64], tool: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of the joystick, (2,) [m/s], after a look at the poses."""
        self._seen.append(body[0] + self._aim - tool[0])
        behind = self._seen[max(0, len(self._seen) - 1 - round(DELAY * RATE))]
        keep = math.exp(-1 / (RATE * TREMOR_TIME))
        self._tremor = keep * self._tremor + self._random.normal(
            0, TREMOR * math.sqrt(1 - keep**2), 2
        )
        begun = min(1.0, len(self._seen) / (0.3 * RATE))
        sideways = np.clip(self._skill * behind, -SIDEWAYS, SIDEWAYS)
        return begun * np.array([sideways, self._speed]) + self._tremor * begun


class Arm:
    """Where the arm goes when it is sent somewhere."""

    def __init__(self, random: np.random.Generator) -> None:
        """Off its commands by an error that is drawn here, and wanders."""
        self._random = random
        self._error = random.uniform(*ARM_ERROR)
        self._angle = random.uniform(-math.pi, math.pi)

    def reached(self, command: NDArray[np.float64]) -> NDArray[np.float64]:
        """x, y, yaw, after a frame's time."""
        self._angle += self._random.normal(0, ARM_DRIFT / math.sqrt(RATE))
        x, y = command + self._error * np.array([math.cos(self._angle), math.sin(self._angle)])
        return np.array([x, y, 0.0])


def push(
    body: Printed, tool: Printed, aim: float, random: np.random.Generator
) -> NDArray[np.float64]:
    """One trajectory as it really was: rows of time, object's x, y, yaw and tool's x, y, yaw."""
    truth = Truth(
        table_friction=FRICTION * random.uniform(1 - FRICTION_ERROR, 1 + FRICTION_ERROR),
        tool_friction=FRICTION * random.uniform(1 - FRICTION_ERROR, 1 + FRICTION_ERROR),
        mass=body.mass * random.uniform(1 - MASS_ERROR, 1 + MASS_ERROR),
    )
    world = RealWorld(body, tool, truth)
    operator, arm = Operator(random, aim), Arm(random)
    start = np.array(
        [
            random.uniform(-OBJECT_SPREAD, OBJECT_SPREAD),
            random.uniform(*OBJECT_Y),
            random.uniform(-OBJECT_YAW, OBJECT_YAW),
        ]
    )
    tool_pose = _behind(world, start, operator.aim, random.uniform(*GAP))
    command = tool_pose[:2] - arm.reached(np.zeros(2))[:2]
    times = np.arange(FRAMES) / RATE
    times[1:] += random.uniform(-TIME_JITTER, TIME_JITTER, FRAMES - 1)
    rows = []
    for time in times:
        if rows:
            world.run(time, arm.reached(command))
        rows.append([world.time, *world.object_pose, *world.tool_pose])
        command += operator.velocity(world.object_pose, world.tool_pose) / RATE
        arrived = world.object_pose[1] > WALL - body.ahead - ARRIVED
        farthest = world.tool_pose[1] if arrived else WALL - _front(tool) - CLEAR
        command[1] = min(command[1], farthest)
    return np.array(rows)


def _behind(
    world: RealWorld, start: NDArray[np.float64], aim: float, gap: float
) -> NDArray[np.float64]:
    """Puts the tool behind the object, so far away; where it is then: x, y, yaw."""
    pose = start + np.array([aim, -FAR, -start[2]])
    world.start(start, pose)
    while world.gap > gap:
        pose[1] += NEARER
        world.start(start, pose)
    return pose


def _front(tool: Printed) -> float:
    """How far the tool reaches ahead of its centre [m]."""
    return tool.radius if tool.radius is not None else tool.ahead


def observed(pose: NDArray[np.float64], body: Printed) -> bool:
    """Whether somebody who looks on says that the object's longest edge lies at the wall."""
    _, y, yaw = pose
    return abs(y - (WALL - body.ahead)) < AT_WALL and abs(yaw) < ALIGNED


def seen(rows: NDArray[np.float64], random: np.random.Generator) -> NDArray[np.float64]:
    """The same as the camera has it."""
    noise = np.tile([POSITION_NOISE, POSITION_NOISE, YAW_NOISE], 2)
    noisy = rows.copy()
    noisy[:, 1:] += random.normal(0, noise, (len(rows), 6))
    return noisy


def write(path: Path, rows: NDArray[np.float64]) -> None:
    """A recording: frame, time [s], and x [m], y [m], yaw [rad] of object and effector."""
    names = [f"{body}_{field}" for body in ("object", "effector") for field in FIELDS]
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["frame", "time", *names])
        for frame, (time, *poses) in enumerate(rows):
            writer.writerow([frame, f"{time:.4f}", *(f"{value:.5f}" for value in poses)])


def record(folder: Path, seed: int) -> list[tuple[str, bool]]:
    """Writes all recordings, and gives the verdict on each."""
    verdicts = []
    for number, (name, effector) in enumerate(itertools.product(OBJECTS, TOOLS)):
        body, tool = printed("objects", name), printed("effectors", effector)
        for trajectory in range(TRAJECTORIES):
            random = np.random.default_rng([seed, number, trajectory])
            rows = push(body, tool, AIM[effector] * body.width / 2, random)
            file = f"{name}-{effector}-{trajectory:02}.csv"
            write(folder / file, seen(rows, random))
            verdicts.append((file, observed(rows[-1, 1:4], body)))
    return verdicts


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    verdicts = record(given.out, given.seed)
    with (given.out / "labels.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["recording", "success"])
        writer.writerows((name, int(success)) for name, success in verdicts)


if __name__ == "__main__":
    main()
