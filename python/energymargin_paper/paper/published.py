"""The authors' own data: their scores and ours on the same states.

The simulated trajectories of Table I and the recordings of Table II, from a folder that a user has
cloned (`energymargin_paper.paper.authors`). Every state is one line of runs.jsonl in the output
folder, written as soon as it is scored: stopped and started again, the study goes on with what is
missing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from energymargin.base.checks import whole_number
from energymargin.base.table_text import DASH, csv_text, markdown_table, short
from energymargin.evaluation import Among
from energymargin.records.evaluation.bootstrap import (
    DRAWS,
    auc_ap,
    auc_ap_draws,
    bootstrap_weights,
    ranked,
)
from energymargin.records.evaluation.labelled import AMONG, compared_states
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.paper import authors
from energymargin_paper.paper.authors.folder import SIMULATED
from energymargin_paper.paper.published_agreement import DEFINED, agreement, agreement_table
from energymargin_paper.paper.published_figure import figure_published
from energymargin_paper.paper.published_parts import (
    LEARNED,
    PROBABILITY,
    REPLAY,
    Cell,
    Part,
    early_auc,
    mean_auc,
    part_of,
)
from energymargin_paper.paper.published_states import (
    EARLY,
    OBJECTS,
    STRENGTH,
    Job,
    Source,
    StateScores,
    run,
    source_of,
)
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["STUDY", "Published", "Settings"]

RUNS_FILE = "runs.jsonl"
SIMULATED_HORIZONS = (0, 1, 2, 3, 4, 5)  # frames
RECORDED_HORIZONS = (0, 1, 2, 5, 10, 20)
CONFIDENCE = 0.95
# Rows of the tables: side and score.
TREES = ("capture", "effort/est", "effort/rrt")
SIMULATED_ROWS = (
    *(("theirs", "capture"), ("ours", "capture"), ("ours", DEFINED)),
    *((side, score) for score in TREES[1:] for side in ("theirs", "ours")),
    *(("ours", "force"), ("ours", PROBABILITY), ("ours", REPLAY)),
)
RECORDED_ROWS = (
    *(("theirs", "capture"), ("ours", "capture"), ("ours", DEFINED), ("ours", "force")),
    *(("ours", PROBABILITY), ("ours", LEARNED)),
)
SHORT = (("theirs", "capture"), *(("ours", n) for n in ("capture", DEFINED, PROBABILITY, REPLAY)))
TITLES = {
    DEFINED: "capture as the paper defines it",
    REPLAY: "undisturbed replay",
}


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    data: str = setting(
        "dynamicCageForMPPI-data", "Folder of the authors' data: simulated, recordings, shapes."
    )
    parts: tuple[str, ...] = setting(
        (), "Parts, separated by commas, as push,jaw-pushes-convex.", shown="all"
    )
    """As of `energymargin_paper.paper.authors.parts`; none: all that there are."""
    nodes: int = setting(200, "Nodes of our trees.")
    rollouts: int = setting(30, "Rollouts of each probability.")
    every: int = setting(
        5, "Frames of a recording from one scored state to the next: 1, 2, 5 or 10."
    )
    """Simulated states are all scored."""
    seed: int = setting(0, "Seed of every random draw.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
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


@dataclass(frozen=True, eq=False)
class Published:
    """All parts."""

    settings: Settings
    parts: list[Part]

    @cached_property
    def simulated(self) -> list[Part]:
        """Parts of Table I."""
        return [part for part in self.parts if part.simulated]

    @cached_property
    def recorded(self) -> list[Part]:
        """Parts of Table II."""
        return [part for part in self.parts if not part.simulated]

    def to_markdown(self) -> str:
        """All tables."""
        parts = ["# The authors' data", self._caption()]
        if self.simulated:
            parts += [
                self._means(),
                self._agreement(),
                *(self._simulated_table(among) for among in AMONG),
            ]
        if self.recorded:
            parts += [self._recorded_table(k, a) for k in ("recorded", "smoothed") for a in AMONG]
            parts.append(self._early_table())
        return "\n\n".join([*parts, self._own_table()]) + "\n"

    def to_csv(self) -> str:
        """One line a cell, in full precision."""
        rows: list[tuple[object, ...]] = []
        for part in self.parts:
            for side, score, kind, among, h in _cells(part):
                cell = part.cell(side, score, h, among, kind)
                if cell is not None:
                    rows.append((part.name, side, score, kind, among, h, *cell))
            for score, values in part.early.scores.items() if part.early else ():
                side = "ours" if score == PROBABILITY else "theirs"
                for place in range(values.shape[1]):
                    auc = part.early.auc(score, place) if part.early else np.nan
                    name = f"early {score}"
                    rows.append((part.name, side, name, "", "", EARLY[place], auc, ""))
        header = ("part", "side", "score", "labels", "among", "horizon", "auc", "ap")
        return csv_text(header, rows)

    def _caption(self) -> str:
        s = self.settings
        failed = {part.name: part.failed for part in self.parts if part.failed}
        of_parts = ", ".join(f"{count} of {name}" for name, count in failed.items())
        return (
            f"The authors' scores and ours on the same states; AUC/AP of staying captured for the "
            f"next h frames, states with as many frames left. Ours: trees of {s.nodes} nodes, "
            f"probability of {s.rollouts} rollouts under Uniform(strength={STRENGTH:g}, "
            f"objects={OBJECTS}), along the mean of the authors' script in simulation, and in "
            f"recordings along what the tool did in the last half second. Seed {s.seed}. "
            f"Of recordings every {s.every}th frame. "
            f"{sum(failed.values())} states could not be scored and are left out"
            f"{f' ({of_parts})' if failed else ''}."
        )

    def _means(self) -> str:
        """In short: the mean AUC over the horizons from 1 on of each simulated part."""
        rows = []
        for among in AMONG:
            for side, score in SHORT:
                name = f"{TITLES.get(score, score)}, {side}, {_AMONG[among]}"
                parts = ([(part, h) for h in SIMULATED_HORIZONS if h] for part in self.simulated)
                cells = [[part.cell(side, score, h, among) for part, h in of] for of in parts]
                rows.append([name, *(_value(mean_auc(of)) for of in cells)])
        table = markdown_table(["", *(part.name for part in self.simulated)], rows)
        return f"## Simulated, in short: mean AUC over one to five frames\n\n{table}"

    def _simulated_table(self, among: Among) -> str:
        horizons = [h for h in SIMULATED_HORIZONS if h or among == "all"]
        rows = []
        for part in self.simulated:
            for side, score in SIMULATED_ROWS:
                cells = [_shown(part.cell(side, score, h, among)) for h in horizons]
                rows.append([f"{part.name} {TITLES.get(score, score)}, {side}", *cells])
            for score in ("capture", PROBABILITY):
                ahead = [
                    self._ahead([part], score, h, among, "recorded")
                    if h or score == "capture"
                    else DASH
                    for h in horizons
                ]
                rows.append([f"{part.name}, {AHEAD.format(score)}", *ahead])
        return f"## Simulated, {_AMONG[among]}\n\n{_by_horizon(horizons, rows)}"

    def _recorded_table(self, kind: str, among: Among) -> str:
        horizons = [h for h in RECORDED_HORIZONS if h or among == "all"]
        rows = []
        for side, score in RECORDED_ROWS:
            means = [
                _mean([part.cell(side, score, h, among, kind) for part in self.recorded])
                for h in horizons
            ]
            rows.append([f"{TITLES.get(score, score)}, {side}", *means])
        ahead = [
            self._ahead(self.recorded, PROBABILITY, h, among, kind) if h else DASH for h in horizons
        ]
        rows.append([AHEAD.format(PROBABILITY), *ahead])
        title = f"## Recordings, {_AMONG[among]}, {kind} labels: mean of {len(self.recorded)}"
        return f"{title}\n\n{_by_horizon(horizons, rows)}"

    def _early_table(self) -> str:
        names = {PROBABILITY: "ours", "success": "theirs", "nearness": "nearness to the wall"}
        places = range(len(EARLY))
        rows = [
            [title, *(_value(early_auc(self.recorded, name, place)) for place in places)]
            for name, title in names.items()
        ]
        rows.append(["ours less theirs", *map(self._early_ahead, places)])
        table = markdown_table(["", *map(str, EARLY)], rows)
        return f"## Recordings: success, by frame of the last 100, mean AUC\n\n{table}"

    def _early_ahead(self, place: int) -> str:
        """The mean AUC, with its interval over draws of recordings."""
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
            draws = [
                auc_ap_draws(ranked(values), own.success, trajectory, weights)[0] for values in pair
            ]
            each.append(draws[0] - draws[1])
        return _difference(np.array(each)) if each else DASH

    def _own_table(self) -> str:
        """The authors' cells of all states, as their files have them."""
        rows = [
            [
                f"{part.name} {score}, {_AMONG[among]}",
                *(_shown(_own_cell(part, score, h, among)) for h in SIMULATED_HORIZONS),
            ]
            for part in self.simulated
            for score in TREES
            for among in AMONG
        ]
        tables = [_by_horizon(SIMULATED_HORIZONS, rows)]
        if self.recorded:
            means = [
                [
                    f"recordings, mean, {_AMONG[among]}",
                    *(
                        _mean([_own_cell(part, "capture", h, among) for part in self.recorded])
                        for h in RECORDED_HORIZONS
                    ),
                ]
                for among in AMONG
            ]
            tables.append(_by_horizon(RECORDED_HORIZONS, means))
        return "\n\n".join(["## The authors' scores on all states of these data", *tables])

    def _ahead(
        self, parts: Sequence[Part], score: str, horizon: int, among: Among, kind: str
    ) -> str:
        each = [
            part.difference(score, horizon, among, kind, number)
            for number, part in enumerate(parts)
        ]
        return _difference(np.array(each))

    def _agreement(self) -> str:
        rows = [
            row
            for part in self.simulated
            for row in agreement(part.name, part.theirs, part.ours, part.complete.captured)
        ]
        return f"## Simulated: the same scores, state by state\n\n{agreement_table(rows)}"


