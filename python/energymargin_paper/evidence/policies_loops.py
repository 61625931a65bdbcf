"""Open and closed: a plan, the same with an LQR along it, and with an impedance, on four tasks.

Tasks, beliefs and held-out worlds are those of the study `act`. Which of two controllers holds
better is told by their probabilities before the worlds are run.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Feedback, Problem, escape_effort
from energymargin.base.table_text import markdown_table
from energymargin.beliefs import Belief, score_belief
from energymargin_paper.evidence.act import demo_of
from energymargin_paper.evidence.act_demo import Demo
from energymargin_paper.evidence.act_trials import in_bullet, met
from energymargin_paper.evidence.policies_lqr import Law, followed, tracking

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TITLE = "Open and closed"
CONTROLLERS = ("plan", "LQR", "impedance")
FIRST = 20_000  # number of the first held-out world; those of `act` are from 10,000 on
NODES = 200  # of an effort

# What differs from the nominal plan, by task: where or how it begins.
STARTS: dict[str, tuple[dict[str, float], ...]] = {
    "push": ({}, {"offset": -0.1}, {"offset": 0.2}),
    "balance": ({}, {"peak": 0.8}, {"peak": 1.6}),
    "grasp": ({}, {"along": -0.03}, {"squeeze": 14.0}),
    "scoop": ({}, {"speed": 0.2}, {"speed": 0.5}),
}


def _names(body: str, axes: str) -> tuple[str, ...]:
    """Places and then velocities of a body: "x", "y", "z", or "X", "Y", "Z" about those."""
    pairs = {a: (a, f"v{a}") for a in "xyz"} | {a.upper(): (f"r{a}", f"w{a}") for a in "xyz"}
    return tuple(f"{body}.{pairs[a][k]}" for k in (0, 1) for a in axes)


BOXES = tuple(f"box_{k}" for k in range(4))
# What an LQR sees and commands, with the size of a correction.
LQR = {
    "push": Law(
        _names("object", "xyZ") + _names("effector", "xy"),
        {"effector.fx": 3.0, "effector.fy": 3.0},
        1 / 24,
        {"object.x - effector.x": 0.05, "object.rz": 0.2, "object.vy - effector.vy": 0.2},
    ),
    "balance": Law(
        _names("object", "xyZ") + _names("effector", "xyZ"),
        {"effector.fx": 2000.0, "effector.fy": 500.0, "effector.tz": 500.0},
        1 / 24,
        {
            "object.x - effector.x": 0.05,
            "object.vx - effector.vx": 0.1,
            "object.rz": 0.1,
            "effector.rz": 0.05,
        },
    ),
    "grasp": Law(
        (*_names("mallet", "xyzXYZ"), "lift", "lift.velocity"),
        {"left": 0.005, "lift": 0.01},
        1 / 24,
        {"mallet.z - lift": 0.02, "mallet.vz - lift.velocity": 0.1, "mallet.ry": 0.2},
    ),
    "scoop": Law(
        (*(name for box in BOXES for name in _names(box, "xz")), "scoop.x", "scoop.z"),
        {"scoop.vx": 0.1, "scoop.vz": 0.1},
        1 / 24,
        {f"{box}.{a} - scoop.{a}": 0.02 for box in BOXES for a in "xz"},
    ),
}
# What an impedance holds to the plan's motion at 240 Hz: by command, stiffness and damping.
HELD: dict[str, dict[str, tuple[str, str, float, float]]] = {
    "push": {f"effector.f{a}": (f"effector.{a}", f"effector.v{a}", 400.0, 80.0) for a in "xy"},
    "balance": {
        **{f"effector.f{a}": (f"effector.{a}", f"effector.v{a}", 4e4, 1e4) for a in "xy"},
        "effector.tz": ("effector.rz", "effector.wz", 2e4, 4e3),
    },
    "grasp": {"lift": ("mallet.z", "mallet.vz", 0.5, 0.0)},
    "scoop": {f"scoop.v{a}": (f"scoop.{a}", f"scoop.v{a}", 5.0, 0.0) for a in "xz"},
}


def cases(settings: Any) -> list[str]:
    """A controller at a start of a task."""
    return [
        f"{task} {start} {controller}"
        for task, starts in STARTS.items()
        for start in range(len(starts))
        for controller in CONTROLLERS
    ]


def run(case: str, settings: Any, cancel: Cancel) -> dict[str, Any]:
    """What is told of a controller, its effort, and in which worlds it loses."""
    task, start, controller = case.split()
    demo = demo_of(task)
    values = {**demo.nominal, **STARTS[task][int(start)]}
    problem = demo.problem(values)
    closed = _controlled(problem, task, controller)
    told, interval = _told(demo, closed, settings)
    effort = escape_effort(closed, nodes=NODES, seed=settings.seed, cancel=cancel).effort
    lost = []
    for world in range(FIRST, FIRST + settings.worlds):
        there, rows = met(demo, values, world)
        lost.append(in_bullet(there.replace(plan=closed.plan), rows, cancel).lost)
        if cancel.is_set:
            break
    return {"told": told, "interval": interval, "effort": effort, "lost": lost}


def _controlled(problem: Problem, task: str, controller: str) -> Problem:
    """The problem with a controller along its plan."""
    if controller == "plan":
        return problem
    law = LQR[task] if controller == "LQR" else _impedance(task)
    gains = tracking(problem, law) if controller == "LQR" else _held(task)
    robot: Feedback = followed(problem, law, gains)
    closed: Problem = problem.replace(plan=robot)
    return closed


def _impedance(task: str) -> Law:
    """Its names, at the simulation's rate; it may correct as much as the LQR, or more."""
    held = HELD[task].values()
    observed = tuple(name for pair in held for name in pair[:2])
    commands = {name: LQR[task].commands[name] for name in HELD[task]}
    return Law(observed, commands, 1 / 240)


