"""How much each grasp can take: the least force of the hand, the largest error of its pose."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin import Cancel, Cancelled, CriticalValue, Inertial, critical_value_of
from energymargin.base.checks import one_of, require
from energymargin.base.limits import Limit
from energymargin.base.plausibility import kept_warnings
from energymargin.executors import Executor, ask
from energymargin.grasps.grasp_object import GraspObject
from energymargin.grasps.grasp_set import GraspSet
from energymargin.grasps.hands import Hand, ParallelGripper
from energymargin.grasps.outcomes import Grasp
from energymargin.grasps.protocols import Protocol
from energymargin.grasps.scores import grasp_of
from energymargin.grasps.scoring import kept_rows, trials_of
from energymargin.grasps.trials import GraspTrials
from energymargin.summary import Summarized

AXES = ("x", "y", "z", "rx", "ry", "rz")
UNITS = {"force": "N", "friction": "", "mass": "kg"}
UNITS |= dict.fromkeys(AXES[:3], "m") | dict.fromkeys(AXES[3:], "rad")
"""What can be varied, and its unit."""

OF_SCORE = ("belief", "disturbance", "colliding", "seed", "step")
IN_JSON = ("side", "unit", "crossings", "monotone", "rollouts", "range")
Ranges = Mapping[str, tuple[float, float]]
Found = dict[str, CriticalValue]


@dataclass(frozen=True, eq=False, repr=False)
class GraspLimits(Summarized):
    """How much n grasps can take."""

    grasps: GraspSet
    limits: dict[str, list[CriticalValue | None]]
    """By quantity, of each grasp; None of one that was not finished, or failed."""
    errors: dict[int, str]
    """Why a grasp has none, by its number."""

    def to_json(self) -> str:
        """A row for each grasp: its name, where each quantity crosses and the interval."""
        rows = []
        for k, name in enumerate(self.grasps.names):
            found = {quantity: of[k] for quantity, of in self.limits.items()}
            rows.append({"grasp": name, "error": self.errors.get(k), **found})
        return json.dumps(rows, indent=1, default=lambda one: {k: vars(one)[k] for k in IN_JSON})

    @property
    def complete(self) -> bool:
        """Whether every grasp has its limits, or an error."""
        first = next(iter(self.limits.values()))
        return all(one or number in self.errors for number, one in enumerate(first))

    def values(self, quantity: str) -> NDArray[np.float64]:
        """Critical values, shape (n,); NaN where there is none in the range."""
        return np.array([np.nan if one is None else one.value for one in self.limits[quantity]])


def limits(
    grasps: GraspSet,
    hand: Hand | str,
    object: GraspObject,
    protocol: Protocol | str = "hold",
    *,
    vary: Ranges,
    probability: float = 0.95,
    confidence: float = 0.95,
    draws: int | None = None,
    tolerance: float = 0.02,
    store: str | Path | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    **asked: Any,
) -> GraspLimits:
    """How hard must the hand close, how far may it be off, how slippery may the object be?

    Args:
        grasps, hand, object, protocol: as of `em.grasps.score`.
        vary: ranges by quantity, one varied at a time: "force" of the grip [N], of a
            ParallelGripper; "friction" and "mass" [kg] of the object; "x", "y", "z" [m], by which
            the hand is off along an axis of the grasp frame, and "rx", "ry", "rz" [rad], by which
            it is turned about one.
        probability: with which the grasp is to hold.
        confidence: of each interval.
        draws: how many trials of each value there may be; None: as of `em.critical_value`.
        tolerance: to which share of itself a critical value is searched.
        store: a file of answers. Grasps whose limits it has are not asked again.
        threads: None takes all cores that this process may use. Nothing depends on them.
        executor: in place of threads, of `em.executors`.
        progress: progress(done, total) counts grasps.
        timeout: after so many seconds the grasps count that are finished.
        cancel: the same once it is set.
        asked: belief, disturbance, colliding, seed and step, as of `em.grasps.score`.

    `em.critical_value` says what comes out. Raises ValueError on bad arguments.
    """
    if more := [name for name in asked if name not in OF_SCORE]:
        expected = f"expected vary, draws, or of a trial {', '.join(OF_SCORE)}"
        raise TypeError(f"limits takes no {', '.join(more)}, {expected}")
    require(isinstance(vary, Mapping) and vary, "vary", vary, "ranges by name, {'force': (1, 60)}")
    sizes: dict[str, Any] = {"probability": probability, "confidence": confidence, "draws": draws}
    sizes["tolerance"] = tolerance
    trials = trials_of(grasps, hand, object, protocol, **asked)
    question = _Question(trials, vary, sizes)
    limit, every = Limit(timeout, cancel), [grasp_of(grasps, k) for k in range(len(grasps))]
    question.check(every[0])
    found: dict[int, Found | str] = {}
    ends = {name: list(map(float, vary[name])) for name in vary}

    def note(answers: Sequence[tuple[Grasp, Found | str]]) -> None:
        found.update({grasp.number: answer for grasp, answer in answers})

    where: Any = {"threads": threads, "executor": executor, "progress": progress}
    with kept_rows(store, trials, "limits", ends, sizes, read=_read, written=_written) as kept:
        ask([every], question.limits, note, kept=kept, total=len(every), **where, **limit.rest())
    if not found:
        limit.require("a grasp has its limits")
    errors = {k: one for k, one in sorted(found.items()) if isinstance(one, str)}
    whole = [None if isinstance(one := found.get(g.number), str) else one for g in every]
    of_grasps = {q: [None if one is None else one[q] for one in whole] for q in vary}
    return GraspLimits(grasps, of_grasps, errors)


@dataclass(frozen=True, eq=False)
class _Question:
    """What is asked of each grasp."""

    trials: GraspTrials
    vary: Ranges
    sizes: dict[str, Any]
    """Arguments of `critical_value_of`."""

    def check(self, grasp: Grasp) -> None:
        """Raises ValueError on what cannot be varied, or not so far."""
        for name, ends in self.vary.items():
            one_of("vary", name, tuple(UNITS))
            if name not in AXES and self.trials.belief.fixes(name):
                why = "which the belief draws whatever it is, expected a standard deviation there"
                raise ValueError(f"vary is {name!r}, {why}, or relative=True")
            critical_value_of(lambda _, draws: np.ones(len(draws)), name, ends, **self.sizes)
            for end in ends:
                self._varied(grasp, name, end)

    def limits(self, grasps: Sequence[Grasp], cancel: Cancel) -> list[Found | str]:
        """On a worker: the limits of some grasps, or why they have none."""
        done: list[Found | str] = []
        with kept_warnings():
            for grasp in grasps:
                try:
                    done.append({name: self._limit(grasp, name, cancel) for name in self.vary})
                except (ValueError, RuntimeError) as error:
                    if cancel.is_set:  # what was stopped half-way counts as not begun
                        break
                    done.append(str(error))
        return done

    def _limit(self, grasp: Grasp, name: str, cancel: Cancel) -> CriticalValue:
        """The limit of a quantity; raises Cancelled if it is stopped."""

        def outcomes(value: float, numbers: Sequence[int]) -> list[float]:
            other, moved = self._varied(grasp, name, value)
            endings = [one.ending for one in other.outcomes(moved, numbers, cancel)]
            return [np.nan if ending == "diverged" else ending == "held" for ending in endings]

        given = {**self.sizes, "cancel": cancel, "unit": UNITS[name]}
        found = critical_value_of(outcomes, name, self.vary[name], **given)
        if not found.complete:
            raise Cancelled("cancelled within a search")
        return found

    def _varied(self, grasp: Grasp, name: str, value: float) -> tuple[GraspTrials, Grasp]:
        """What is asked with another value of a quantity."""
        trials, changed = self.trials, dict[str, Any]({name: value})
        if name == "force":
            if not isinstance(trials.hand, ParallelGripper):
                raise ValueError(f"vary is 'force' of {trials.hand!r}, expected a ParallelGripper")
            return replace(trials, hand=replace(trials.hand, **changed)), grasp
        if name in ("friction", "mass"):
            if name == "mass" and (given := trials.object.inertial) is not None:
                moments = np.array(given.moments) * value / trials.object.mass
                changed["inertial"] = Inertial(given.center, inertia=moments, axes=given.axes)
            return replace(trials, object=replace(trials.object, **changed)), grasp
        along, error = value * np.eye(3)[AXES.index(name) % 3], np.eye(4)
        if name in AXES[:3]:
            error[:3, 3] = along
        else:
            error[:3, :3] = Rotation.from_rotvec(along).as_matrix()
        return trials, grasp._replace(pose=grasp.pose @ error)


def _read(_: Grasp, content: bytes) -> Found:
    rows = json.loads(content)
    for one in rows.values():
        one["range"], one["crossings"] = tuple(one["range"]), tuple(map(tuple, one["crossings"]))
        one["outcomes"] = np.array(one["outcomes"], float).reshape(-1, 3)
    return {name: CriticalValue(**one) for name, one in rows.items()}


def _written(found: Found | str) -> bytes | None:
    if isinstance(found, str):
        return None
    rows = {name: vars(one) | {"outcomes": one.outcomes.tolist()} for name, one in found.items()}
    return json.dumps(rows).encode()
