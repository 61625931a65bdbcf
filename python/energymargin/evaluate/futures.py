"""The future of a problem: its states without a disturbance, and what it asks of it in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from energymargin._core import Cancel, Plan, Problem, World, capture_probability
from energymargin.base.aliases import Floats
from energymargin.disturbances import Uniform
from energymargin.evaluate.searches import SearchSettings

MOMENTS = 25  # a second of the simulation, about what the eye sees
NOTHING = Uniform(strength=0.0)
CHECK = "about 1/60 s"  # a problem that does not say when it looks
COASTS = "none: the effector coasts"

NamedValue = tuple[str, str]
"""A name and its value."""


class Undisturbed(NamedTuple):
    """The robot follows its plan, and no wrench acts on the objects: K moments."""

    times: Floats
    """From 0 to the horizon [s], shape (K,)."""
    states: Floats
    """Shape (K, n)."""
    exit: float | None
    """When the objects are first seen outside of the capture set, for long enough [s]; None: they
    stay captured."""

    @property
    def exit_moment(self) -> int | None:
        """The first moment from the exit on; None if there is no exit."""
        if self.exit is None:
            return None
        return min(int(np.searchsorted(self.times, self.exit - 1e-9)), len(self.times) - 1)

    @property
    def words(self) -> str:
        """What becomes of the objects: "undisturbed it leaves at 0.52 s"."""
        if self.exit is None:
            return f"undisturbed it stays captured for {self.times[-1]:.3g} s"
        return f"undisturbed it leaves at {self.exit:.3g} s"


def or_success(problem: Problem) -> Problem:
    """The question whether the objects are lost, other than by success: a state in the success set
    counts as captured. A problem without a success set is returned as it is."""
    if problem.succeeded is None:
        return problem
    return problem.replace(captured=problem.captured | problem.succeeded)


def undisturbed(problem: Problem, cancel: Cancel | None = None) -> Undisturbed:
    """Simulates the future of a problem with a horizon.

    Raises ValueError on a problem without one, RuntimeError if the simulation diverges, and
    Cancelled once `cancel` is set.
    """
    found = capture_probability(problem, disturbance=NOTHING, rollouts=1, cancel=cancel)
    step = problem.scene.step
    steps, stride = round(float(found.times[-1]) / step), max(1, round(1.0 / (MOMENTS * step)))
    record = [*range(0, steps, stride), steps]
    start = problem.edge_start(problem.state)
    world = World(problem.scene, problem.plan)
    states = world.simulate(start, steps, record=record, cancel=cancel).states
    leaves = None if found.undisturbed else found.undisturbed_time
    return Undisturbed(np.array(record) * step, states, leaves)


def future_rows(problem: Problem) -> list[NamedValue]:
    """Horizon, looks at the capture set, and plan; nothing of a problem without a clock."""
    if problem.horizon is None:
        return []
    looks = CHECK if problem.check is None else f"{problem.check:.3g} s"
    rows = [("horizon", f"{problem.horizon:.4g} s"), ("between two looks", looks)]
    if problem.dwell > 0.0:
        rows.append(("an escape lasts", f"at least {problem.dwell:.3g} s"))
    if problem.plan is None:
        return [*rows, ("plan", COASTS)]
    if problem.plan.policy is None:
        rows.append(("plan", f"{problem.plan.duration:.4g} s"))
    return [*rows, *_actions(problem.plan)]


def plan_rows(plan: Plan) -> list[NamedValue]:
    """Duration and rows of a plan, and its wrenches, velocities and targets."""
    rows = f"{plan.rows} of {plan.step:.3g} s"
    return [("duration", f"{plan.duration:.4g} s"), ("rows", rows), *_actions(plan)]


def uniform_in_words(model: Uniform) -> str:
    """A disturbance, such as "random wrenches within the bounds, on 1 object at a time"."""
    share = "" if model.strength == 1.0 else f"{model.strength:g} times "
    hold = "" if model.hold is None else f", each held for up to {model.hold:g} s"
    objects = ""
    if model.objects is not None:
        objects = f", on {model.objects} object{'s' * (model.objects != 1)} at a time"
    return f"random wrenches within {share}the bounds{objects}{hold}"


def _actions(plan: Plan) -> list[NamedValue]:
    """Who reacts, and what it acts on: bodies by wrenches and velocities, joints by targets."""
    acts = {"wrenches": plan.wrenches, "velocities": plan.velocities, "targets": plan.targets}
    rows = [(name, f"of {', '.join(given)}") for name, given in acts.items() if given]
    if plan.feedback is None:
        return rows
    name = "feedback" if plan.policy is None else f"policy {plan.policy.name}"
    return [(name, f"every {plan.feedback['period']:.3g} s"), *rows]


def disturbance_in_words(settings: Mapping[str, Any]) -> str:
    """Rollouts and disturbance of a run's probabilities; missing settings are the defaults."""
    names = ("rollouts", "strength", "objects", "common_random_numbers")
    chosen = SearchSettings(**{name: settings[name] for name in names if name in settings})
    disturbance = uniform_in_words(chosen.disturbance)
    text = f"of {chosen.rollouts} rollouts of each state, under {disturbance}"
    return f"{text}, the same ones for all states" if chosen.common_random_numbers else text
