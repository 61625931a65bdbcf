"""The tables of `published`: the authors' scores and ours, cell by cell."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from energymargin.checks import whole_number
from energymargin.evaluation import Among, LabelledScores
from energymargin.evaluation.bootstrap import DRAWS, auc_ap, auc_draws, bootstrap_weights
from energymargin.evaluation.cells import DASH
from energymargin.evaluation.labelled import AMONG, compared_states
from energymargin.published.folder import SIMULATED
from energymargin.shares import short
from energymargin_paper.study import setting

__all__ = [
    "EARLY",
    "LEARNED",
    "OBJECTS",
    "PROBABILITY",
    "STRENGTH",
    "Early",
    "Part",
    "Published",
    "Settings",
]

STRENGTH, OBJECTS = 0.6, 1  # of the disturbance: the one rule of docs/results/foresight.md
SIMULATED_HORIZONS = (0, 1, 2, 3, 4, 5)  # frames
RECORDED_HORIZONS = (0, 1, 2, 5, 10, 20)
EARLY = tuple(range(9, 100, 10))  # frames of a recording's last 100
PROBABILITY, LEARNED = "probability", "learned"
CLOCKLESS = ("capture", "effort/est", "effort/rrt", "force")
CONFIDENCE = 0.95

Cell = tuple[float, float]
"""AUC and AP."""


@dataclass(frozen=True)
class Settings:
    """Of the study; raises ValueError on numbers out of range."""

    data: str = setting(
        "dynamicCageForMPPI-data", "Folder of the authors' data: simulated, recordings, shapes."
    )
    parts: tuple[str, ...] = setting(
        (), "Which, with commas between, as push,jaw-pushes-convex.", shown="all"
    )
    """As of `energymargin.published.parts`; none: all that there are."""
    nodes: int = setting(100, "Of our trees.")
    rollouts: int = setting(30, "Of each probability.")
    every: int = setting(
        5, "Frames of a recording from one scored state to the next: 1, 2, 5 or 10."
    )
    """Simulated states are all scored."""
    seed: int = setting(0, "Of all that is random.")

    def __post_init__(self) -> None:
        """Checks them."""
        for name in ("nodes", "rollouts"):
            whole_number(name, getattr(self, name), 1)
        if self.every not in (1, 2, 5, 10):
            raise ValueError(
                f"every is {self.every}, expected 1, 2, 5 or 10: success is asked at every tenth "
                "frame"
            )

    def horizons(self, simulated: bool) -> Sequence[int]:
        """In frames: 1/30 s in the recordings."""
        return SIMULATED_HORIZONS if simulated else RECORDED_HORIZONS


@dataclass(frozen=True)
class Early:
    """Success by frame of R recordings."""

    success: NDArray[np.bool_]
    """Shape (R,)."""
    scores: dict[str, NDArray[np.float64]]
    """By name, ours is "probability": shape (R, 10), a column for each frame of EARLY."""

    def auc(self, name: str, place: int) -> float:
        """Of one frame; NaN without both labels."""
        values = self.scores[name][:, place]
        there = ~np.isnan(values)
        labels = self.success[there]
        if not labels.any() or labels.all():
            return np.nan
        return auc_ap(values[there], labels)[0]


@dataclass(frozen=True)
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
    labels: dict[str, LabelledScores]
    """"recorded", and of recordings also "smoothed"; their scores do not count."""
    learned: dict[str, dict[int, NDArray[np.float64]]]
    """By kind of label, then by horizon."""
    early: Early | None
    failed: int
    """States that could not be scored."""
    seconds: float
    """Of one state, all scores [s]."""

    @property
    def simulated(self) -> bool:
        """Whether it is of Table I."""
        return self.name in SIMULATED

    def column(self, side: str, score: str, horizon: int, kind: str) -> NDArray[np.float64] | None:
        """The scores of a side, "theirs" or "ours"; None if it has none."""
        if score == PROBABILITY:
            return self.probability.get(horizon) if side == "ours" else None
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

    def difference(self, horizon: int, among: Among, kind: str, seed: int) -> NDArray[np.float64]:
        """AUC of our probability less that of their capture score, over draws of whole
        trajectories, shape (DRAWS,)."""
        weights = bootstrap_weights(len(self.complete.by_trajectory()), DRAWS, seed)
        each = []
        for side, score in (("ours", PROBABILITY), ("theirs", "capture")):
            values = self.column(side, score, horizon, kind)
            if values is None:
                return np.full(DRAWS, np.nan)
            compared = compared_states(self._with(values, kind), "one", horizon, among=among)
            each.append(auc_draws(compared.scores, compared.labels, compared.trajectory, weights))
        return each[0] - each[1]

    def _with(self, values: NDArray[np.float64], kind: str) -> LabelledScores:
        return replace(self.labels[kind], scores={"one": values})


@dataclass(frozen=True)
class Published:
    """All parts."""

    settings: Settings
    parts: list[Part]

    @cached_property
    def simulated(self) -> list[Part]:
        """Of Table I."""
        return [part for part in self.parts if part.simulated]

    @cached_property
    def recorded(self) -> list[Part]:
        """Of Table II."""
        return [part for part in self.parts if not part.simulated]

    def to_markdown(self) -> str:
        """All tables."""
        lines = ["# The authors' data", "", *self._caption(), ""]
        for among in AMONG:
            if self.simulated:
                lines += [*self._simulated_table(among), ""]
        if self.recorded:
            for kind in ("recorded", "smoothed"):
                for among in AMONG:
                    lines += [*self._recorded_table(kind, among), ""]
            lines += [*self._early_table(), ""]
        lines += [*self._own_table(), ""]
        return "\n".join(lines)

    def to_csv(self) -> str:
        """One line a cell, in full precision."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(("part", "side", "score", "labels", "among", "horizon", "auc", "ap"))
        for part in self.parts:
            for side, score, kind, among, h in _cells(part):
                cell = part.cell(side, score, h, among, kind)
                if cell is not None:
                    writer.writerow((part.name, side, score, kind, among, h, *cell))
            for score, values in part.early.scores.items() if part.early else ():
                side = "ours" if score == PROBABILITY else "theirs"
                for place in range(values.shape[1]):
                    auc = part.early.auc(score, place) if part.early else np.nan
                    name = f"early {score}"
                    writer.writerow((part.name, side, name, "", "", EARLY[place], auc, ""))
        return text.getvalue()

    def _caption(self) -> list[str]:
        s = self.settings
        failed = sum(part.failed for part in self.parts)
        return [
            f"The authors' scores and ours on the same states; AUC/AP of staying captured for the "
            f"next h frames, states with as many frames left. Ours: trees of {s.nodes} nodes, "
            f"probability of {s.rollouts} rollouts under Uniform(strength={STRENGTH:g}, "
            f"objects={OBJECTS}), along the mean of the authors' script in simulation, and in "
            f"recordings along what the tool did in the last half second. Seed {s.seed}, "
            f"energymargin {version('energymargin')}. Of recordings every {s.every}th frame. "
            f"{failed} states could not be scored."
        ]

    def _simulated_table(self, among: Among) -> Iterator[str]:
        horizons = [h for h in SIMULATED_HORIZONS if h or among == "all"]
        yield f"## Simulated, {_AMONG[among]}"
        yield ""
        yield from _header("", [f"h = {h}" for h in horizons])
        for part in self.simulated:
            for side, score in _rows(part, among):
                cells = [_shown(part.cell(side, score, h, among)) for h in horizons]
                yield f"| {part.name} {score}, {side} | {' | '.join(cells)} |"
            ahead = [self._ahead([part], h, among, "recorded") if h else DASH for h in horizons]
            yield f"| {part.name}, {AHEAD} | {' | '.join(ahead)} |"

    def _recorded_table(self, kind: str, among: Among) -> Iterator[str]:
        horizons = [h for h in RECORDED_HORIZONS if h or among == "all"]
        yield f"## Recordings, {_AMONG[among]}, {kind} labels: mean of {len(self.recorded)}"
        yield ""
        yield from _header("", [f"h = {h}" for h in horizons])
        for side, score in (
            ("theirs", "capture"),
            ("ours", "capture"),
            ("ours", "force"),
            ("ours", PROBABILITY),
            ("ours", LEARNED),
        ):
            means = [
                _mean([part.cell(side, score, h, among, kind) for part in self.recorded])
                for h in horizons
            ]
            yield f"| {score}, {side} | {' | '.join(means)} |"
        ahead = [self._ahead(self.recorded, h, among, kind) if h else DASH for h in horizons]
        yield f"| {AHEAD} | {' | '.join(ahead)} |"

    def _early_table(self) -> Iterator[str]:
        yield "## Recordings: success, by frame of the last 100, mean AUC"
        yield ""
        yield from _header("", [str(frame) for frame in EARLY])
        rows = ((PROBABILITY, "ours"), ("success", "theirs"), ("nearness", "nearness to the wall"))
        for name, said in rows:
            means = [self.early_auc(name, place) for place in range(len(EARLY))]
            yield f"| {said} | {' | '.join(_value(value) for value in means)} |"
        ahead = [self._early_ahead(place) for place in range(len(EARLY))]
        yield f"| ours less theirs | {' | '.join(ahead)} |"

    def early_auc(self, name: str, place: int) -> float:
        """Mean of the combinations."""
        values = [part.early.auc(name, place) for part in self.recorded if part.early]
        return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")

    def _early_ahead(self, place: int) -> str:
        """Of the mean AUC, with its interval over draws of recordings."""
        each = []
        for number, part in enumerate(self.recorded):
            if part.early is None:
                continue
            own = part.early
            weights = bootstrap_weights(len(own.success), DRAWS, number)
            trajectory = np.arange(len(own.success))
            pair = [own.scores[name][:, place] for name in (PROBABILITY, "success")]
            if not np.isfinite(pair).all():
                continue
            draws = [auc_draws(values, own.success, trajectory, weights) for values in pair]
            each.append(draws[0] - draws[1])
        return _difference(np.array(each)) if each else DASH

    def _own_table(self) -> Iterator[str]:
        """The authors' cells of all states, as their files have them."""
        yield "## The authors' scores on all of their states"
        yield ""
        yield from _header("", [f"h = {h}" for h in SIMULATED_HORIZONS])
        for part in self.simulated:
            for score in ("capture", "effort/est", "effort/rrt"):
                for among in AMONG:
                    cells = [
                        _shown(_own_cell(part, score, h, among)) if h or among == "all" else DASH
                        for h in SIMULATED_HORIZONS
                    ]
                    yield f"| {part.name} {score}, {_AMONG[among]} | {' | '.join(cells)} |"
        if self.recorded:
            yield ""
            yield from _header("", [f"h = {h}" for h in RECORDED_HORIZONS])
            for among in AMONG:
                means = [
                    _mean([_own_cell(part, "capture", h, among) for part in self.recorded])
                    if h or among == "all"
                    else DASH
                    for h in RECORDED_HORIZONS
                ]
                yield f"| recordings, mean, {_AMONG[among]} | {' | '.join(means)} |"

    def _ahead(self, parts: Sequence[Part], horizon: int, among: Among, kind: str) -> str:
        each = [part.difference(horizon, among, kind, number) for number, part in enumerate(parts)]
        return _difference(np.array(each))


