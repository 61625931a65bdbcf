"""Do the intervals of the capture and success scores hold what they say?

Of each of several states, many trees are grown. The mean of their scores counts as the truth, and
the trees as all that there are: from them, k are drawn at random, again and again, and each time it
is asked whether the interval made of the k holds the truth. The same for trees that are added one
by one until a tolerance is met, which is known to stop too early if it may stop after a few.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import regions, tasks
from energymargin._core import (
    FEWEST_TREES,
    Cylinder,
    Problem,
    Scene,
    capture_score,
    interval,
    stream,
)
from energymargin.checks import whole_number
from energymargin.replacing import replace_text
from energymargin.table_text import csv_text, markdown_table
from energymargin_paper.study import Progress, Study, setting

__all__ = [
    "ALL",
    "OWN",
    "STUDY",
    "Settings",
    "Uncertainty",
    "coverage",
    "stopped_at",
    "stopping",
]

OWN = "puck"
"""The problem that is no task."""
ALL = ("push", "balance", "topple", "grasp", OWN)
FRAMES = ((0, 1), (0, 4), (0, 7), (1, 1), (1, 7))  # trajectory and frame of each state of a task
SPEEDS = (0.0, 0.1, 0.2)  # m/s, of the puck towards the rim, one a state
COUNTS = (4, 5, 8, 10, 20)
FEWEST = (4, 5, 6, 8, 10, 12)  # trees at which a tolerance may be met
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on unknown tasks and numbers out of range."""

    tasks: tuple[str, ...] = setting(ALL, "Tasks, separated by commas.")
    states: int = setting(5, "States of each task.")
    """At most as many as there are FRAMES."""
    nodes: tuple[int, ...] = setting((100, 300), "Sizes of the trees, separated by commas.")
    trees: int = setting(200, "Trees of each state.")
    draws: int = 1000
    """How often k of the trees are drawn."""
    tolerance: float = 0.02
    seed: int = setting(0, "Seed; the same gives the same numbers, to the last bit.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        wrong = [name for name in self.tasks if name not in ALL]
        if wrong or not self.tasks:
            what = repr(wrong[0]) if wrong else "empty"
            raise ValueError(f"tasks has {what}, expected some of {', '.join(ALL)}")
        whole_number("states", self.states, 1, len(FRAMES))
        whole_number("trees", self.trees, max(COUNTS))
        whole_number("draws", self.draws, 1)
        whole_number("seed", self.seed, 0, 2**63 - 1)
        for nodes in self.nodes:
            whole_number("nodes", nodes, 1)


@dataclass(frozen=True)
class StateTrees:
    """All trees of one state."""

    task: str
    state: str
    nodes: int
    resolution: float
    """Likelihood of a tree's heaviest node, in the mean."""
    scores: dict[str, list[float]]
    """Of each tree, by the name of the set."""


@dataclass(frozen=True)
class Coverage:
    """One score of one state, and how it is known."""

    task: str
    state: str
    nodes: int
    which: str
    truth: float
    deviation: float
    """Standard deviation of the trees' scores."""
    fine: bool
    """Whether the deviation is smaller than the share of one node: the trees agree."""
    covered: dict[int, float]
    """By number of trees, the share of the intervals that hold the truth."""
    stopped: dict[int, float]
    """The same with the tolerance, by the fewest trees that may meet it."""
    grown: dict[int, float]
    """Trees until then, in the mean."""


@dataclass(frozen=True)
class Uncertainty:
    """The result."""

    settings: Settings
    rows: list[Coverage]

    def to_csv(self) -> str:
        """One line for each score of each state."""
        header = (
            *("task", "state", "nodes", "score", "truth", "spread", "finer_than_a_node"),
            *(f"covered_{k}" for k in COUNTS),
            *(f"covered_tolerance_from_{k}" for k in FEWEST),
            *(f"trees_tolerance_from_{k}" for k in FEWEST),
        )
        rows = [
            (
                *(
                    row.task,
                    row.state,
                    row.nodes,
                    row.which,
                    row.truth,
                    row.deviation,
                    int(row.fine),
                ),
                *(row.covered[k] for k in COUNTS),
                *(row.stopped[k] for k in FEWEST),
                *(row.grown[k] for k in FEWEST),
            )
            for row in self.rows
        ]
        return csv_text(header, rows)

    def to_markdown(self) -> str:
        """Mean and worst coverage, by task and number of trees."""
        s = self.settings
        header = [*(f"{k} trees" for k in COUNTS), f"tolerance {s.tolerance:g}", "its trees"]
        text = (
            f"Share of the {CONFIDENCE:.0%} intervals that hold the mean of {s.trees} trees: mean, "
            f"and lowest, over the scores of the states ({s.draws} draws of each; trees of "
            f"{' and '.join(map(str, s.nodes))} nodes)."
        )
        lines = []
        for task in dict.fromkeys(row.task for row in self.rows):
            for fine in (False, True):
                rows = [row for row in self.rows if row.task == task and row.fine == fine]
                if rows:
                    lines.append(_line(task + (", trees agree" if fine else ""), rows))
        differ = [row for row in self.rows if not row.fine]
        if differ:
            lines.append(_line("all whose trees differ", differ))
        parts = [text, markdown_table(["", "scores", *header], lines)]
        if differ:
            parts.append(self._by_fewest(differ))
        return "\n\n".join(parts) + "\n"

    def _by_fewest(self, rows: Sequence[Coverage]) -> str:
        """What the fewest trees do that may meet the tolerance."""
        tolerance = f"tolerance {self.settings.tolerance:g} met from"
        header = (tolerance, "share that holds, mean, lowest", "trees, mean")
        lines = []
        for k in FEWEST:
            shares = [row.stopped[k] for row in rows]
            grown = np.mean([row.grown[k] for row in rows])
            lines.append((f"{k} trees on", _shares(shares), f"{grown:.1f}"))
        return markdown_table(header, lines)


class UncertaintyStudy(Study[Settings, Uncertainty]):
    """How often the intervals of capture and success scores hold the truth.

    Of each state many trees are grown, whose mean counts as the truth. From them, a few are drawn
    again and again, and each time it is asked whether their 95 % interval holds the mean.

    The folder gets uncertainty.md, uncertainty.csv and the scores of all trees (trees/*.json). It
    takes a quarter of an hour; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce uncertainty --tasks topple --nodes 100`
    """

    name = "uncertainty"
    title, unit = "Growing trees", "states"
    settings = Settings()
    quick = Settings(nodes=(20,), states=1, trees=40)

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Uncertainty:
        """Grows the trees that are not in the folder yet, and asks their intervals.

        Each state is kept as soon as it is done, and the tables are of all states that there are.
        """
        problems = [
            (task, state, problem)
            for task in settings.tasks
            for state, problem in _problems(task, settings.states)
        ]
        total = len(problems) * len(settings.nodes)
        (folder / "trees").mkdir(exist_ok=True)
        result = Uncertainty(settings, [])
        for done, (nodes, (task, state, problem)) in enumerate(product(settings.nodes, problems)):
            progress(done, total)
            path = folder / "trees" / f"{task}-{state}-{nodes}.json"
            cell = _kept(path, settings)
            if cell is None:
                cell = StateTrees(task, state, nodes, *_grown(problem, nodes, settings, threads))
                _keep(path, settings, cell)
            result.rows.extend(_rows(cell, settings))
            self.write(result, folder)
        progress(total, total)
        return result


STUDY = UncertaintyStudy()


def coverage(
    scores: NDArray[np.float64], resolution: float, k: int, draws: int, seed: int
) -> float:
    """Share of the intervals of k trees, drawn with replacement, that hold the mean of all."""
    picked = scores[np.random.default_rng(seed).integers(len(scores), size=(draws, k))]
    return float(np.mean([_holds(trees, resolution, scores.mean()) for trees in picked]))


def stopping(
    scores: NDArray[np.float64],
    resolution: float,
    tolerance: float,
    *,
    draws: int,
    seed: int,
    fewest: Sequence[int] = FEWEST,
) -> dict[int, tuple[NDArray[np.float64], float]]:
    """Trees are drawn until all their standard errors are at most `tolerance`.

    `scores`: of each tree, shape (sets, trees). By the fewest trees that may meet it: the share of
    the intervals that hold the mean of all, shape (sets,), and how many trees it takes in the mean.
    Draws end with as many as there are.
    """
    random, total = np.random.default_rng(seed), scores.shape[1]
    held = {least: np.zeros(len(scores)) for least in fewest}
    grown = dict.fromkeys(fewest, 0.0)
    for _ in range(draws):
        picked = scores[:, random.integers(total, size=total)]
        for least in fewest:
            count = stopped_at(picked, tolerance, least)
            held[least] += [
                _holds(own[:count], resolution, all_trees.mean())
                for own, all_trees in zip(picked, scores, strict=True)
            ]
            grown[least] += count
    return {least: (held[least] / draws, grown[least] / draws) for least in fewest}


def stopped_at(scores: NDArray[np.float64], tolerance: float, fewest: int = FEWEST_TREES) -> int:
    """How many of these trees, shape (sets, trees), `capture_score` would grow."""
    n = np.arange(1, scores.shape[1] + 1)
    centred = scores - scores.mean(axis=1, keepdims=True)
    sums, squares = centred.cumsum(axis=1), (centred**2).cumsum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.sqrt(np.maximum(squares - sums**2 / n, 0) / (n * (n - 1)))
    met = (n >= fewest) & (error <= tolerance).all(axis=0)
    return int(n[met.argmax()] if met.any() else n[-1])


def _holds(scores: NDArray[np.float64], resolution: float, truth: float) -> bool:
    low, high = interval(scores, resolution, CONFIDENCE)
    rounding = 1e-12
    return bool(low - rounding <= truth <= high + rounding)


def _rows(cell: StateTrees, settings: Settings) -> Iterator[Coverage]:
    scores = np.array(list(cell.scores.values()))
    stops = stopping(
        scores, cell.resolution, settings.tolerance, draws=settings.draws, seed=settings.seed
    )
    for number, (which, own) in enumerate(zip(cell.scores, scores, strict=True)):
        yield Coverage(
            task=cell.task,
            state=cell.state,
            nodes=cell.nodes,
            which=which,
            truth=float(own.mean()),
            deviation=float(own.std(ddof=1)),
            fine=bool(own.std(ddof=1) < cell.resolution),
            covered={
                k: coverage(own, cell.resolution, k, settings.draws, settings.seed) for k in COUNTS
            },
            stopped={least: float(shares[number]) for least, (shares, _) in stops.items()},
            grown={least: grown for least, (_, grown) in stops.items()},
        )


def _line(name: str, rows: Sequence[Coverage]) -> list[str]:
    cells = [_shares([row.covered[k] for row in rows]) for k in COUNTS]
    cells.append(_shares([row.stopped[FEWEST_TREES] for row in rows]))
    cells.append(f"{np.mean([row.grown[FEWEST_TREES] for row in rows]):.0f}")
    return [name, str(len(rows)), *cells]


def _shares(values: Sequence[float]) -> str:
    return f"{np.mean(values):.3f}, {np.min(values):.3f}"


def _problems(task: str, states: int) -> list[tuple[str, Problem]]:
    """States of a task, each with its name."""
    if task == OWN:
        return [(f"{speed:g}", puck(speed)) for speed in SPEEDS[:states]]
    made, found = tasks.make(task), []
    trajectories = {t: made.rollout(t) for t, _ in FRAMES[:states]}
    for t, k in FRAMES[:states]:
        own = trajectories[t]
        found.append((f"{t}-{k}", made.problem(own.states[k], own.params, own.contacts[k])))
    return found


def puck(speed: float) -> Problem:
    """A puck on ice between two rims, one of which it slides to with a speed [m/s]."""
    scene = Scene(gravity=(0.0, 0.0, -9.81))
    scene.add_plane("ice", friction=0.02)
    planar: dict[str, Any] = {"linear_factor": (1, 1, 0), "angular_factor": (0, 0, 1)}
    scene.add_body("puck", Cylinder(0.04, 0.02), mass=0.2, position=(0, 0, 0.01), friction=0.5,
                   role="object", **planar)  # fmt: skip
    return Problem(
        scene,
        scene.pack(puck={"velocity": (speed, 0.0, 0.0)}),
        force=(0.2, 0.2, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=regions.Disc("puck", center=(0, 0), radius=0.1),
        succeeded=regions.HalfSpace("puck", normal=(-1, 0, 0), offset=-0.06),
        rate=50.0,
    )


def _made_by(settings: Settings) -> dict[str, Any]:
    """What the trees depend on."""
    return {
        "trees": settings.trees,
        "seed": settings.seed,
        "energymargin": version("energymargin"),
    }


def _kept(path: Path, settings: Settings) -> StateTrees | None:
    if not path.exists():
        return None
    kept = json.loads(path.read_text())
    if kept.pop("made_by") != _made_by(settings):
        raise ValueError(f"{path} holds other trees: remove it, or choose another folder")
    return StateTrees(**kept)


def _keep(path: Path, settings: Settings, cell: StateTrees) -> None:
    replace_text(path, json.dumps({"made_by": _made_by(settings), **asdict(cell)}))


def _grown(
    problem: Problem, nodes: int, settings: Settings, threads: int
) -> tuple[float, dict[str, list[float]]]:
    """Resolution, and the trees' scores by set."""
    score = capture_score(
        problem,
        nodes=nodes,
        seed=stream(settings.seed, nodes),
        trees=settings.trees,
        threads=threads,
        warn=False,
    )
    scores = {"capture": score.capture_by_tree, "success": score.success_by_tree}
    return score.resolution, {name: own.tolist() for name, own in scores.items() if len(own)}
