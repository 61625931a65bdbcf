"""What a surrogate says of a state: a value, an interval, and whether it knows such states.

Features are named numbers of a state that trees can tell apart: where bodies are, how fast, and as
an object sees the others. The numbers of a body are `object.x`, `.y`, `.z` [m], `.yaw` [rad],
`.tilt_x`, `.tilt_y`, `.tilt_z` (the vertical in the body's frame), `.vx`, `.vy`, `.vz` [m/s],
`.wx`, `.wy`, `.wz` [rad/s]. A body that is no object, as an object sees it in its own frame, has
`effector_in_object.x` to `.vz`, and `.distance` [m]. They do not change if both are moved or turned
together. A joint has `finger.position` and `finger.velocity`.

Some trajectories grow boosted trees, others say how wrong these are, and the rest is the test. The
interval is that of split conformal prediction for data in groups (Lee, Barber and Willett, 2023):
each trajectory counts the same, however many states it has, and one more has an infinite error. So
a random state of a new trajectory that is drawn like them is within the interval with at least the
stated probability.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin import Scene
from energymargin.base.aliases import Floats
from energymargin.base.reprs import Record

FeaturesOf = Callable[[Floats], Floats]
"""A function of states, shape (N, n), that returns their features, shape (N, F)."""

OF_PAIR = ("x", "y", "z", "vx", "vy", "vz", "distance")
OF_BODY = (*OF_PAIR[:3], "yaw", "tilt_x", "tilt_y", "tilt_z", *OF_PAIR[3:6], "wx", "wy", "wz")


@dataclass(frozen=True, eq=False)
class Layout:
    """Where the numbers of bodies and joints stand in a state."""

    bodies: dict[str, int]
    """First of the 13 numbers of each body that moves freely, by name."""
    pairs: list[tuple[str, str]]
    """Each body that is no object, with each object that sees it."""
    joints: dict[str, int]
    """First of the two numbers of each joint, by name."""
    dimension: int
    """Numbers of a state."""

    @staticmethod
    def of(scene: Scene) -> Layout:
        """The layout of a scene."""
        bodies = {}
        for body in scene.bodies:
            with suppress(ValueError):  # it is fixed, or a link
                bodies[body.name] = scene.slice(body.name).start
        objects = [body.name for body in scene.bodies if body.role == "object"]
        others = [name for name in bodies if name not in objects]
        pairs = [(other, seer) for seer in bodies if seer in objects for other in others]
        joints = {joint.name: scene.joint_slice(joint.name).start for joint in scene.joints}
        return Layout(bodies, pairs, joints, scene.dimension)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the F features."""
        return (
            *(f"{body}.{what}" for body in self.bodies for what in OF_BODY),
            *(f"{other}_in_{seer}.{what}" for other, seer in self.pairs for what in OF_PAIR),
            *(f"{joint}.{what}" for joint in self.joints for what in ("position", "velocity")),
        )

    def features(self, states: Floats) -> Floats:
        """Features, shape (N, F), of states, shape (N, n)."""
        bodies = {name: states[:, k : k + 13] for name, k in self.bodies.items()}
        columns = []
        for body in bodies.values():
            turn = Rotation.from_quat(body[:, 3:7]).as_matrix()
            yaw = np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
            columns += [body[:, :3], yaw, turn[:, 2], body[:, 7:]]
        for other, seer in self.pairs:
            own, apart = bodies[seer], (bodies[other] - bodies[seer])[:, :3]
            speed = (bodies[other] - own)[:, 7:10] - np.cross(own[:, 10:], apart)
            seen = Rotation.from_quat(own[:, 3:7]).inv()
            columns += [seen.apply(apart), seen.apply(speed), np.linalg.norm(apart, axis=1)]
        return np.column_stack([*columns, *(states[:, k : k + 2] for k in self.joints.values())])


Mask = NDArray[np.bool_]

GROW, TEST = 0.6, 0.8  # of the trajectories: before it for the trees, from it on for the test
LEAST = 50  # trajectories; with fewer there are no intervals of 90 %
BEYOND = 1e-3  # m, rad, m/s or rad/s: so far a feature may be out of the training's range
SURE = 0.05  # of 0 or of 1: so near is a probability that is sure
TESTED = ("features", "trajectory", "scores")
BINS = 10  # of the calibration error


@dataclass(frozen=True, eq=False, repr=False)
class Estimates(Record):
    """What a surrogate says of N states; of one state, each is a number."""

    value: Floats
    """The score that rollouts or a search would find, shape (N,); NaN where it is refused."""
    low: Floats
    """Lower end of the interval, shape (N,); NaN where it is refused."""
    high: Floats
    """Upper end of the interval, shape (N,); NaN where it is refused."""
    refused: Mask
    """Whether the state is unlike those of the training, shape (N,)."""


