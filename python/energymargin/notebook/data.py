"""What trajectories, and scores of many states, look like in a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from energymargin.datasets import Dataset
from energymargin.evaluation import Evaluation, LabelledScores
from energymargin.metrics import unit, value_text
from energymargin.notebook.tables import MOST_ROWS, NamedValue, grid, table
from energymargin.scoring import ScoreTable
from energymargin.store import Run, ScoreStore
from energymargin.trajectories import Trajectory

__all__ = [
    "dataset",
    "evaluation",
    "labelled_scores",
    "run",
    "score_store",
    "score_table",
    "trajectory",
]


def score_table(scores: ScoreTable) -> str:
    """The first problems' scores, a row each."""
    names = list(scores.scores)
    rows = [
        (int(scores.index[i]), *(value_text(name, scores.scores[name][i]) for name in names))
        for i in range(min(len(scores), MOST_ROWS))
    ]
    head = ("problem", *map(_named, names))
    seconds = f"{float(np.sum(scores.seconds)):.3g} s of computing."
    missing = "" if scores.complete else " Not complete: some problems were not scored in time."
    return grid("Scores", head, rows, seconds + missing, len(scores))


def _named(metric: str) -> str:
    return f"{metric} [{unit(metric)}]" if unit(metric) else metric


def evaluation(result: Evaluation) -> str:
    """AUC and AP of each score, by horizon."""
    head = ("score", *(f"h = {horizon}" for horizon in result.horizons))
    rows: list[Sequence[object]] = [
        (score, *(_cell(cell) for cell in cells.values())) for score, cells in result.states.items()
    ]
    for name, cell in result.trajectories.items():
        rows.append((name, _cell(cell), *[""] * (len(result.horizons) - 1)))
    said = (
        "AUC/AP, with the 95 % interval of AUC. States: captured in their own frame and the "
        f"next h; success: of whole trajectories, by their last {result.last} frames."
    )
    if result.missing:
        said += f" {result.missing} states have no score yet and are left out."
    return grid(f"Evaluation of {result.task}", head, rows, said)


def _cell(cell: Any) -> str:
    return "one label only" if cell is None else f"{cell.value()}\n{cell.intervals()[0]}"


def labelled_scores(labelled: LabelledScores) -> str:
    """Of each metric how many there are, and their range."""
    states = len(labelled.trajectory)
    head = ("metric", "scores", "missing", "infinite", "least", "median", "largest")
    rows = [(_named(name), *_summary(values)) for name, values in labelled.scores.items()]
    members = labelled.by_trajectory() if states else []
    good = sum(bool(labelled.success[own[-1]]) for own in members)
    said = (
        f"Captured: {int(labelled.captured.sum())} of {states} states; "
        f"successful: {good} of {len(members)} trajectories."
    )
    return grid(f"Labelled scores of {labelled.task}", head, rows, said)


def _summary(values: Any) -> tuple[object, ...]:
    finite = values[np.isfinite(values)]
    counts = (
        int((~np.isnan(values)).sum()),
        int(np.isnan(values).sum()),
        int(np.isinf(values).sum()),
    )
    if not len(finite):
        return (*counts, "", "", "")
    return (*counts, *(f"{v:.3g}" for v in (finite.min(), np.median(finite), finite.max())))


def trajectory(recorded: Trajectory) -> str:
    """Its frames and labels, and what was drawn for it."""
    captured = recorded.captured
    lost = "" if captured.all() else f", first lost at {recorded.times[captured.argmin()]:.3g} s"
    rows: list[NamedValue] = [
        ("frames", f"{len(recorded)}, {recorded.times[0]:.3g} to {recorded.times[-1]:.3g} s"),
        ("captured", f"{int(captured.sum())} frames{lost}"),
        ("success", _yes(recorded.success)),
    ]
    if recorded.captured_any is not None:
        some = f"{int(recorded.captured_any.sum())} frames"
        rows.append(("captured, at least one object", some))
    if recorded.success_any is not None:
        rows.append(("success, at least one object", _yes(recorded.success_any)))
    rows += [("seed", recorded.seed), ("drawn for it", _parameters(recorded.params))]
    return table("Trajectory", rows)


def dataset(recorded: Dataset) -> str:
    """How many trajectories and states it has, and of what task."""
    successes = recorded.successes
    return table(
        f"Dataset of {recorded.task}",
        [
            ("trajectories", f"{len(successes)}, {int(successes.sum())} succeed"),
            ("states", recorded.size),
            ("parameters", _parameters(recorded.parameters)),
            ("seed", recorded.seed),
        ],
    )


def score_store(store: ScoreStore) -> str:
    """Its runs, a row each."""
    rows = [
        (one.number, one.task, _scored(one), _listed(one.metrics), _asked(one), _settings(one))
        for one in store.runs()
    ]
    head = ("run", "task", "states scored", "scores", "asked about", "settings")
    return grid(f"Scores in {store.path.name}", head, rows, "" if rows else "There are no runs.")


def run(one: Run) -> str:
    """What is scored of it, and with which settings."""
    parameters = "unknown" if one.parameters is None else _parameters(one.parameters)
    return table(
        f"Run {one.number} of {one.store.path.name}",
        [
            ("task", one.task),
            ("parameters", parameters),
            ("states scored", _scored(one)),
            ("scores", _listed(one.metrics)),
            ("asked about", _asked(one)),
            ("settings", _settings(one)),
            ("algorithm", one.algorithm),
            ("time of a state", f"{one.seconds():.3g} s"),
        ],
    )


def _scored(one: Run) -> str:
    scored, states = one.counts()
    return f"{scored} of {states}"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)


def _asked(one: Run) -> str:
    return "the state as it is" if one.future is None else str(one.future)


def _settings(one: Run) -> str:
    return ", ".join(f"{name} = {_short(value)}" for name, value in one.settings.items())


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _parameters(values: Mapping[str, Any]) -> str:
    """Of a task, or of a trajectory; what a task has not is drawn for each trajectory."""
    named = values.items()
    parts = [f"{n} drawn at random" if v is None else f"{n} = {_short(v)}" for n, v in named]
    return ", ".join(parts) or "nothing"


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
