"""Every score beside its label: the table of Section VI-E, as text, Markdown and CSV."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from energymargin.base.aliases import Ints
from energymargin.base.checks import seed_number, whole_number
from energymargin.base.metrics import ANY
from energymargin.base.reprs import Record
from energymargin.base.summary import Summarized
from energymargin.base.table_text import DASH, csv_text, short
from energymargin.records.evaluation import bootstrap, labelled as pairing

CELL_COLUMNS = ("count", "positives", "auc", "auc_low", "auc_high", "ap", "ap_low", "ap_high")
CSV_COLUMNS = ("score", "among", "horizon", *CELL_COLUMNS)


@dataclass(frozen=True)
class Cell:
    """One comparison of a score with a label."""

    auc: float
    ap: float
    auc_interval: tuple[float, float] | None
    """95 % bootstrap interval; None if there are not two trajectories to draw from."""
    ap_interval: tuple[float, float] | None
    count: int
    """How many states, or trajectories."""
    positives: int
    """How many of them have the label 1."""

    def value(self) -> str:
        """AUC/AP, such as ".981/.992"."""
        return f"{short(self.auc)}/{short(self.ap)}"

    def intervals(self) -> tuple[str, str]:
        """Intervals of AUC and of AP, such as ".96-.99"; a dash if there is none."""
        return _span(self.auc_interval), _span(self.ap_interval)


def cell_of(compared: pairing.Compared, weights: Ints) -> Cell | None:
    """AUC and AP, with intervals of the (draws, T) weights of the trajectories."""
    scores, labels, trajectory, _ = compared
    if not compared.of_both_kinds:
        return None
    both = bootstrap.intervals(bootstrap.ranked(scores), labels, trajectory, weights)
    return Cell(*bootstrap.auc_ap(scores, labels), *both, len(labels), int(labels.sum()))


def csv_fields(cell: Cell | None) -> list[float | str]:
    """Its columns of a CSV file, from count to ap_high; empty without a cell."""
    if cell is None:
        return [""] * len(CELL_COLUMNS)
    none = ("", "")
    areas = (cell.auc, *(cell.auc_interval or none), cell.ap, *(cell.ap_interval or none))
    return [cell.count, cell.positives, *areas]


def _span(interval: tuple[float, float] | None) -> str:
    return DASH if interval is None else f"{short(interval[0])}-{short(interval[1])}"


@dataclass(frozen=True, eq=False, repr=False)
class Evaluation(Record, Summarized):
    """AUC and AP of every score. A cell is None if there is one label alone."""

    task: str
    frames: tuple[int, ...]
    states: dict[str, dict[int, Cell | None]]
    """By score, then by horizon."""
    success: Cell | None
    """The trajectory score; None also if the success score was not computed."""
    missing: int
    """States that lack a score, and are left out."""
    missing_trajectories: int = 0
    """Trajectories that lack a score in one of their last frames, and are left out of success."""
    success_any: Cell | None = None
    """The trajectory score of at least one object."""
    last: int = pairing.LAST_FRAMES
    """k-bar, the frames of the trajectory score."""
    probable_success: Cell | None = None
    """Cell of the probability of success; None also if that was not computed."""
    asks: str | None = None
    """As of LabelledScores."""
    among: pairing.Among = "all"
    """Which states are compared; of those that are captured now `success` is None."""
    clipped: bool = False
    """Whether a horizon ends with its trajectory; else such states are left out."""
    counts: dict[int, pairing.Counts] = field(default_factory=dict)
    """By horizon, which states count."""

    @property
    def left_out(self) -> str:
        """In words, how many states lack a score: those not scored yet, or not to be simulated."""
        alone, lost = self.missing == 1, self.missing_trajectories
        states = "state has no score and is" if alone else "states have no score and are"
        so = "is 1 trajectory" if lost == 1 else f"are {lost} trajectories"
        return f"{self.missing} {states} left out" + f"; so {so} of success" * bool(lost)

    @property
    def trajectories(self) -> dict[str, Cell]:
        """By score, the cells that are there of whole trajectories."""
        of_all, probable, of_any = self.success, self.probable_success, self.success_any
        cells = zip(pairing.SUCCESSES, (of_all, probable, of_any), strict=True)
        return {score: cell for score, cell in cells if cell is not None}

    def to_csv(self) -> str:
        """One line a cell, in full precision; what is not there is empty."""
        return csv_text(CSV_COLUMNS, self.csv_rows())

    def csv_rows(self) -> list[list[Any]]:
        """The lines of `to_csv`, with CSV_COLUMNS."""
        cells: list[tuple[str, int | str, Cell | None]] = []
        for score, row in self.states.items():
            cells += [(score, horizon, cell) for horizon, cell in row.items()]
        of_all = self.among == "all"
        asked = of_all, self.probable_success, self.success_any or (self.several and of_all)
        there = [score for score, own in zip(pairing.SUCCESSES, asked, strict=True) if own]
        cells += [(score, "", self.trajectories.get(score)) for score in there]
        return [[score, self.among, h, *csv_fields(cell)] for score, h, cell in cells]

    @property
    def several(self) -> bool:
        """Whether there are scores of at least one object."""
        return self.success_any is not None or any(score.endswith(ANY) for score in self.states)

    @property
    def counted(self) -> str:
        """In words, how many states each horizon counts; of one horizon alone also why others do
        not."""
        if len(self.counts) != 1:
            numbers = ", ".join(str(one.counted) for one in self.counts.values())
            return numbers and f"States that count, by h: {numbers}."
        ((frames, one),) = self.counts.items()
        reasons = ("lost already", f"with fewer than {frames} frames left", "without a score")
        out = ", ".join(f"{n} {why}" for n, why in zip(one[2:], reasons, strict=True) if n)
        stay = "stays" if one.positives == 1 else "stay"
        text = f"{one.counted} of {sum(one) - one.positives} states count, of which "
        text += f"{one.positives} {stay} captured{f'; left out are {out}' if out else ''}."
        alone = one.positives in (0, one.counted)
        return f"{text} With one label alone no score can tell them apart." if alone else text

    @property
    def caption(self) -> str:
        """What the numbers are, and what is left out."""
        which = "States" if self.among == "all" else "States that are captured now"
        whole = "those with as many frames left"
        if self.clipped:
            whole = "a horizon ends with its trajectory (clipped)"
        sentences = [
            f"{self.task}: AUC/AP of each score, with their 95 % intervals below.",
            "" if self.asks is None else f"Asked: {self.asks}.",
            f"{which}: captured over the next h frames; {whole}.",
            self.counted,
        ]
        cells = [cell for row in self.states.values() for cell in row.values() if cell is not None]
        if cells and all(cell.auc_interval is None for cell in cells):
            sentences.append("Intervals take more trajectories than these: there are none.")
        if self.trajectories:
            whole = f"Success: the last {self.last} frames of a trajectory, whose success has no "
            sentences.append(f"{whole}horizon; the last frame alone tells most of it.")
        if self.missing and (len(self.counts) != 1 or self.missing_trajectories):
            sentences.append(f"{self.left_out}.")
        return " ".join(filter(None, sentences))


def evaluate(
    labelled: pairing.LabelledScores,
    *,
    frames: Sequence[int] = pairing.HORIZONS,
    draws: int = bootstrap.DRAWS,
    seed: int = 0,
    last: int = pairing.LAST_FRAMES,
    among: pairing.Among = "all",
    clipped: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Compares every score with its label. States without a score are left out, and counted.

    Args:
        labelled: scores of states, with what happened.
        frames: horizons in frames; a state counts that has as many frames after it.
        draws: of the bootstrap; the intervals take time in proportion.
        seed: of the bootstrap.
        last: k-bar, the frames of a trajectory whose success scores count.
        among: "all" states, or only those that are "captured" now; then there is nothing to tell at
            horizon 0, and whole trajectories are not compared.
        clipped: a horizon ends with its trajectory, so that every state counts.
        progress: progress(done, total) counts the cells of the table: with 20,000 states, each
            takes half a second.

    Raises ValueError on numbers out of range, and on `clipped` of scores with a clock.
    """
    whole_number("draws", draws, 1)
    seed = seed_number(seed)
    whole_number("last", last, 1)
    for horizon in frames:
        whole_number("frames", horizon, 0)
    if among == "captured":
        frames = [horizon for horizon in frames if horizon > 0]
    members = len(labelled.by_trajectory())
    weights = bootstrap.bootstrap_weights(members, draws, seed)
    states: dict[str, dict[int, Cell | None]] = {m: {} for m in pairing.state_metrics(labelled)}
    cells = [(metric, horizon) for metric in states for horizon in frames]
    for done, (metric, horizon) in enumerate(cells):
        if progress is not None:
            progress(done, len(cells))
        compared = pairing.compared_states(labelled, metric, horizon, among=among, clipped=clipped)
        states[metric][horizon] = cell_of(compared, weights)
    whole = [m for m in pairing.SUCCESSES if among == "all" and m in labelled.scores]
    trajectories = {m: pairing.compared_trajectories(labelled, m, last) for m in whole}
    successes = {metric: cell_of(own, weights) for metric, own in trajectories.items()}
    scored = min((len(own.scores) for own in trajectories.values()), default=members)
    missing = np.any([np.isnan(values) for values in labelled.scores.values()], axis=0)
    of_all, probable, of_any = map(successes.get, pairing.SUCCESSES)
    return Evaluation(
        *(labelled.task, tuple(frames), states, of_all, int(missing.sum())),
        missing_trajectories=members - scored,
        success_any=of_any,
        last=last,
        probable_success=probable,
        asks=labelled.asks,
        among=among,
        clipped=clipped,
        counts={h: pairing.count_states(labelled, h, among=among, clipped=clipped) for h in frames},
    )


def tables_of(
    labelled: pairing.LabelledScores,
    now: pairing.LabelledScores | None = None,
    *,
    among: pairing.Among | None = None,
    frames: Sequence[int] | None = None,
    clipped: bool = False,
) -> list[tuple[pairing.LabelledScores, pairing.Among, Sequence[int]]]:
    """The tables that tell most: which scores, among which states, at which horizons. With `among`
    or `frames`, or `clipped`, those tables, of all scores.

    Of scores with a horizon the first one asks what they ask, of the states that are captured now:
    do they stay so? Beside them are the scores `now` of the same states as they are, which then
    have the second table. Scores without a horizon have a table among all states, and one among
    those that are captured now.
    """
    if among is not None or frames or clipped:
        scores = labelled if now is None else labelled.beside(now)
        chosen = pairing.AMONG if among is None else (among,)
        return [(scores, each, frames or pairing.HORIZONS) for each in chosen]
    if labelled.frames is None:
        return [(labelled, each, pairing.HORIZONS) for each in pairing.AMONG]
    both, whole = (labelled, labelled) if now is None else (labelled.beside(now), now)
    return [(both, "captured", [labelled.frames]), (whole, "all", pairing.HORIZONS)]
