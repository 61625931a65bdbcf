"""How much each grasp can take: the least force of the hand, the largest error of its pose."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin import Cancel, Cancelled, CriticalValue, critical_value_of
from energymargin.base.checks import one_of, shown
from energymargin.base.limits import Limit
from energymargin.base.plausibility import kept_warnings
from energymargin.base.reprs import Record
from energymargin.executors import Executor, ask
from energymargin.grasps.grasp_object import GraspObject
from energymargin.grasps.grasp_set import GraspSet
from energymargin.grasps.hands import Hand, ParallelGripper
from energymargin.grasps.outcomes import Grasp
from energymargin.grasps.protocols import Protocol
from energymargin.grasps.rows import KeptRows
from energymargin.grasps.scores import grasp_of
from energymargin.grasps.scoring import trials_of
from energymargin.grasps.trials import GraspTrials
from energymargin.summary import Summarized

DRAWS = 80
AXES = ("x", "y", "z", "rx", "ry", "rz")
UNITS = {
    "force": "N",
    "friction": "",
    "mass": "kg",
    **dict.fromkeys(AXES[:3], "m"),
    **dict.fromkeys(AXES[3:], "rad"),
}
"""What can be varied, and its unit."""

Ranges = Mapping[str, tuple[float, float]]
Found = dict[str, CriticalValue]


@dataclass(frozen=True, eq=False, repr=False)
class GraspLimits(Record, Summarized):
    """How much n grasps can take."""

    grasps: GraspSet
    limits: dict[str, list[CriticalValue | None]]
    """By quantity, of each grasp; None of one that was not finished, or failed."""
    errors: dict[int, str]
    """Why a grasp has none, by its number."""

    def to_json(self) -> str:
        """A row for each grasp: its name, where each quantity crosses and the interval."""
        rows: list[dict[str, Any]] = [
            {"grasp": name, "error": self.errors.get(k)}
            | {q: of[k] for q, of in self.limits.items()}
            for k, name in enumerate(self.grasps.names)
        ]
        return json.dumps(rows, indent=1, default=_plain)

    @property
    def complete(self) -> bool:
        """Whether every grasp has its limits, or an error."""
        first = next(iter(self.limits.values()))
        return all(one or number in self.errors for number, one in enumerate(first))

    def values(self, quantity: str) -> NDArray[np.float64]:
        """Critical values, shape (n,); NaN where there is none in the range."""
        return np.array([np.nan if one is None else one.value for one in self.limits[quantity]])


def _plain(one: CriticalValue) -> dict[str, Any]:
    """Without numbers that JSON does not have."""
    known = {"side": one.side, "unit": one.unit, "crossings": one.crossings}
    return {**known, "monotone": one.monotone, "rollouts": one.rollouts, "range": one.range}


def limits(
    grasps: GraspSet,
    hand: Hand | str,
    object: GraspObject,
    protocol: Protocol | str = "hold",
    *,
    vary: Ranges,
    probability: float = 0.95,
    confidence: float = 0.95,
    draws: int = DRAWS,
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
        draws: how many trials of each value there may be.
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
    trials = trials_of(grasps, hand, object, protocol, **asked)
    if not isinstance(vary, Mapping) or not vary:
        raise ValueError(f"vary is {shown(vary)}, expected ranges by name, {{'force': (1, 60)}}")
    for name in vary:
        one_of("vary", name, tuple(UNITS))
        _varied(trials, grasp_of(grasps, 0), name, vary[name][1])
    found: dict[str, list[CriticalValue | None]] = {name: [None] * len(grasps) for name in vary}
    errors: dict[int, str] = {}

    def note(answers: Sequence[tuple[Grasp, Found | str]]) -> None:
        for grasp, answer in answers:
            if isinstance(answer, str):
                errors[grasp.number] = answer
                continue
            for name, one in answer.items():
                found[name][grasp.number] = one

    sizes = {"probability": probability, "confidence": confidence, "draws": draws}
    sizes["tolerance"] = tolerance
    limit = Limit(timeout, cancel)
    ways: dict[str, Any] = {"read": _read, "written": _written}
    with ExitStack() as opened:
        kept = None
        if store is not None:
            ends = {name: list(map(float, vary[name])) for name in vary}
            kept = opened.enter_context(KeptRows(store, trials, "limits", ends, sizes, **ways))
        ask(
            [[grasp_of(grasps, number) for number in range(len(grasps))]],
            *(partial(_limits_of, trials, vary, sizes), note),
            kept=None if kept is None else kept.rows,
            total=len(grasps),
            progress=progress,
            threads=threads,
            executor=executor,
            **limit.rest(),
        )
    if not errors and all(one is None for one in next(iter(found.values()))):
        limit.require("a grasp has its limits")
    return GraspLimits(grasps, found, errors)


def _written(found: Found | str) -> bytes | None:
    if isinstance(found, str):
        return None
    rows = {name: vars(one) | {"outcomes": one.outcomes.tolist()} for name, one in found.items()}
    return json.dumps(rows).encode()


def _read(_: Grasp, content: bytes) -> Found:
    rows = json.loads(content)
    for one in rows.values():
        one["range"] = tuple(one["range"])
        one["crossings"] = tuple(map(tuple, one["crossings"]))
        one["outcomes"] = np.array(one["outcomes"], float).reshape(-1, 3)
    return {name: CriticalValue(**one) for name, one in rows.items()}


def _limits_of(
    trials: GraspTrials,
    vary: Ranges,
    sizes: dict[str, Any],
    grasps: Sequence[Grasp],
    cancel: Cancel,
) -> list[Found | str]:
    """On a worker: the limits of some grasps, or why they have none."""
    done: list[Found | str] = []
    with kept_warnings():
        for grasp in grasps:
            search = _Search(trials, grasp, {**sizes, "cancel": cancel})
            try:
                done.append({name: search.found(name, ends) for name, ends in vary.items()})
            except Cancelled:
                break
            except (ValueError, RuntimeError) as error:
                done.append(str(error))
    return done


@dataclass(frozen=True, eq=False)
class _Search:
    """What is asked about one grasp."""

    trials: GraspTrials
    grasp: Grasp
    asked: dict[str, Any]

    def found(self, name: str, ends: tuple[float, float]) -> CriticalValue:
        """The limit of a quantity; raises Cancelled if it is stopped."""
        outcomes = partial(self._outcomes, name)
        found = critical_value_of(outcomes, name, ends, unit=UNITS[name], **self.asked)
        if not found.complete:
            raise Cancelled("cancelled within a search")
        return found

    def _outcomes(self, name: str, value: float, numbers: Sequence[int]) -> NDArray[np.float64]:
        trials, grasp = _varied(self.trials, self.grasp, name, value)
        endings = trials.endings(grasp, numbers, self.asked["cancel"])
        return np.array([np.nan if e == "diverged" else float(e == "held") for e in endings])


def _varied(
    trials: GraspTrials, grasp: Grasp, name: str, value: float
) -> tuple[GraspTrials, Grasp]:
    """What is asked with another value of a quantity."""
    if name == "force":
        if not isinstance(trials.hand, ParallelGripper):
            raise ValueError(f"vary is 'force' of {trials.hand!r}, expected a ParallelGripper")
        return replace(trials, hand=replace(trials.hand, force=value)), grasp
    if name in ("friction", "mass"):
        changed: dict[str, Any] = {name: value}
        return replace(trials, object=replace(trials.object, **changed)), grasp
    error, axis = np.eye(4), AXES.index(name) % 3
    if name in AXES[:3]:
        error[axis, 3] = value
    else:
        error[:3, :3] = Rotation.from_rotvec(value * np.eye(3)[axis]).as_matrix()
    return trials, grasp._replace(pose=grasp.pose @ error)
