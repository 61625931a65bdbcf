"""How well probabilities and baselines tell which grasps hold, of one object or several."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.base.aliases import Floats
from energymargin.base.checks import check_shape, check_type, whole_number
from energymargin.base.table_text import csv_text
from energymargin.evaluation import DRAWS, Cell, Compared, bootstrap, cell_of
from energymargin.grasps.baselines import LESS_IS_BETTER, baselines
from energymargin.grasps.scores import GraspScores
from energymargin.summary import Summarized

LABELS, PROBABILITY = "labels", "probability"
LEARNED, LEARNED_TOO = "learned", "learned with probability"
HELD = 0.5  # labels of at least this count as held
FEWEST_OBJECTS = 3  # of a learned score: it learns from two at least

Columns = Mapping[str, ArrayLike]
Table = dict[str, Floats]


@dataclass(frozen=True)
class ComparedScore:
    """How well one score tells which grasps hold."""

    cell: Cell
    """AUC and AP of all grasps, with their intervals."""
    within: float
    """AUC of the pairs of grasps of one object; NaN if no object has both labels."""
    within_interval: bootstrap.Interval | None
    ahead: float
    """AUC of the probability less this AUC."""
    ahead_interval: bootstrap.Interval | None
    """Of the same draws of both: above 0, the probability is ahead."""


@dataclass(frozen=True, eq=False, repr=False)
class GraspComparison(Summarized):
    """Scores of grasps beside their labels."""

    scores: dict[str, ComparedScore]
    """By name, the probability first."""
    objects: tuple[str, ...]
    """What was gripped."""
    grasps: int
    held: int
    """How many of the grasps hold by their labels."""
    left_out: int
    """Grasps without a label or a probability."""

    def to_csv(self) -> str:
        """One line a score, in full precision."""
        values = ("auc", "ap", "within", "ahead")
        ends = [f"{name}{end}" for name in values for end in ("", "_low", "_high")]
        rows = []
        for name, one in self.scores.items():
            known = {**vars(one.cell), **vars(one)}
            spans = [(known[value], *(known[f"{value}_interval"] or ("", ""))) for value in values]
            rows.append((name, one.cell.count, one.cell.positives, *chain(*spans)))
        return csv_text(("score", "count", "positives", *ends), rows)


def compare(
    scores: Mapping[str, GraspScores],
    labels: Columns | None = None,
    *,
    columns: Mapping[str, Columns] | None = None,
    learned: bool = True,
    draws: int = DRAWS,
    seed: int = 0,
) -> GraspComparison:
    """How well the probability tells which grasps hold, and how well simpler scores do.

    A grasp without a value of a column, as epsilon of a hand that does not close, ranks last in it.
    The intervals are those of a bootstrap that draws whole objects; of one object, its grasps.

        scores = {name: em.grasps.score(grasps[name], "panda", objects[name]) for name in objects}
        print(em.grasps.compare(scores).to_markdown())

    Args:
        scores: by object.
        labels: 1 or True, the grasp held, by object, each (n,); NaN where it is not known. None:
            those of the file. At least 0.5 counts as held.
        columns: other scores, by object and name, each (n,); more is better. None: `baselines` of
            each object. One that is named "probability" takes its place.
        learned: also a score that logistic regression learns from the columns of all objects but
            the one that is scored, and one from the probability too; of three objects or more. They
            tell grasps of one object apart: see `ComparedScore.within`.
        draws: of the bootstrap.
        seed: of the bootstrap.

    Raises ValueError on columns that do not go together, and if all labels are alike.
    """
    check_type("scores", scores, Mapping, "GraspScores by object, as {'mug': scores}")
    if not scores:
        raise ValueError("scores is empty, expected GraspScores by object, as {'mug': scores}")
    whole_number("draws", draws, 1)
    given = {name: baselines(one) for name, one in scores.items()} if columns is None else columns
    known = {name: one.grasps.labels for name, one in scores.items()} if labels is None else labels
    for name, of in {"columns": given, "labels": known}.items():
        if missing := [thing for thing in scores if thing not in of]:
            raise ValueError(f"{name} has nothing of {missing[0]!r}, expected an entry an object")
    tables: dict[str, Columns] = {}
    for thing, one in scores.items():
        own = {LABELS: known[thing], PROBABILITY: one.probabilities}
        tables[thing] = {**own, **given[thing]}
    table = _joined(tables)
    there = ~(np.isnan(table[LABELS]) | np.isnan(table[PROBABILITY]))
    sizes = [len(one.grasps) for one in scores.values()]
    groups, held = np.repeat(np.arange(len(sizes)), sizes)[there], table.pop(LABELS)[there] >= HELD
    if held.all() or not held.any():
        which = f"{int(held.sum())} of {len(held)} grasps with a label and a probability hold"
        raise ValueError(f"{which}, expected some that hold and some that do not")
    better = {name: -1 if name in LESS_IS_BETTER else 1 for name in table}
    table = {name: better[name] * column[there] for name, column in table.items()}
    simple = {name: column for name, column in table.items() if name != PROBABILITY}
    if learned and simple and len(np.unique(groups)) >= FEWEST_OBJECTS:
        table |= {LEARNED: learn(simple, held, groups), LEARNED_TOO: learn(table, held, groups)}
    compared = _compared(table, held, groups, draws, seed)
    counts = (len(held), int(held.sum()), int((~there).sum()))
    return GraspComparison(compared, tuple(scores), *counts)


def learn(features: Columns, held: NDArray[np.bool_], groups: NDArray[np.int64]) -> Floats:
    """A score of each grasp, (n,), by logistic regression on the grasps of the other groups.

    Features count by their ranks within a group, for what is near of one object is far of another.
    The score has no intercept: that is the lower, the more of the grasps that are left out hold, so
    that it would rank objects the wrong way round.

    features: by name, each (n,), may have NaN. groups: numbers of the objects, (n,). The score is 0
    where the others have one label alone.
    """
    from scipy.stats import rankdata
    from sklearn.linear_model import LogisticRegression

    values = np.stack([_filled(one) for one in features.values()], axis=1)
    found, ranks, numbers = np.zeros(len(held)), np.empty(values.shape), np.unique(groups)
    for group in numbers:
        own = groups == group
        ranks[own] = rankdata(values[own], axis=0) / own.sum()
    for group in numbers:
        own = groups == group
        if held[~own].any() and not held[~own].all():
            model = LogisticRegression().fit(ranks[~own], held[~own])
            found[own] = ranks[own] @ model.coef_[0]
    return found


def _filled(column: ArrayLike) -> NDArray[np.float64]:
    """A column in which what is missing comes last."""
    values = np.asarray(column, dtype=float)
    return np.where(np.isnan(values), -np.inf, values)


def _joined(objects: Mapping[str, Columns]) -> Table:
    """Columns of all objects, one after the other."""
    names = list(next(iter(objects.values()), ()))
    for thing, columns in objects.items():
        if set(columns) != set(names):
            of = f"columns of {thing!r} are {list(columns)}"
            raise ValueError(f"{of}, expected {names} as before")
        for name, column in columns.items():
            check_shape(f"{name} of {thing!r}", np.asarray(column), np.shape(columns[PROBABILITY]))
    parts = {name: [np.asarray(own[name], float) for own in objects.values()] for name in names}
    return {name: np.concatenate(each) for name, each in parts.items()}


def _compared(
    table: Table, held: NDArray[np.bool_], groups: NDArray[np.int64], draws: int, seed: int
) -> dict[str, ComparedScore]:
    """Each column against the labels."""
    of_one = len(np.unique(groups)) == 1
    drawn = np.arange(len(held)) if of_one else np.unique(groups, return_inverse=True)[1]
    weights = bootstrap.bootstrap_weights(int(drawn.max()) + 1, draws, seed)
    found: dict[str, ComparedScore] = {}
    first = np.empty(0)
    for name, column in table.items():
        values = _filled(column)
        cell = cell_of(Compared(values, held, drawn, np.arange(len(held))), weights)
        assert cell is not None  # there are both labels
        drawn_aucs, _ = bootstrap.auc_ap_draws(bootstrap.ranked(values), held, drawn, weights)
        first = drawn_aucs if name == PROBABILITY else first
        right, pairs = _pairs(values, held, groups)
        with np.errstate(invalid="ignore"):
            within = right.sum() / pairs.sum()
            drawn_within = (weights @ right) / (weights @ pairs) if not of_one else drawn_aucs
        ahead = found[PROBABILITY].cell.auc - cell.auc if found else 0.0
        interval = bootstrap.central(first - drawn_aucs) if found else None
        apart = (float(within), bootstrap.central(drawn_within))
        found[name] = ComparedScore(cell, *apart, ahead, interval)
    return found


def _pairs(values: Any, held: Any, groups: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """By group, how many pairs of a held and a lost grasp the values put right, and all pairs."""
    rows = []
    for group in np.unique(groups):
        own = groups == group
        one, other = values[own & held][:, None], values[own & ~held]
        right = (one > other).sum() + 0.5 * (one == other).sum()
        rows.append((right, one.size * other.size))
    right, pairs = np.array(rows, dtype=float).T
    return right, pairs
