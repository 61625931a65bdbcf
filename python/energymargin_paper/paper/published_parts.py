"""One part of the authors' data: their scores and ours of the same states, and cells of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from energymargin.evaluation import Among, LabelledScores
from energymargin.records.evaluation.bootstrap import (
    DRAWS,
    auc_ap,
    auc_ap_draws,
    bootstrap_weights,
    ranked,
)
from energymargin.records.evaluation.labelled import compared_states
from energymargin_paper.paper.authors.folder import SIMULATED
from energymargin_paper.paper.published_states import EARLY, Job, Source, StateScores
from energymargin_paper.probabilities import learned

__all__ = [
    "LEARNED",
    "PROBABILITY",
    "REPLAY",
    "Cell",
    "Early",
    "Part",
    "early_auc",
    "mean_auc",
    "part_of",
]

PROBABILITY, REPLAY, LEARNED = "probability", "replay", "learned"

Cell = tuple[float, float]
"""AUC and AP."""


@dataclass(frozen=True, eq=False)
class Early:
    """Success by frame of R recordings."""

    success: NDArray[np.bool_]
    """Shape (R,)."""
    scores: dict[str, NDArray[np.float64]]
    """By name, ours is "probability": shape (R, 10), a column for each frame of EARLY."""

    def auc(self, name: str, place: int) -> float:
        """AUC of one frame; NaN without both labels."""
        values = self.scores[name][:, place]
        there = ~np.isnan(values)
        labels = self.success[there]
        if not labels.any() or labels.all():
            return np.nan
        return auc_ap(values[there], labels)[0]


@dataclass(frozen=True, eq=False)
class Part:
    """One part of the data. All scores have one value a state, NaN where there is none."""

    name: str
    horizons: tuple[int, ...]
    complete: LabelledScores
    """The authors' labels and scores of all states."""
    theirs: dict[str, NDArray[np.float64]]
    """Theirs of the states that we scored."""
    ours: dict[str, NDArray[np.float64]]
    probability: dict[int, NDArray[np.float64]]
    """By horizon."""
    replay: dict[int, NDArray[np.float64]]
    """Whether it stays without a disturbance, 0 or 1, by horizon: what the motion alone tells."""
    labels: dict[str, LabelledScores]
    """"recorded", and of recordings also "smoothed"; their scores do not count."""
    learned: dict[str, dict[int, NDArray[np.float64]]]
    """By kind of label, then by horizon."""
    early: Early | None
    failed: int
    """States that could not be scored."""
    seconds: float
    """Time of all scores of one state [s]."""

    @property
    def simulated(self) -> bool:
        """Whether it is of Table I."""
        return self.name in SIMULATED

    def column(self, side: str, score: str, horizon: int, kind: str) -> NDArray[np.float64] | None:
        """The scores of a side, "theirs" or "ours"; None if it has none."""
        if score == PROBABILITY:
            return self.probability.get(horizon) if side == "ours" else None
        if score == REPLAY:
            return self.replay.get(horizon) if side == "ours" else None
        if score == LEARNED:
            return self.learned[kind].get(horizon) if side == "ours" else None
        return (self.ours if side == "ours" else self.theirs).get(score)

    def cell(
        self, side: str, score: str, horizon: int, among: Among, kind: str = "recorded"
    ) -> Cell | None:
        """AUC and AP; None without both labels, or scores."""
        values = self.column(side, score, horizon, kind)
        if values is None:
            return None
        compared = compared_states(self._with(values, kind), "one", horizon, among=among)
        return auc_ap(compared.scores, compared.labels) if compared.of_both_kinds else None

    def difference(
        self, score: str, horizon: int, among: Among, kind: str, seed: int
    ) -> NDArray[np.float64]:
        """AUC of a score of ours less that of their capture score, over draws of whole
        trajectories, shape (DRAWS,)."""
        weights = bootstrap_weights(len(self.complete.by_trajectory()), DRAWS, seed)
        each = []
        for side, own in (("ours", score), ("theirs", "capture")):
            values = self.column(side, own, horizon, kind)
            if values is None:
                return np.full(DRAWS, np.nan)
            compared = compared_states(self._with(values, kind), "one", horizon, among=among)
            ranks, labels = ranked(compared.scores), compared.labels
            each.append(auc_ap_draws(ranks, labels, compared.trajectory, weights)[0])
        return each[0] - each[1]

    def _with(self, values: NDArray[np.float64], kind: str) -> LabelledScores:
        return replace(self.labels[kind], scores={"one": values})