def _held(task: str) -> NDArray[np.float64]:
    """Gains of an impedance, shape (m, 2 m)."""
    held = HELD[task].values()
    gains = np.zeros((len(held), 2 * len(held)))
    for row, (_, _, stiffness, damping) in enumerate(held):
        gains[row, 2 * row : 2 * row + 2] = stiffness, damping
    return gains


def _told(demo: Demo, problem: Problem, settings: Any) -> tuple[float, tuple[float, float]]:
    """The probability over what is believed of the world, and its interval."""
    scores = score_belief(
        Belief(problem, uncertainty=demo.uncertainty),
        ["probability"],
        rollouts=10 * settings.rollouts,
        strength=demo.disturbance.strength,
        seed=settings.seed,
        threads=1,
    )["probability"]
    return scores.mean, scores.interval()


def report(settings: Any, found: dict[str, Any]) -> str:
    """A table of all, and how often the better of two was told."""
    rows = []
    for task, starts in STARTS.items():
        for start, change in enumerate(starts):
            said = ", ".join(f"{name} {value:g}" for name, value in change.items()) or "nominal"
            for controller in CONTROLLERS:
                one = found[f"{task} {start} {controller}"]
                first = controller == CONTROLLERS[0]
                rows.append(
                    [
                        task if first and start == 0 else "",
                        said if first else "",
                        controller,
                        f"{one['told']:.2f}",
                        f"{1 - np.mean(one['lost']):.2f}",
                        f"{one['effort']:.3g}",
                    ]
                )
    header = ["task", "start", "controller", "told", "held in worlds", "effort [J]"]
    text = (
        "Tasks, beliefs and kinds of held-out worlds are those of [acting on the margin](act.md), "
        "in other worlds. *Told*: the probability over what is believed of the world, before any "
        "world is run. *Held*: the share of the held-out worlds. The LQR is along the plan, at 24 "
        "Hz, of a model by differences of rollouts; the impedance holds the robot to the plan's "
        "motion at 240 Hz, and on the grasp the lift to the object's height."
    )
    return "\n\n".join([text, markdown_table(header, rows), _compared(found)])


def _compared(found: dict[str, Any]) -> str:
    """Of the pairs of controllers at a start: whether the one told better holds better."""
    lines = []
    for name, sign, least in (("probability", "told", 0.05), ("effort", "effort", 0.0)):
        right, wrong, equal = 0, 0, 0
        for one, other in _pairs(found):
            ahead = one[sign] - other[sign]
            fewer = np.sum(other["lost"]) - np.sum(one["lost"])
            if abs(ahead) <= least or not np.isfinite(ahead):
                continue
            right += int(ahead * fewer > 0)
            wrong += int(ahead * fewer < 0)
            equal += int(fewer == 0)
        apart = f" by more than {least:g}" if least else ""
        lines.append(
            f"Pairs of controllers that differ in {name}{apart}: the better one was told in "
            f"**{right} of {right + wrong}**, and {equal} more lost as often."
        )
    return " ".join(lines)


def _pairs(found: dict[str, Any]) -> list[tuple[Any, Any]]:
    return [
        (found[f"{task} {start} {one}"], found[f"{task} {start} {other}"])
        for task, starts in STARTS.items()
        for start in range(len(starts))
        for one, other in itertools.combinations(CONTROLLERS, 2)
    ]


def draw(ax: Axes, found: dict[str, Any]) -> None:
    """Share of worlds that hold, over the probability told."""
    for controller, mark in zip(CONTROLLERS, "osD", strict=True):
        own = [one for case, one in found.items() if case.endswith(controller)]
        held = [1 - np.mean(one["lost"]) for one in own]
        ax.plot([one["told"] for one in own], held, mark, ms=4, alpha=0.7, label=controller)
    ax.plot([0, 1], [0, 1], color="black", lw=0.8, ls=":")
    ax.set(xlabel="probability told", ylabel="held in worlds")
    ax.legend(fontsize=7, frameon=False)
