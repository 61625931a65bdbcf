"""Policies against known answers: white noise on a grid, springs, a delay that swings a loop up.

The plant is a ball of 1 kg on a rail, or in space; the law pulls it back with a force
-k x - d v. A grid over x and v tells how often it stays under white noise, a spring does the same
by its nature, and the eigenvalues of the delayed loop tell from which delay on it swings up.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin import disturbances, regions
from energymargin._core import (
    Cancel,
    Feedback,
    Plan,
    Problem,
    Scene,
    Sphere,
    World,
    capture_probability,
    escape_effort,
)
from energymargin.base.table_text import markdown_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TITLE = "Known answers"
STEP = 1 / 240  # s
HALF = 0.1  # m, until where the ball is held
FORCE = 5.0  # N
# Stiffness [N/m] and damping [N s/m] of a law, and standard deviation of the noise [N].
NOISY = ((50.0, 2.0, 40.0), (50.0, 8.0, 60.0), (10.0, 4.0, 30.0))
SPRINGS = ("rail", "space")
LAWS = ((50.0, 2.0), (50.0, 8.0), (200.0, 10.0))  # of the delays
GRID, FASTEST, NODES = 241, 4.0, 9  # cells a side, m/s, nodes of the normal distribution
MANY = 300  # times as many rollouts as of other parts, against the grid
SPRING_SEEDS, SPRING_NODES = 8, 1000
BEYOND = (0.25, 0.5, 0.75, 0.9, 1.1, 1.25, 1.5)  # delays, as shares of the margin
AXES = "xyz"


def cases(settings: Any) -> list[str]:
    """A grid, a spring, or a delay each."""
    grids = [f"grid {number}" for number in range(len(NOISY))]
    return [*grids, *(f"spring {s}" for s in SPRINGS), *(f"delay {i}" for i in range(len(LAWS)))]


def run(case: str, settings: Any, cancel: Cancel) -> dict[str, Any]:
    """One of them."""
    kind, which = case.split()
    if kind == "grid":
        return _grid(*NOISY[int(which)], settings, cancel)
    if kind == "spring":
        return _spring(which, settings, cancel)
    return _delay(*LAWS[int(which)], settings, cancel)


def _grid(
    stiffness: float, damping: float, noise: float, settings: Any, cancel: Cancel
) -> dict[str, Any]:
    """The probability of staying for half a second, on the grid and of rollouts."""
    steps = 120
    asked = _ball("x", _law("x", stiffness, damping), horizon=steps * STEP, check=STEP)
    white = disturbances.Gaussian(force=noise, torque=0.0, correlation_time=1e-9)
    options: dict[str, Any] = {"rollouts": MANY * settings.rollouts, "seed": settings.seed}
    found = capture_probability(asked, disturbance=white, cancel=cancel, **options)
    known = _on_grid(stiffness, damping, noise, steps)
    return {"known": known, "found": found.captured, "interval": found.interval()}


def _on_grid(stiffness: float, damping: float, noise: float, steps: int) -> float:
    """Backward recursion of the probability of staying, over position and velocity."""
    from scipy.ndimage import map_coordinates, spline_filter

    middle = (GRID - 1) // 2
    sides = np.linspace(-1.0, 1.0, GRID)
    x, v = np.meshgrid(HALF * sides, FASTEST * sides)
    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    later = np.ones_like(x)
    for _ in range(steps):
        now, later = np.zeros_like(x), spline_filter(later)
        for node, weight in zip(nodes, weights / weights.sum(), strict=True):
            faster = v + STEP * (noise * node - stiffness * x - damping * v)
            farther = x + STEP * faster
            at = [(faster / FASTEST + 1) * middle, (farther / HALF + 1) * middle]
            stays = map_coordinates(later, at, mode="nearest", prefilter=False)
            now += weight * np.where(np.abs(farther) <= HALF, stays, 0.0)
        later = now
    return float(later[middle, middle])


def _spring(where: str, settings: Any, cancel: Cancel) -> dict[str, Any]:
    """Efforts and probabilities of a virtual spring, and of the spring that it is."""
    stiffness, damping = LAWS[0]
    axes = AXES if where == "space" else "x"
    law = _law(axes, stiffness, damping)
    if where == "space":
        six = [[value] * 3 + [0.0] * 3 for value in (stiffness, damping)]
        law = Feedback.impedance("ball", stiffness=six[0], damping=six[1], period=STEP)
    virtual = _ball(axes, law)
    real = _ball(axes, spring=(stiffness, damping))
    efforts = [
        [
            escape_effort(asked, nodes=SPRING_NODES, seed=settings.seed + k, cancel=cancel).effort
            for k in range(SPRING_SEEDS)
        ]
        for asked in (virtual, real)
    ]
    options: dict[str, Any] = {"rollouts": 30 * settings.rollouts, "seed": settings.seed}
    one, other = (capture_probability(p, cancel=cancel, **options) for p in (virtual, real))
    return {
        "effort": efforts,
        "probability": [one.captured, other.captured],
        "interval": one.interval(),
    }


def _delay(stiffness: float, damping: float, settings: Any, cancel: Cancel) -> dict[str, Any]:
    """From which delay on the loop swings up, and what the probability is before and after it."""
    margin = _margin(stiffness, damping)
    known = next(n for n in itertools.count() if _growth(stiffness, damping, n) > 1.0)
    found = next(n for n in itertools.count(max(known - 5, 0)) if _swings_up(stiffness, damping, n))
    delays = [0, *(round(share * margin / STEP) for share in BEYOND)]
    probabilities = [
        capture_probability(
            _ball("x", _law("x", stiffness, damping, delay), horizon=2.0),
            rollouts=10 * settings.rollouts,
            seed=settings.seed,
            cancel=cancel,
        ).captured
        for delay in delays
    ]
    return {
        "margin": margin,
        "known": known,
        "found": found,
        "delays": delays,
        "probabilities": probabilities,
    }


def _margin(stiffness: float, damping: float) -> float:
    """Delay margin of the loop (d s + k) / s^2 [s]: its phase margin over its crossover; a command
    that is held for a step is half a step late, too."""
    square = (damping**2 + np.sqrt(damping**4 + 4 * stiffness**2)) / 2
    crossover = np.sqrt(square)
    return float(np.arctan2(damping * crossover, stiffness) / crossover - STEP / 2)


def _growth(stiffness: float, damping: float, delay: int) -> float:
    """Largest absolute eigenvalue of a step of the loop, with the forces under way in its state."""
    step = np.zeros((delay + 3, delay + 3))
    asked = np.zeros(delay + 3)
    asked[:2] = -stiffness, -damping
    queue = np.eye(delay + 3)[2:]  # from the force that acts to the one that was just asked for
    force = asked if delay == 0 else queue[0]
    faster = np.eye(delay + 3)[1] + STEP * force
    step[0], step[1] = np.eye(delay + 3)[0] + STEP * faster, faster
    if delay:
        step[2 : delay + 1], step[delay + 1] = queue[1:delay], asked
    return float(np.abs(np.linalg.eigvals(step)).max())


def _swings_up(stiffness: float, damping: float, delay: int) -> bool:
    """Whether an undisturbed ball a millimetre off its place swings wider and wider."""
    asked = _ball("x", _law("x", stiffness, damping, delay))
    start = asked.scene.pack(ball={"position": (1e-3, 0.0, 0.0)})
    states = np.asarray(World(asked.scene, asked.plan).simulate(start, round(60 / STEP)).states)
    far = np.abs(states[:, 0])
    return bool(far[-len(far) // 6 :].max() > far[: len(far) // 6].max())


def _law(axes: str, stiffness: float, damping: float, delay: int = 0) -> Feedback:
    eye = np.eye(len(axes))
    return Feedback(
        np.hstack([stiffness * eye, damping * eye]),
        observed=[*(f"ball.{a}" for a in axes), *(f"ball.v{a}" for a in axes)],
        corrected=[f"ball.f{a}" for a in axes],
        period=STEP,
        delay=delay,
    )


def _ball(
    axes: str, plan: Plan | None = None, spring: tuple[float, float] | None = None, **options: Any
) -> Problem:
    """A ball without weight, free along some axes, that a plan or a spring holds."""
    free = [float(axis in axes) for axis in AXES]
    scene = Scene(gravity=(0, 0, 0), step=STEP)
    stiffness, damping = spring or (0.0, 0.0)
    scene.add_body(
        "ball",
        Sphere(0.05),
        mass=1.0,
        role="object",
        linear_factor=free,
        angular_factor=(0, 0, 0),
        linear_damping=damping if len(axes) > 1 else 0.0,  # a spring's own acts along it alone
    )
    scene.add_body("wall", Sphere(0.01), mass=0.0, position=(0, 0, 5))
    if spring:
        own = damping if len(axes) == 1 else 0.0
        scene.add_spring("wall", "ball", point_a=(0, 0, -5), stiffness=stiffness, damping=own)
    return Problem(
        scene,
        scene.pack(),
        captured=regions.Ball("ball", (0, 0, 0), HALF),
        plan=plan,
        force=FORCE * np.array(free),
        torque=(0, 0, 0),
        duration=0.1,
        **{"horizon": 1.0, **options},
    )


def report(settings: Any, found: dict[str, Any]) -> str:
    """A table of each kind."""
    text = (
        "A ball of 1 kg and the law -k x - d v, at 240 Hz. White noise on a rail for 0.5 s, "
        "against a backward recursion on a grid over x and v; a virtual spring against a spring; a "
        "delay, against the delay margin (phase margin over crossover) and the eigenvalues of the "
        "loop in steps. *In rollouts*: from which delay on a ball that nothing disturbs swings "
        "wider and wider."
    )
    tables = [_grid_table(found), _spring_table(found), _delay_table(found)]
    return "\n\n".join([text, *tables])


def _grid_table(found: dict[str, Any]) -> str:
    rows = [
        [
            f"{k:g}, {d:g}, {noise:g}",
            f"{one['known']:.4f}",
            f"{one['found']:.4f}",
            "{:.4f} to {:.4f}".format(*one["interval"]),
        ]
        for (k, d, noise), one in zip(NOISY, _of("grid", found), strict=True)
    ]
    header = ["k [N/m], d [N s/m], noise [N]", "held, on the grid", "in rollouts", "95 % interval"]
    return markdown_table(header, rows)


def _spring_table(found: dict[str, Any]) -> str:
    rows = []
    for where, one in zip(SPRINGS, _of("spring", found), strict=True):
        virtual, real = np.median(one["effort"], axis=1)
        low, high = one["interval"]
        rows.append(
            [
                f"on a {where}" if where == "rail" else f"in {where}",
                f"{virtual:.4f}, {real:.4f}",
                f"{abs(virtual / real - 1):.2%}",
                "{:.3f}, {:.3f}".format(*one["probability"]),
                f"{low:.3f} to {high:.3f}",
            ]
        )
    header = ["virtual spring, spring", "median effort [J]", "apart", "held", "95 % interval"]
    return markdown_table(header, rows)


def _delay_table(found: dict[str, Any]) -> str:
    rows = [
        [
            f"{k:g}, {d:g}",
            f"{1e3 * one['margin']:.1f}",
            f"{1e3 * STEP * one['known']:.1f}",
            f"{1e3 * STEP * one['found']:.1f}",
            ", ".join(
                f"{1e3 * STEP * n:.0f} ms {p:.2f}"
                for n, p in zip(one["delays"], one["probabilities"], strict=True)
            ),
        ]
        for (k, d), one in zip(LAWS, _of("delay", found), strict=True)
    ]
    header = ["k, d", "margin [ms]", "unstable from, eigenvalues", "in rollouts", "held, by delay"]
    return markdown_table(header, rows)


def _of(kind: str, found: dict[str, Any]) -> list[Any]:
    return [one for case, one in found.items() if case.startswith(kind)]


def draw(ax: Axes, found: dict[str, Any]) -> None:
    """Probability over the delay, as a share of the margin."""
    for (k, d), one in zip(LAWS, _of("delay", found), strict=True):
        shares = np.array(one["delays"]) * STEP / one["margin"]
        ax.plot(shares, one["probabilities"], "o-", ms=3, label=f"k {k:g}, d {d:g}")
    ax.axvline(1.0, color="black", lw=0.8, ls=":")
    ax.set_xlabel("delay / delay margin")
    ax.set_ylabel("probability")
    ax.legend(fontsize=7, frameon=False)