def mean_auc(cells: Sequence[Cell | None]) -> float:
    """The mean AUC of those that there are; NaN without any."""
    aucs = [cell[0] for cell in cells if cell is not None]
    return float(np.mean(aucs)) if aucs else float("nan")


def early_auc(parts: Sequence[Part], name: str, place: int) -> float:
    """AUC of a score of success at one frame of EARLY, the mean of the parts that have it."""
    values = [part.early.auc(name, place) for part in parts if part.early]
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")


def part_of(source: Source, horizons: Sequence[int], rows: Mapping[Job, StateScores]) -> Part:
    """What came out of a part, both sides on the same states."""
    own = {job.index: row for job, row in rows.items() if job.part == source.name}
    states = source.dataset.size
    ours: dict[str, NDArray[np.float64]] = {}
    shares, replayed = ({h: np.full(states, np.nan) for h in horizons if h > 0} for _ in range(2))
    for index, row in own.items():
        for name, value in row.scores.items():
            ours.setdefault(name, np.full(states, np.nan))[index] = value
        for h, of_horizon in shares.items():
            if len(row.shares) >= h:
                of_horizon[index], replayed[h][index] = row.shares[h - 1], row.replayed[h - 1]
    lacking = np.ones(states, dtype=bool)
    lacking[[index for index, row in own.items() if row.error is None]] = False
    theirs = {n: np.where(lacking, np.nan, own) for n, own in source.theirs.scores.items()}
    labels = {"recorded": source.theirs}
    if source.smoothed is not None:
        labels["smoothed"] = replace(source.theirs, captured=source.smoothed)
    return Part(
        name=source.name,
        horizons=tuple(horizons),
        complete=source.theirs,
        theirs=theirs,
        ours=ours,
        probability=shares,
        replay=replayed,
        labels=labels,
        learned={
            kind: _learned(source, own_labels, lacking, horizons)
            for kind, own_labels in labels.items()
        },
        early=_early_scores(source, own),
        failed=sum(row.error is not None for row in own.values()),
        seconds=float(np.mean([row.seconds for row in own.values()])) if own else math.nan,
    )


def _learned(
    source: Source,
    labelled: LabelledScores,
    lacking: NDArray[np.bool_],
    horizons: Sequence[int],
) -> dict[int, NDArray[np.float64]]:
    """By horizon, a plain classifier of the raw states, five-fold by trajectory."""
    trajectories = source.dataset.trajectories
    states = np.concatenate([trajectory.states for trajectory in trajectories])
    everyone = replace(labelled, scores={"one": np.zeros(len(states))})
    found = {}
    for horizon in horizons:
        if horizon == 0:
            continue
        compared = compared_states(everyone, "one", horizon, among="captured")
        counts, stays = np.zeros(len(states), dtype=bool), np.zeros(len(states), dtype=bool)
        counts[compared.number], stays[compared.number] = True, compared.labels
        found[horizon] = learned(states, stays, labelled.trajectory, counts & ~lacking, 0)
    return found


def _early_scores(source: Source, rows: Mapping[int, StateScores]) -> Early | None:
    """Scores of success by frame, of each recording; None of simulated data."""
    tracks = source.tracks
    if not tracks:
        return None
    members = source.theirs.by_trajectory()
    shape = (len(members), len(EARLY))
    found = {name: np.full(shape, np.nan) for name in (PROBABILITY, "success", "nearness")}
    for t, own in enumerate(members):
        for place, frame in enumerate(EARLY):
            if frame >= len(own):
                break
            row = rows.get(int(own[frame]))
            if row is not None and row.early is not None:
                found[PROBABILITY][t, place] = row.early
            last = source.theirs.scores["success"][own[max(0, frame - 4) : frame + 1]]
            found["success"][t, place] = np.average(last, weights=np.arange(1, len(last) + 1))
            found["nearness"][t, place] = -tracks[t].poses["object"][frame, 1]
    return Early(np.array([track.success for track in tracks]), found)
