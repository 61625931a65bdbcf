"""What geometry and outcomes say of grasps as they were recorded: poses that are off by run, and
probabilities that are too sure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from energymargin import Box, Scene, World
from energymargin.base.aliases import Floats
from energymargin.base.checks import check_shape, one_of, positive_number, require
from energymargin.grasps.grasp_object import GraspObject
from energymargin.grasps.grasp_set import GraspSet
from energymargin.grasps.hands import Hand, ParallelGripper
from energymargin.grasps.outcomes import Grasp, clearance
from energymargin.grasps.protocols import Protocol
from energymargin.grasps.scores import grasp_of
from energymargin.grasps.scoring import trials_of
from energymargin.grasps.trials import GraspTrials
from energymargin.summary import Summarized

FREE = 1e-3  # m; an overlap that is not one of rounding
STEP = 0.002  # m; between two offsets
SURE = 2.0  # standard errors by which a moved group has to be better
CLOSE = 0.5  # of one: of offsets that are alike the least is taken
FEWEST = 8  # grasps of a group whose pose can be told


@dataclass(frozen=True, eq=False, repr=False)
class GraspCalibration(Summarized):
    """By how much the hand was recorded too far along its approach, by group."""

    grasps: tuple[GraspSet, ...]
    """The grasps of each object, moved back."""
    groups: tuple[str, ...]
    count: NDArray[np.int64]
    """Grasps of each, (G,)."""
    offsets: Floats
    """By which each was moved back along the approach [m], (G,); 0 where geometry does not say so
    surely."""
    before: Floats
    """Share of each whose open hand is free of object and table and has the object between its
    pads, as recorded, (G,)."""
    after: Floats
    """The same as moved, (G,)."""


def calibrate(
    grasps: GraspSet | Sequence[GraspSet],
    hand: Hand | str,
    object: GraspObject | Sequence[GraspObject],
    protocol: Protocol | str = "lift",
    *,
    group: str | Sequence[str] = (),
    largest: float = 0.04,
) -> GraspCalibration:
    """Moves grasps back along their approach where geometry says that they stand too deep, or on
    where they stand too far.

    Args:
        grasps, hand, object, protocol: as of `em.grasps.score`; the hand is a ParallelGripper. A
            protocol with a table tells more, and so do several objects: lists of their grasps and
            of them, whose groups are taken together.
        group: columns of the grasps whose values have one offset together, as a run or a planner;
            none: all have one.
        largest: offset that is tried [m].

    No label is looked at. A grasp is possible if its open hand is in nothing and the object is
    between its pads. A group is moved to the least offset at which about as many are possible as
    can be, if that is more than two standard errors better than as recorded. Raises ValueError on
    bad arguments.
    """
    sets = [grasps] if isinstance(grasps, GraspSet) else list(grasps)
    objects = [object] if isinstance(object, GraspObject) else list(object)
    if len(sets) != len(objects):
        raise ValueError(f"object has {len(objects)} objects, expected {len(sets)}, one a set")
    columns = [group] if isinstance(group, str) else list(group)
    steps = round(positive_number("largest", largest) / STEP)
    tried: Floats = STEP * np.arange(-steps // 2, steps + 1, dtype=float)
    names = [name for one in sets for name in _groups(one, columns)]
    pairs = list(zip(sets, objects, strict=True))
    trials = [trials_of(one, hand, thing, protocol) for one, thing in pairs]
    found = np.concatenate([_possible(*one, tried) for one in zip(sets, trials, strict=True)])
    groups, number = np.unique(names, return_inverse=True)
    of_groups = [found[number == k] for k in range(len(groups))]
    own, chosen = np.argmin(np.abs(tried)), [_offset(each, tried) for each in of_groups]
    offsets = tried[chosen]
    back = np.split(offsets[number], np.cumsum([len(one) for one in sets])[:-1])
    moved = tuple(_moved(one, by) for one, by in zip(sets, back, strict=True))
    before = np.array([each[:, own].mean() for each in of_groups])
    after = np.array([each[:, k].mean() for each, k in zip(of_groups, chosen, strict=True)])
    told = tuple(map(str, groups))
    return GraspCalibration(moved, told, np.bincount(number), offsets, before, after)


def recalibrate(
    probabilities: ArrayLike,
    held: ArrayLike,
    others: ArrayLike | None = None,
    *,
    method: str = "platt",
) -> Floats:
    """Probabilities that mean what they say, learned from outcomes.

    Args:
        probabilities: of grasps whose outcomes are known, shape (n,).
        held: whether each was held, shape (n,).
        others: probabilities that are changed, shape (m,); None: the same.
        method: "platt", a line in the logarithm of the odds, for a few dozen outcomes, or
            "isotonic", any rising curve, for hundreds.

    Outcomes of the same object are no test of it: learn from other objects. Raises ValueError on
    bad arguments, and outcomes that are all alike.
    """
    from sklearn.isotonic import IsotonicRegression
    from sklearn.linear_model import LogisticRegression

    one_of("method", method, ("platt", "isotonic"))
    known, outcomes = _shares("probabilities", probabilities), _shares("held", held)
    check_shape("held", outcomes, known.shape)
    if set(outcomes) != {0.0, 1.0}:
        said = "held has outcomes that are all alike, or neither 0 nor 1"
        raise ValueError(f"{said}, expected some held and some lost")
    asked = known if others is None else _shares("others", others)
    if method == "isotonic":
        curve = IsotonicRegression(y_min=0.0, y_max=1.0, out_of_bounds="clip")
        return np.asarray(curve.fit(known, outcomes).predict(asked))
    line = LogisticRegression().fit(_odds(known)[:, None], outcomes > 0.5)
    return np.asarray(line.predict_proba(_odds(asked)[:, None])[:, 1])


def _shares(name: str, given: ArrayLike) -> Floats:
    array = np.asarray(given, float)
    right = array.ndim == 1 and ((array >= 0.0) & (array <= 1.0)).all()
    require(right, name, array, "a list of numbers from 0 to 1")
    return array


def _odds(probabilities: Floats) -> Floats:
    """Logarithm of the odds, finite for 0 and 1."""
    kept = np.clip(probabilities, 0.01, 0.99)
    return np.asarray(np.log(kept / (1.0 - kept)))


def _groups(grasps: GraspSet, columns: list[str]) -> list[str]:
    for name in columns:
        one_of("group", name, tuple(grasps.columns))
    rows = zip(*(grasps.columns[name].tolist() for name in columns), strict=True)
    return [", ".join(map(str, row)) for row in rows] if columns else ["all"] * len(grasps)


def _moved(grasps: GraspSet, back: Floats) -> GraspSet:
    poses = np.array(grasps.poses)
    poses[:, :3, 3] -= back[:, None] * poses[:, :3, 2]
    return replace(grasps, poses=poses)


def _possible(grasps: GraspSet, trials: GraspTrials, tried: Floats) -> NDArray[np.bool_]:
    """Whether each can be, moved back by each offset, shape (n, T)."""
    possible = _Possible(trials)
    asked = [grasp_of(grasps, k) for k in range(len(grasps))]
    return np.array([[possible(one, back) for back in tried] for one in asked])


def _offset(found: NDArray[np.bool_], tried: Floats) -> int:
    """The number of the offset of a group; `found` has its grasps by offset, shape (n, T)."""
    own = int(np.argmin(np.abs(tried)))
    shares, error = found.mean(axis=0), np.sqrt(0.25 / len(found))
    if len(found) < FEWEST or shares.max() - shares[own] <= SURE * error:
        return own
    good = np.flatnonzero(shares >= shares.max() - CLOSE * error)
    return int(good[np.argmin(np.abs(tried[good]))])


class _Possible:
    """Whether the open hand can be where a grasp says, moved back along its approach."""

    def __init__(self, trials: GraspTrials) -> None:
        if not isinstance(hand := trials.hand, ParallelGripper):
            raise ValueError(f"hand is {hand!r}, expected a ParallelGripper, whose pads are known")
        self._trials = trials
        self._worlds: dict[float, World] = {}
        self._gap = Scene()
        self._gap.add_body("object", trials.object.shape, mass=trials.object.mass)
        self._gap.add_body("gap", Box((hand.opening, *hand.pad)), density=1000.0)
        self._apart = World(self._gap)
        self._center = np.array([0.0, 0.0, hand.reach - hand.pad[1] / 2, 1.0])

    def __call__(self, grasp: Grasp, back: float) -> bool:
        moved = np.array(grasp.pose)
        moved[:3, 3] -= back * moved[:3, 2]
        one, draw = grasp._replace(pose=moved), self._trials.draw(-1)
        scene, hand = self._trials.scene(grasp.opening, draw, gravity=False)
        world = self._worlds.setdefault(grasp.opening, World(scene))
        if clearance(world, hand, self._trials.open_state(one, draw)) < -FREE:
            return False
        turned = Rotation.from_matrix(moved[:3, :3]).as_quat()
        place = {"position": (moved @ self._center)[:3], "orientation": turned}
        return bool(self._apart.distance(self._gap.pack(gap=place), "gap", "object") < 0.0)
