"""Will a recorded push succeed? Asked long before its end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Plan, Scene, World, stream
from energymargin.published.recorded import PublishedRecorded
from energymargin.published.recordings import Track, steady

__all__ = ["early_success"]

# The errors of a push that goes on: of the tool's speed and of its direction, as shares of the
# speed, and of its turn.
SPEED_ERROR, SIDE_ERROR, TURN_ERROR = 0.3, 0.1, 0.1  # -, -, rad/s
TAG_ERROR = 0.01  # m, of the tag's last place as against the observer's eye
STOP_Y = -0.1  # m: no tool of a recording is pushed on much nearer to the wall
ARM = (3.0, 1.0)  # N, N m, with which the arm holds the tool's velocity


def early_success(
    task: PublishedRecorded,
    track: Track,
    frame: int,
    state: NDArray[np.float64],
    *,
    rollouts: int,
    seed: int,
    cancel: Cancel | None = None,
) -> float:
    """Probability that a recording ends well, at one of its frames with its state, shape (n,).

    The tool goes on to the last frame at its mean velocity since it began to move, with an error in
    each of the rollouts but the first. Of where the object then lies, the chance that the observer
    sees a success is a logistic of the distance to it, of the scale TAG_ERROR.
    """
    scene = task.scene({})
    steps = round((track.times[-1] - track.times[frame]) / scene.step)
    random = np.random.default_rng(stream(seed, 1000 * track.number + frame))
    mean = steady(track, frame)
    last = []
    for number in range(rollouts):
        rate = _with_error(mean, random) if number else mean
        reached = _pushed(scene, state, rate, steps, cancel)
        body = scene.unpack(reached)["object"]
        last.append((*body["position"][:2], body["yaw"]))
    margins = task.margin(np.array(last))
    return float(np.mean(1 / (1 + np.exp(np.minimum(margins / TAG_ERROR, 500.0)))))


def _with_error(rate: NDArray[np.float64], random: np.random.Generator) -> NDArray[np.float64]:
    """A velocity x, y [m/s] and turn [rad/s]. Pushes go along y, so a side error is along x."""
    along, side, turn = random.standard_normal(3)
    speed = float(np.hypot(*rate[:2]))
    x, y = rate[:2] * (1 + SPEED_ERROR * along)
    return np.array([x + SIDE_ERROR * speed * side, y, TURN_ERROR * turn])


def _pushed(
    scene: Scene,
    state: NDArray[np.float64],
    rate: NDArray[np.float64],
    steps: int,
    cancel: Cancel | None,
) -> NDArray[np.float64]:
    """The state after so many steps of a tool that keeps its velocity until it is near the wall."""
    if steps < 1:
        return state
    start = state[scene.slice("effector").start + 1]
    y = start + rate[1] * scene.step * np.arange(steps)
    twists = np.zeros((steps, 6))
    twists[:, :2], twists[:, 5] = rate[:2], rate[2]
    twists[y < STOP_Y] = 0.0
    plan = Plan(scene.step, velocities={"effector": twists}, limits={"effector": ARM})
    return np.asarray(World(scene, plan).simulate(state, steps, cancel=cancel).states[-1])
