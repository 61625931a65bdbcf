"""Labels of a real robot and of another engine beside the probability that a grasp holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin.grasps import GraspBelief, GraspObject, GraspScores, GraspSet, score
from energymargin.grasps.hands import ParallelGripper
from energymargin.table_text import markdown_table
from energymargin_paper.evidence.calibration import brier
from energymargin_paper.evidence.grasps_data import MUG, acronym, graspa, robot_objects
from energymargin_paper.evidence.grasps_numbers import (
    area,
    learned,
    others_mean,
    overall,
    paired,
    scaled,
    within,
)
from energymargin_paper.study import Progress

__all__ = ["Asked", "Contradiction", "Labelled", "of_engine", "of_robot", "robot_table"]

Columns = dict[str, NDArray[np.float64]]
Baselines = Callable[[GraspScores], Columns]
"""Features of each grasp without labels, (n,) each, by name."""

POSE = [0.007] * 3 + [0.05] * 3  # m and rad, the error of the robot's recorded poses
POSE_THERE = [0.002] * 3 + [0.02] * 3  # of the other engine's, to tell grasps apart
FRICTION = 0.8  # of rubber pads on the robot's objects
LIFTED = 1.0  # s, of the protocol's lift
NARROW = 2e-3  # m; with less travel on each side the fingers cannot miss the object


def no_baselines(scores: GraspScores) -> Columns:
    """None."""
    return {}


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
    baselines: Baselines = no_baselines

    def scores(
        self,
        grasps: GraspSet,
        thing: GraspObject,
        protocol: str,
        belief: GraspBelief,
        store: str,
    ) -> GraspScores:
        """Of each so manieth grasp, by a Panda."""
        return score(
            grasps[:: self.every],
            "panda",
            thing,
            protocol,
            belief=belief,
            rollouts=self.rollouts,
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
    """What is drawn as a whole: the object, or the grasp if there is one object."""
    probabilities: NDArray[np.float64]
    others: NDArray[np.float64] | None
    """Mean label of other planners' grasps of the object."""
    columns: Columns

    def rows(self) -> Iterator[tuple[str, ...]]:
        """AUC over all grasps and within objects, by score."""
        scores = {"probability": self.probabilities, **self.columns}
        if self.others is not None:
            scores["other planners' mean"] = self.others
            scores["both, their mean"] = self.together
        for name, values in scores.items():
            inside = within(values, self.held, self.groups) if self.others is not None else "-"
            yield self.label, name, str(area(values, self.held, self.groups)), str(inside)

    @property
    def together(self) -> NDArray[np.float64]:
        """Mean of the probability and the other planners' mean."""
        assert self.others is not None
        return np.asarray((np.nan_to_num(self.probabilities) + self.others) / 2)

    def sentences(self) -> Iterator[str]:
        """Brier scores, and what the probability adds to the other planners' mean."""
        raw = brier(np.nan_to_num(self.probabilities), self.held.astype(float))
        text = (
            f"- {self.label}, {len(self.held)} grasps, {self.held.mean():.0%} held: Brier {raw:.3f}"
        )
        if self.others is None:
            yield text + f", of their share {self.held.mean() * (1 - self.held.mean()):.3f}."
            return
        after = scaled(self.probabilities, self.held, self.groups)
        plain = overall(self.held, self.groups)
        more = paired(self.together, self.others, self.held, self.groups)
        both = learned(np.stack([self.probabilities, self.others], 1), self.held, self.groups)
        yield (
            f"{text}, {after:.3f} after a scaling learned from the other objects, {plain:.3f} of "
            f"their share. Both together are ahead of the other planners' mean by {more}; their "
            f"weights learned from the other objects give {area(both, self.held, self.groups)}."
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
    found, others = [], []
    for name in robot_objects(asked.data):
        grasps, thing = graspa(asked.data, name, FRICTION)
        belief, store = GraspBelief(pose=POSE), f"robot-{name}.h5"
        found.append(asked.scores(grasps, thing, "graspa", belief, store))
        planners = grasps.columns["planner"]
        means = [others_mean((values >= 1).astype(float), planners) for values in _labels(grasps)]
        others.append([mean[:: asked.every] for mean in means])
    groups = np.repeat(np.arange(len(found)), [len(scores.grasps) for scores in found])
    columns = _joined([asked.baselines(scores) for scores in found])
    result = []
    for k, label in enumerate(("grasped", "stable")):
        chances = [(s.held_until(LIFTED), s.probabilities)[k] for s in found]
        held = np.concatenate([_labels(s.grasps)[k] for s in found]) >= 1
        mean = np.concatenate([each[k] for each in others])
        result.append(Labelled(label, held, groups, np.concatenate(chances), mean, columns))
    return result


def of_engine(asked: Asked) -> tuple[Labelled, Contradiction]:
    """Held in FleX."""
    grasps, thing = acronym(asked.data, MUG)
    belief = GraspBelief(pose=POSE_THERE)
    scores = asked.scores(grasps, thing, "acronym", belief, f"engine-{MUG}.h5")
    held = scores.grasps.labels > 0
    columns = asked.baselines(scores)
    rows = np.arange(len(held))
    labelled = Labelled(f"held in FleX, {MUG}", held, rows, scores.probabilities, None, columns)
    return labelled, _contradiction(scores, held)


def robot_table(found: list[Labelled]) -> str:
    """AUC of all scores, and what else there is to say."""
    head = ("label", "score", "AUC", "pairs within an object")
    rows = [row for one in found for row in one.rows()]
    table = markdown_table(head, rows, ["left", "left", "right", "right"])
    return "\n".join([table, "", *(text for one in found for text in one.sentences())])


def _contradiction(scores: GraspScores, held: NDArray[np.bool_]) -> Contradiction:
    lost = np.flatnonzero(~held)
    narrow = [k for k in lost if _travel(scores, int(k)) < NARROW]
    return Contradiction(len(lost), len(narrow), int((scores.likely[narrow] == 0).sum()))


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


def _labels(grasps: GraspSet) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Grasped, and how far it stayed in the shake."""
    return grasps.labels, grasps.columns["stability"]


def _joined(columns: list[Columns]) -> Columns:
    return {name: np.concatenate([each[name] for each in columns]) for name in columns[0]}
