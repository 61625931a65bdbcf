"""The grips of `energymargin demo`: where along its handle does a hand hold a mallet best?"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import energymargin as em
from energymargin.base.bars import bar
from energymargin.base.replacing import replace_figure

HANDLE, HEAD = (0.024, 0.22, 0.024), (0.11, 0.05, 0.05)  # m: along x, y and z, on a table
MASS = 0.4  # kg, of hard wood
BELOW_HEAD = (0.02, 0.05, 0.08, 0.11, 0.14, 0.17)  # m, of the middle of the pads
POSE_ERRORS = (0.003, 0.003, 0.001, 0.02, 0.02, 0.03)  # m, rad: standard deviations
FRICTION_ERROR = 0.1  # standard deviation
LIFT, LARGEST_TILT = 0.15, 0.6  # m, rad


def score_grips(trials: int, executor: em.executors.Executor) -> em.grasps.GraspScores:
    """A Panda lifts a mallet by its handle in six ways, so many trials each."""
    handle = em.Part(em.Box(HANDLE), (0.0, -HANDLE[1] / 2, HANDLE[2] / 2))
    head = em.Part(em.Box(HEAD), (0.0, HEAD[1] / 2, HEAD[2] / 2))
    poses = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (len(BELOW_HEAD), 1, 1))  # from above
    poses[:, 1, 3], poses[:, 2, 3] = -np.array(BELOW_HEAD), HANDLE[2] / 2
    names = tuple(f"{100 * below:.0f} cm below the head" for below in BELOW_HEAD)
    motions = [em.grasps.Motion("lift", 0.6, LIFT), em.grasps.Motion("hold", 0.4)]
    with bar("Gripping a mallet", "grips") as progress:
        return em.grasps.score(
            em.grasps.GraspSet(poses, names=names),
            "panda",
            em.grasps.GraspObject(em.Compound([handle, head]), MASS),
            em.grasps.Protocol(motions, table=True, angle=LARGEST_TILT),
            belief=em.grasps.GraspBelief(pose=POSE_ERRORS, friction=FRICTION_ERROR),
            rollouts=trials,
            executor=executor,
            progress=progress,
        )


def draw_grips(scores: em.grasps.GraspScores, folder: Path) -> None:
    """grip.png has the best grip from two sides, grips.png the probability of each."""
    from matplotlib.figure import Figure

    best = scores.best
    figure, (low, high) = em.plots.figure_grasp(scores, best), scores.interval()[best]
    figure.suptitle(
        f"{scores.grasps.names[best]}: holds with a probability of "
        f"{scores.probabilities[best]:.2f}, 95 % interval {low:.2f} to {high:.2f}"
    )
    figure.set_size_inches(7.0, 2.9)
    replace_figure(folder / "grip.png", figure, dpi=150)
    chart = Figure(figsize=(8.0, 3.6), layout="constrained")
    axes = em.plots.plot_grasps(scores, chart.subplots())
    axes.set(title="A hand lifts a mallet by its handle", xlabel="where the hand grips")
    axes.tick_params(axis="x", rotation=20)
    replace_figure(folder / "grips.png", chart, dpi=150)