@dataclass(frozen=True)
class Quality:
    """What a surrogate is worth on its test trajectories."""

    trajectories: int
    """Number of test trajectories."""
    states: int
    """Number of their states that have a score."""
    auc: float
    """AUC of the surrogate against the label "captured over the horizon" of the recording, among
    states that are captured now; NaN if all labels are alike."""
    auc_of_scores: float
    """AUC of the scores that it learned from, on the same states."""
    calibration_error: float
    """Mean difference between its values and the scores in ten bins with equal counts."""
    coverage: float
    """Share of the scores within their intervals; each trajectory counts the same."""
    refused: float
    """Share of the states that are unlike the training."""


@dataclass(eq=False, repr=False)
class Model(Record):
    """Boosted trees of scikit-learn, grown from N states with F features.

    The same fields grow the same trees, so they are all that a file has to hold. Raises ValueError
    on fewer than 50 trajectories.
    """

    features: Floats
    """Shape (N, F)."""
    scores: Floats
    """Finite, shape (N,)."""
    trajectory: NDArray[np.int64]
    """The trajectory of each state, shape (N,)."""
    labels: Floats
    """Whether a captured state stays so, 1 or 0; NaN where that is not known, shape (N,)."""
    limits: Floats
    """The least and the greatest score that there may be, shape (2,)."""
    monotone: NDArray[np.int64]
    """1 if the score never falls with a feature, -1 if it never rises, else 0, shape (F,)."""
    coverage: float
    """Probability with which a score is within its interval."""
    seed: int
    """Seed of the choice of trajectories."""

    def __post_init__(self) -> None:
        """Grows the trees, and takes the widths of intervals from other trajectories."""
        from sklearn.ensemble import HistGradientBoostingRegressor
        from threadpoolctl import ThreadpoolController  # of scikit-learn

        _, own, counts = np.unique(self.trajectory, return_inverse=True, return_counts=True)
        if (found := len(counts)) < LEAST:
            raise ValueError(f"run has scores of {found} trajectories, expected at least {LEAST}")
        place = np.random.default_rng(int(self.seed)).permutation(found)[own] / found
        train, self.test = place < GROW, place >= TEST
        rest, grown = ~(train | self.test), self.features[train]
        self.trees = HistGradientBoostingRegressor(
            monotonic_cst=self.monotone, early_stopping=False, random_state=0
        )
        self._threads = ThreadpoolController()
        with self._threads.limit(limits=1):  # the same bits on any number of cores
            self.trees.fit(grown, self.scores[train])
        self._range = grown.min(axis=0) - BEYOND, grown.max(axis=0) + BEYOND
        value, of = self.value(self.features[rest]), self.trajectory[rest]
        errors, unsure = np.abs(value - self.scores[rest]), self._is_unsure(value)
        self._widths = [conformal(errors[w], of[w], self.coverage) for w in (unsure, ~unsure)]

    def __call__(self, features: Floats) -> Estimates:
        """Estimates of N states by their features, shape (N, F)."""
        low, high = self._range
        known = ((features >= low) & (features <= high)).all(axis=1)  # not if one is no number
        value = np.full(len(features), np.nan)
        if known.any():
            value[known] = self.value(features[known])
        return Estimates(value, *self._interval(value), ~known)

    def value(self, features: Floats) -> Floats:
        """The values of N states, shape (N,), refused ones too."""
        with self._threads.limit(limits=1, user_api="openmp"):  # a second one waits for a free core
            return np.asarray(self.trees.predict(features).clip(*self.limits))

    def quality(self) -> Quality:
        """How good it is on the test."""
        from sklearn.metrics import roc_auc_score

        features, of, scores = (getattr(self, name)[self.test] for name in TESTED)
        value, labels = self.value(features), self.labels[self.test]
        (low, high), known = self._interval(value), ~np.isnan(labels)
        both = len(np.unique(labels[known])) == 2
        aucs = [roc_auc_score(labels[known], v[known]) if both else np.nan for v in (value, scores)]
        bins = np.array_split((value - scores)[np.argsort(value, kind="stable")], BINS)
        calibration = sum(abs(errors.sum()) for errors in bins) / len(scores)
        weights = 1 / np.bincount(of)[of]
        inside = np.average((low <= scores) & (scores <= high), weights=weights)
        shares = map(float, (*aucs, calibration, inside, self(features).refused.mean()))
        return Quality(len(np.unique(of)), len(scores), *shares)

    def _interval(self, value: Floats) -> tuple[Floats, Floats]:
        """Lower and upper ends for values, shape (N,) each."""
        half = np.where(self._is_unsure(value), *self._widths)
        return (value - half).clip(*self.limits), (value + half).clip(*self.limits)

    def _is_unsure(self, value: Floats) -> Mask:
        """Whether values are not near a limit, where errors are smaller."""
        return np.asarray((value > self.limits[0] + SURE) & (value < self.limits[1] - SURE))


def conformal(errors: Floats, trajectory: NDArray[np.int64], coverage: float) -> float:
    """The error that a state of a new trajectory does not exceed with this probability; inf if
    there are too few trajectories to say so."""
    _, own, counts = np.unique(trajectory, return_inverse=True, return_counts=True)
    order = np.argsort(errors)
    level = np.cumsum(1 / counts[own][order]) / (len(counts) + 1)
    return float(np.append(errors[order], np.inf)[(level < coverage - 1e-12).sum()])
