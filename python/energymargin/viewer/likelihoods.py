"""Capture and success score of the first nodes of a tree, for any lambda.

A tree of M nodes begins with the tree of fewer, and does not depend on lambda: so what a search has
grown once answers for all of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Problem, Tree

__all__ = ["Memberships"]

SETS = {
    "capture": "captured",
    "success": "succeeded",
    "capture_any": "captured_any",
    "success_any": "succeeded_any",
}


class Memberships:
    """Which nodes of a tree are in which set of its problem."""

    def __init__(self, problem: Problem, tree: Tree) -> None:
        """Asks each set about every node, once."""
        states = tree.states
        self.inside: dict[str, NDArray[np.bool_]] = {
            name: np.atleast_1d(np.asarray(region.contains(problem.scene, states)))
            for name, attribute in SETS.items()
            if (region := getattr(problem, attribute)) is not None
        }
        self._costs = np.asarray(tree.costs)

    def scores(self, nodes: int, rate: float) -> dict[str, float]:
        """Eq. 4 to 6 with the root and the first `nodes` nodes, by name; rate: lambda [1/J].

        'capture', and if the problem has such sets 'success', 'capture_any' and 'success_any'.
        """
        costs = self._costs[: nodes + 1]
        weights = np.exp(-rate * (costs - costs.min()))
        return {
            name: float(weights[inside[: nodes + 1]].sum() / weights.sum())
            for name, inside in self.inside.items()
        }
