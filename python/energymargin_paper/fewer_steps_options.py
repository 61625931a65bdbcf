"""The ways to score a trajectory's states that `fewer_steps` compares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin._core import CaptureScore, Problem, Tree, capture_score, escape_effort, stream

__all__ = ["OPTIONS", "PLAIN", "Found", "Score"]

TREES = 4  # of `several_trees`
SHARE = 0.5  # of the frame before, beside the state's own tree


@dataclass(frozen=True)
class Found:
    """The scores of one state."""

    scores: dict[str, float]
    """By metric."""
    steps: int
    """How many simulation steps they took."""


Score = Callable[[Sequence[Problem], int, Sequence[int]], list[Found]]
"""Of the states of one trajectory, with so many rollouts and a seed for each."""


def capture(nodes_per_edge: int = 1, least_likelihood: float = 0.0) -> Score:
    """Capture and success score, with so many nodes of each rollout, up to where they matter."""

    def score(problems: Sequence[Problem], rollouts: int, seeds: Sequence[int]) -> list[Found]:
        return [
            _found(problem, _grown(problem, rollouts, seed, nodes_per_edge, least_likelihood))
            for problem, seed in zip(problems, seeds, strict=True)
        ]

    return score


def with_frame_before(
    problems: Sequence[Problem], rollouts: int, seeds: Sequence[int]
) -> list[Found]:
    """Capture and success score, in part of the tree of the frame before in the sets of now."""
    grown = [_grown(p, rollouts, seed) for p, seed in zip(problems, seeds, strict=True)]
    found = [_found(problems[0], grown[0])]
    for problem, own, before in zip(problems[1:], grown[1:], grown, strict=False):
        now, old = _found(problem, own), _inside(problem, before)
        scores = {
            metric: (value + SHARE * old[metric]) / (1 + SHARE)
            for metric, value in now.scores.items()
        }
        found.append(Found(scores, now.steps))
    return found


def several_trees(problems: Sequence[Problem], rollouts: int, seeds: Sequence[int]) -> list[Found]:
    """Mean scores of trees that share the rollouts, as threads grow them at once."""
    found = []
    for problem, seed in zip(problems, seeds, strict=True):
        trees = [
            _found(problem, _grown(problem, max(rollouts // TREES, 1), stream(seed, i)))
            for i in range(TREES)
        ]
        scores = {
            metric: sum(tree.scores[metric] for tree in trees) / TREES for metric in trees[0].scores
        }
        found.append(Found(scores, sum(tree.steps for tree in trees)))
    return found


def effort(*, shorten: bool, stop_at_escape: bool) -> Score:
    """Effort of escape by AO-EST; without `shorten`, as published."""

    def score(problems: Sequence[Problem], rollouts: int, seeds: Sequence[int]) -> list[Found]:
        found = []
        for problem, seed in zip(problems, seeds, strict=True):
            escape = escape_effort(
                problem,
                nodes=rollouts,
                seed=seed,
                search="improved" if shorten else "published",
                stop_at_escape=stop_at_escape,
            )
            found.append(
                Found({"effort/est": escape.effort}, int(_steps(escape.tree, problem).sum()))
            )
        return found

    return score


OPTIONS: dict[str, Score] = {
    "ends alone": capture(),
    "four trees": several_trees,
    "2 nodes an edge": capture(2),
    "4 nodes an edge": capture(4),
    "8 nodes an edge": capture(8),
    "likely 1 %": capture(least_likelihood=0.01),
    "likely 10 %": capture(least_likelihood=0.1),
    "likely 10 %, 4 nodes": capture(4, 0.1),
    "frame before": with_frame_before,
    "as published": effort(shorten=False, stop_at_escape=False),
    "stop at escape": effort(shorten=False, stop_at_escape=True),
    "shortened": effort(shorten=True, stop_at_escape=False),
    "shortened, stop at escape": effort(shorten=True, stop_at_escape=True),
}
PLAIN = {"capture": "ends alone", "success": "ends alone", "effort/est": "as published"}
"""By metric, the option that the others are held against."""


def _grown(
    problem: Problem,
    rollouts: int,
    seed: int,
    nodes_per_edge: int = 1,
    least_likelihood: float = 0.0,
) -> CaptureScore:
    return capture_score(
        problem,
        nodes_per_edge * rollouts,
        seed,
        nodes_per_edge=nodes_per_edge,
        least_likelihood=least_likelihood,
        warn=False,
    )


def _found(problem: Problem, score: CaptureScore) -> Found:
    assert score.success is not None  # every task has a success set
    steps, tree = _steps(score.tree, problem), score.tree
    on_the_way = (tree.parents[1:] == tree.parents[:-1]) & (
        tree.controls[1:] == tree.controls[:-1]
    ).all(axis=1)
    own = int(steps.sum() - steps[:-1][on_the_way].sum())
    return Found({"capture": score.capture, "success": score.success}, own)


def _inside(problem: Problem, score: CaptureScore) -> dict[str, float]:
    """The scores that a tree has in a problem's sets."""
    assert problem.succeeded is not None
    sets = {"capture": problem.captured, "success": problem.succeeded}
    return {
        metric: float(score.likelihoods @ region.contains(problem.scene, score.tree.states))
        for metric, region in sets.items()
    }


def _steps(tree: Tree, problem: Problem) -> NDArray[np.int64]:
    """Of the edge that leads to each node."""
    return np.round(tree.durations / problem.scene.step).astype(np.int64)
