"""Labels of a real robot and of another engine beside the probability that a grasp holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin.grasps import (
    GraspBelief,
    GraspComparison,
    GraspObject,
    GraspScores,
    GraspSet,
    baselines,
    compare,
    score,
)
from energymargin.grasps.hands import ParallelGripper
from energymargin.grasps.scores import HELD
from energymargin_paper.evidence.calibration import brier
from energymargin_paper.evidence.grasps_data import MUG, RIGID, acronym, graspa, robot_objects
from energymargin_paper.evidence.grasps_numbers import others_mean, scaled_brier, share_brier
from energymargin_paper.study import Progress

__all__ = ["Asked", "Contradiction", "Labelled", "of_engine", "of_robot"]

POSE = [0.007] * 3 + [0.05] * 3  # m and rad, the error of the robot's recorded poses
POSE_THERE = [0.002] * 3 + [0.02] * 3  # of the other engine's, to tell grasps apart
FRICTION = 0.8  # of rubber pads on the robot's objects
SLIPPERY = 0.25  # a quarter of the other engine's
LIFTED = 1.0  # s, of the protocol's lift
NARROW = 2e-3  # m; with less travel on each side the fingers cannot miss the object
OTHERS = "other planners' mean"


@dataclass(frozen=True)
class Asked:
    """What both have in common."""

    data: Path
    folder: Path
    """Of the files of scores."""
    every: int
    rollouts: int
    seed: int
    threads: int
    progress: Progress

    def scores(
        self,
        grasps: GraspSet,
        thing: GraspObject,
        protocol: str,
        belief: GraspBelief,
        store: str,
        *,
        hand: ParallelGripper | str = "panda",
    ) -> GraspScores:
        """Of each so manieth grasp, by a Panda."""
        return score(
            grasps[:: self.every],
            hand,
            thing,
            protocol,
            belief=belief,
            rollouts=self.rollouts,
            colliding="redraw",
            seed=self.seed,
            threads=self.threads,
            store=self.folder / store,
            progress=self.progress,
        )


@dataclass(frozen=True, eq=False)
class Labelled:
    """Probabilities and other scores of n grasps beside a label."""

    label: str
    held: NDArray[np.bool_]
    groups: NDArray[np.int64]
    """Numbers of the objects."""
    probabilities: NDArray[np.float64]
    compared: GraspComparison
    """The probability beside the baselines."""
    together: GraspComparison | None = None
    """The mean of the probability and the other planners' beside the latter."""

    def to_markdown(self) -> str:
        """Its tables, and Brier scores."""
        return "\n".join([f"### {self.label}\n", *self._parts()])

    def _parts(self) -> Iterator[str]:
        yield self.compared.to_markdown().rstrip() + "\n"
        if self.together:
            yield (
                "*Probability* is here the mean of the probability and the other planners' "
                f"mean.\n\n{self.together.to_markdown().rstrip()}\n"
            )
        raw = brier(np.nan_to_num(self.probabilities), self.held.astype(float))
        if len(np.unique(self.groups)) == 1:
            share = self.held.mean()
            yield f"Brier score {raw:.3f}; of their share {share * (1 - share):.3f}.\n"
            return
        scaled = scaled_brier(self.probabilities, self.held, self.groups)
        yield (
            f"Brier score {raw:.3f}; {scaled:.3f} after a scaling learned from the other objects; "
            f"of the other objects' share {share_brier(self.held, self.groups):.3f}.\n"
        )


@dataclass(frozen=True)
class Contradiction:
    """What the geometry says of the grasps that the other engine loses."""

    lost: int
    narrow: int
    """Of these, such that the hand closes here with little travel of its fingers."""
    held: int
    """Of the narrow ones, such that hold here without noise."""


def of_robot(asked: Asked) -> list[Labelled]:
    """Grasped, and stable to the end of the shake."""
    scores: dict[str, GraspScores] = {}
    others: dict[str, list[NDArray[np.float64]]] = {}
    for name in robot_objects(asked.data):
        grasps, thing = graspa(asked.data, name, FRICTION)
        belief, store = GraspBelief(pose=POSE), f"robot-{name}.h5"
        scores[name] = asked.scores(grasps, thing, "graspa", belief, store)
        planners = grasps.columns["planner"]
        means = [others_mean(held.astype(float), planners) for held in _labels(grasps)]
        others[name] = [mean[:: asked.every] for mean in means]
    simple = {name: baselines(one) for name, one in scores.items()}
    result = []
    for k, label in enumerate(("grasped", "stable")):
        held = {name: _labels(one.grasps)[k] for name, one in scores.items()}
        chances = {
            name: (one.held_until(LIFTED), one.probabilities)[k] for name, one in scores.items()
        }
        columns = {name: {"probability": chances[name], **simple[name]} for name in scores}
        both = {
            name: {"probability": (np.nan_to_num(chances[name]) + mean[k]) / 2, OTHERS: mean[k]}
            for name, mean in others.items()
        }
        result.append(
            Labelled(
                label,
                np.concatenate(list(held.values())),
                np.repeat(np.arange(len(held)), [len(values) for values in held.values()]),
                np.concatenate(list(chances.values())),
                compare(scores, held, columns=columns),
                compare(scores, held, columns=both, learned=False),
            )
        )
    return result


def of_engine(asked: Asked) -> tuple[list[Labelled], Contradiction]:
    """Held in FleX: with its friction, and with a quarter of it."""
    found, odd = [], None
    for friction in (None, SLIPPERY):
        grasps, thing = acronym(asked.data, MUG, friction)
        store, belief = f"engine-{MUG}-{thing.friction:g}.h5", GraspBelief(pose=POSE_THERE)
        scores = asked.scores(grasps, thing, "acronym", belief, store, hand=RIGID)
        held = scores.grasps.labels > 0
        odd = odd or _contradiction(scores, held)
        found.append(
            Labelled(
                f"Friction {thing.friction:g}",
                held,
                np.zeros(len(held), dtype=np.int64),
                scores.probabilities,
                compare({MUG: scores}, {MUG: held}),
            )
        )
    assert odd is not None
    return found, odd


def _contradiction(scores: GraspScores, held: NDArray[np.bool_]) -> Contradiction:
    lost = np.flatnonzero(~held)
    narrow = [k for k in lost if _travel(scores, int(k)) < NARROW]
    return Contradiction(len(lost), len(narrow), int((scores.likely[narrow] == HELD).sum()))


def _travel(scores: GraspScores, number: int) -> float:
    """How far each finger goes until it touches [m]; inf if the hand does not close."""
    hand = scores.trials.hand
    assert isinstance(hand, ParallelGripper)
    try:
        problem = scores.problem(number)
    except ValueError:
        return np.inf
    at = problem.scene.unpack(problem.state)["joints"]["left"]["position"]
    return float(hand.opening / 2 - at)


def _labels(grasps: GraspSet) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Grasped, and stable to the end of the shake."""
    return grasps.labels >= 1, grasps.columns["stability"] >= 1