AHEAD = "AUC of our probability less their capture"
_AMONG = {"all": "all states", "captured": "captured now"}


def _rows(part: Part, among: Among) -> Iterator[tuple[str, str]]:
    for score in ("capture", "effort/est", "effort/rrt"):
        yield "theirs", score
        yield "ours", score
    yield "ours", "force"
    yield "ours", PROBABILITY


def _cells(part: Part) -> Iterator[tuple[str, str, str, Among, int]]:
    scores = (*CLOCKLESS, PROBABILITY, LEARNED)
    for kind in part.labels:
        for among in AMONG:
            for side in ("theirs", "ours"):
                for score in scores:
                    for h in part.horizons:
                        yield side, score, kind, among, h


def _own_cell(part: Part, score: str, horizon: int, among: Among) -> Cell | None:
    if score not in part.complete.scores:
        return None
    compared = compared_states(part.complete, score, horizon, among=among)
    return auc_ap(compared.scores, compared.labels) if compared.of_both_kinds else None


def _header(first: str, columns: Sequence[str]) -> Iterator[str]:
    yield f"| {first} | {' | '.join(columns)} |"
    yield "| --- " * (1 + len(columns)) + "|"


def _shown(cell: Cell | None) -> str:
    return DASH if cell is None else f"{short(cell[0])}/{short(cell[1])}"


def _mean(cells: Sequence[Cell | None]) -> str:
    there = [cell for cell in cells if cell is not None]
    return _shown(tuple(np.mean(there, axis=0))) if there else DASH


def _value(value: float) -> str:
    return DASH if np.isnan(value) else short(value)


def _difference(draws: NDArray[np.float64]) -> str:
    """The mean over parts, (parts, draws), and its 95 % interval; parts and draws that have one
    label alone are left out."""
    known = draws[np.isfinite(draws).any(axis=1)]
    if not len(known):
        return DASH
    there = np.nanmean(known[:, np.isfinite(known).any(axis=0)], axis=0)
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(there, (tail, 1 - tail))
    return f"{there.mean():+.3f}<br>{low:+.3f} to {high:+.3f}"
