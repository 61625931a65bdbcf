"""Edges of wrenches, played in MuJoCo until they have led out of the capture set."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Cancelled, Problem, Region
from energymargin.mujoco.simulation import Simulation
from energymargin.mujoco.ticks import Ticks
from energymargin.reprs import short_repr

__all__ = ["Edge", "Played", "Player"]

Vector = NDArray[np.float64]

ALMOST = 1e-6  # of the time between two looks: so close to one, it is that one
CHECK = 1 / 60  # s between two looks, where a problem with a clock does not say


class Edge(NamedTuple):
    """Wrenches that are held for a while."""

    wrenches: Vector
    """On the k objects, shape (k, 6) [N, N m]."""
    duration: float
    """[s]."""


@dataclass(frozen=True, eq=False)
class Played:
    """What became of the edges."""

    __repr__ = short_repr

    escaped: bool
    time: float
    """Of the exit, or of the end [s]."""
    effort: float
    """Until then, integral of |f . v + tau . omega| dt [J]."""
    work: float
    """The same with its sign [J]."""
    state: Vector
    """At that time, shape (n,)."""
    end: Vector
    """At the end of the edges, or at the exit if it stopped there, shape (n,)."""


class _Exit(NamedTuple):
    """An instant, and what had been done until then."""

    time: float
    effort: float
    work: float
    state: Vector


class Player:
    """Plays edges from the state of some data, as the search for an escape does.

    Without a clock a look at the capture set follows each step of the scene, and after the edges
    the objects go on without a wrench for as long as a longest edge. With a clock the robot follows
    its plan, a look follows each `check`, and all ends at the horizon. There an exit counts if,
    without a wrench from then on, all looks are outside until `dwell` is over. Each look, and each
    end of an edge, is at the step of MuJoCo that is nearest to its time.
    """

    def __init__(
        self,
        problem: Problem,
        captured: Region,
        model: Any,
        data: Any,
        cancel: Cancel | None = None,
    ) -> None:
        """`captured`: the set that is left. Raises ValueError as `Simulation`."""
        self._cancel = cancel
        self._problem, self._captured, self._scene = problem, captured, problem.scene
        self._start = Simulation(self._scene, model, data, problem.plan)
        self._timestep = float(model.opt.timestep)
        self._none = np.zeros((len(self._start.objects), 6))
        step = self._scene.step
        if problem.horizon is not None:
            step *= max(1, round((problem.check or CHECK) / step))
        self._between_looks = step
        self._looks = Ticks(step, self._timestep)

    @property
    def start(self) -> Vector:
        """The state of the data, shape (n,)."""
        return self._start.state()

    def play(self, edges: Iterable[Edge], *, stop: bool = True) -> Played:
        """`stop`: at the exit; else it goes on to the end of the edges.

        Raises RuntimeError if MuJoCo diverges, Cancelled once `cancel` is set.
        """
        simulation, until, horizon = self._start.branch(), 0.0, self._problem.horizon
        first = self._exit(simulation)
        for edge in edges:
            until = (
                until + edge.duration if horizon is None else min(until + edge.duration, horizon)
            )
            first = self._go(simulation, edge.wrenches, until, first, stop=stop)
        end = simulation.state()
        over = until + self._problem.duration if horizon is None else horizon
        first = self._go(simulation, self._none, over, first, stop=True)
        last = first or _instant(simulation)
        return Played(first is not None, *last, end)

    def _go(
        self,
        simulation: Simulation,
        wrenches: Vector,
        until: float,
        first: _Exit | None,
        *,
        stop: bool,
    ) -> _Exit | None:
        """Goes on to a time [s], or to the exit; returns the exit, if there is one by then."""
        if first and stop:
            return first
        self._begin_edge(simulation, wrenches)
        while self._go_to_look(simulation, until):
            first = first or self._exit(simulation)
            if first and stop:
                break
        return first

    def _go_to_look(self, simulation: Simulation, until: float) -> bool:
        """To the next look, or to a time [s]; False if it is there already."""
        if self._cancel and self._cancel.is_set:
            raise Cancelled("cancelled while an escape was played in MuJoCo")
        last = round(until / self._timestep)
        steps = min(self._looks.next(simulation.steps), last) - simulation.steps
        simulation.advance(steps)
        return steps > 0

    def _begin_edge(self, simulation: Simulation, wrenches: Vector) -> None:
        simulation.push(wrenches)
        if self._problem.effector == "drive":
            simulation.put(self._problem.edge_start(simulation.state()))

    def _exit(self, simulation: Simulation) -> _Exit | None:
        """This instant, if it is one."""
        if not self._outside(simulation) or not self._stays_outside(simulation.branch()):
            return None
        return _instant(simulation)

    def _outside(self, simulation: Simulation) -> bool:
        """Whether this is a look, and outside."""
        if not self._is_look(simulation):
            return False
        return not self._captured.contains(self._scene, simulation.state())

    def _is_look(self, simulation: Simulation) -> bool:
        steps, looks, horizon = simulation.steps, self._looks, self._problem.horizon
        at_end = horizon is not None and steps == round(horizon / self._timestep)
        return at_end or steps == looks.step(looks.last(steps))

    def _stays_outside(self, simulation: Simulation) -> bool:
        horizon, between = self._problem.horizon, self._between_looks
        if horizon is None:
            return True
        more = math.ceil(self._problem.dwell / between - ALMOST)
        until = min((self._looks.last(simulation.steps) + more) * between, horizon)
        self._begin_edge(simulation, self._none)
        while self._go_to_look(simulation, until):
            if self._is_look(simulation) and not self._outside(simulation):
                return False
        return True


def _instant(simulation: Simulation) -> _Exit:
    return _Exit(simulation.time, simulation.effort, simulation.work, simulation.state())