AHEAD = "AUC of our {} less their capture"
_AMONG = {"all": "all states", "captured": "captured now"}


def _cells(part: Part) -> Iterator[tuple[str, str, str, Among, int]]:
    scores = (*TREES, DEFINED, "force", PROBABILITY, REPLAY, LEARNED)
    for kind in part.labels:
        for among in AMONG:
            for side in ("theirs", "ours"):
                for score in scores:
                    for h in part.horizons:
                        yield side, score, kind, among, h


def _own_cell(part: Part, score: str, horizon: int, among: Among) -> Cell | None:
    """Cell of all states; None also now (horizon 0) among those that are captured now."""
    if score not in part.complete.scores or (horizon == 0 and among == "captured"):
        return None
    compared = compared_states(part.complete, score, horizon, among=among)
    return auc_ap(compared.scores, compared.labels) if compared.of_both_kinds else None


def _by_horizon(horizons: Sequence[int], rows: Sequence[Sequence[str]]) -> str:
    """A table with a column for each horizon."""
    return markdown_table(["", *(f"h = {h}" for h in horizons)], rows)


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


class PublishedStudy(Study[Settings, Published]):
    """The authors' own data: their scores and ours on the same states, cell by cell.

    The folder gets published.md, published.csv, published.png and runs.jsonl.

    Example: `energymargin reproduce published --data dynamicCageForMPPI-data --parts push,balance`
    """

    name = "published"
    title, unit = "Scoring", "states"
    settings = Settings()
    quick = Settings(nodes=20, rollouts=8, every=10)
    packages = ("scikit-learn", "coacd")

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Published:
        """Scores what is missing. Raises ValueError on a folder that has none of the data."""
        data = Path(settings.data)
        every = authors.parts(data)
        wrong = [name for name in settings.parts if name not in every]
        if wrong:
            raise ValueError(f"parts has {wrong[0]!r}, expected some of {', '.join(every)}")
        parts = [name for name in every if not settings.parts or name in settings.parts]
        sources = {
            name: source_of(data, name, settings.horizons(name in SIMULATED), settings.every)
            for name in parts
        }
        jobs = [job for source in sources.values() for job in _jobs(source, settings)]
        rows = resumed(
            *(folder / RUNS_FILE, jobs, partial(run, sources), threads),
            lines=pairs(Job, StateScores),
            progress=progress,
        )
        made = [part_of(own, settings.horizons(own.simulated), rows) for own in sources.values()]
        return Published(settings, made)

    def figures(self, result: Published) -> Iterator[tuple[str, Figure]]:
        """AUC by horizon, theirs and ours, and how early success is known."""
        yield "published.png", figure_published(result.simulated, result.recorded)


STUDY = PublishedStudy()


def _jobs(source: Source, settings: Settings) -> Iterator[Job]:
    """One a state that is scored."""
    program = version("energymargin")
    for index in source.numbers:
        yield Job(program, source.name, index, settings.nodes, settings.rollouts, settings.seed)
