"""Summaries of many scores, of the files that have them, and of what was scored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.base.metrics import ANY, TIMED, unit, value_text
from energymargin.base.summary import MOST_ROWS, Summary
from energymargin.base.table_text import DASH
from energymargin.evaluate.futures import disturbance_in_words


def score_table(scores: em.ScoreTable) -> Summary:
    """The first problems' scores, a row each."""
    columns = [[value_text(m, v) for v in own[:MOST_ROWS]] for m, own in scores.scores.items()]
    rows = list(zip(scores.index[:MOST_ROWS].tolist(), *columns, strict=True))
    notes = [f"{float(np.sum(scores.seconds)):.3g} s of computing."]
    head = ("problem", *map(named, scores.scores))
    return Summary("Scores", rows, head, notes, total=len(scores))


def labelled_scores(labelled: em.evaluation.LabelledScores) -> Summary:
    """By metric, the number of scores and their range."""
    states = len(labelled.trajectory)
    head = ("metric", "scores", "missing", "infinite", "least", "median", "largest")
    rows = [(named(name), *_counts(values)) for name, values in labelled.scores.items()]
    members = labelled.by_trajectory() if states else []
    good = sum(bool(labelled.success[own[-1]]) for own in members)
    note = f"Captured: {int(labelled.captured.sum())} of {states} states; "
    note += f"successful: {good} of {len(members)} trajectories."
    return Summary(f"Labelled scores of {labelled.task}", rows, head, [note])


def _counts(values: Floats) -> tuple[object, ...]:
    missing, infinite = int(np.isnan(values).sum()), int(np.isinf(values).sum())
    counts = (len(values) - missing, missing, infinite)
    finite = values[np.isfinite(values)]
    if not len(finite):
        return (*counts, "", "", "")
    return (*counts, *(f"{v:.3g}" for v in (finite.min(), np.median(finite), finite.max())))


def evaluation(result: em.evaluation.Evaluation) -> Summary:
    """AUC and AP of each score with their intervals, by horizon; two tables if there are several
    objects: of all, and of at least one."""
    head = ("score", *(f"h = {horizon}" for horizon in result.frames))
    rows = {score: list(map(stacked, cells.values())) for score, cells in result.states.items()}
    for score, cell in result.trajectories.items():
        rows[score] = [stacked(cell), *[""] * (len(result.frames) - 1)]
    lines = [(score, *cells) for score, cells in rows.items()]
    of_any = [line for line in lines if line[0].endswith(ANY)]
    if not (of_any or result.several):
        return Summary("", lines, head, lead=result.caption)
    of_all = [line for line in lines if not line[0].endswith(ANY)]
    some = Summary("At least one object: captured, and successful", of_any, head)
    title = "All objects: captured together, and successful together"
    return Summary(title, of_all, head, lead=result.caption, further=some)


def score_store(store: em.store.ScoreStore) -> Summary:
    """Its runs, a row each."""
    head = ("run", "task", "states scored", "scores", "asked about", "settings")
    rows = [(one.number, one.task, *_run_rows(one).values()) for one in store.runs()]
    notes = [] if rows else ["There are no runs."]
    return Summary(f"Scores in {store.path.name}", rows, head, notes)


def _run_rows(one: em.store.Run) -> dict[str, str]:
    scored, states = one.counts()
    return {
        "states scored": f"{scored} of {states}",
        "scores": ", ".join(one.metrics),
        "asked about": "the state as it is" if one.future is None else str(one.future),
        "settings": ", ".join(f"{name} = {short(value)}" for name, value in one.settings.items()),
    }


def run(one: em.store.Run) -> Summary:
    """How many states have scores, and with which settings."""
    times = one.times()
    # What a search above gives too takes no time.
    shares = (f"{metric} {t / sum(times.values()):.0%}" for metric, t in times.items() if t)
    rows = {
        "task": one.task,
        "parameters": "unknown" if one.parameters is None else parameters_text(one.parameters),
        **_run_rows(one),
        "algorithm": one.algorithm,
        "time of a state": ": ".join(filter(None, (f"{one.seconds():.3g} s", ", ".join(shares)))),
    }
    if any(metric in TIMED for metric in one.metrics):
        rows["probabilities"] = disturbance_in_words(one.settings)
    if one.sampling is not None:
        rows["not known for sure"] = f"{one.sampling}; each score is the mean of its particles"
    return Summary(f"Run {one.number} of {one.store.path.name}", list(rows.items()))


def surrogate(one: em.Surrogate) -> Summary:
    """What it learned, and how good it is on trajectories that it did not learn from."""
    good = one.quality
    rows = {
        "score": f"{one.metric} of {one.source['task']}",
        "features": f"{len(one.names) - len(one.given)} of a state",
        "given with a state": ", ".join(one.given) or "nothing",
        "tested on": f"{good.states} states of {good.trajectories} trajectories",
        "AUC": f"{good.auc:.3f}, of the scores themselves {good.auc_of_scores:.3f}",
        "calibration error": f"{good.calibration_error:.3f}",
        "within the interval": f"{good.coverage:.1%}, expected {one.coverage:.1%}",
        "refused": f"{good.refused:.1%}",
    }
    return Summary(f"Surrogate of {one.source['task']}", list(rows.items()))


def trajectory(recorded: em.tasks.Trajectory) -> Summary:
    """Its frames and labels, and what was drawn for it."""
    captured, yes = recorded.captured, {True: "yes", False: "no"}
    lost = "" if captured.all() else f", first lost at {recorded.times[captured.argmin()]:.3g} s"
    rows: dict[str, object] = {
        "frames": f"{len(recorded)}, {recorded.times[0]:.3g} to {recorded.times[-1]:.3g} s",
        "captured": f"{int(captured.sum())} frames{lost}",
        "success": yes[bool(recorded.success)],
    }
    if recorded.captured_any is not None:
        rows["captured, at least one object"] = f"{int(recorded.captured_any.sum())} frames"
    if recorded.success_any is not None:
        rows["success, at least one object"] = yes[bool(recorded.success_any)]
    rows |= {"seed": recorded.seed, "drawn for it": parameters_text(recorded.params)}
    return Summary("Trajectory", list(rows.items()))


def dataset(recorded: em.datasets.Dataset) -> Summary:
    """Its task and parameters, and how many trajectories and states it has."""
    successes = recorded.successes
    rows = [
        ("trajectories", f"{len(successes)}, {int(successes.sum())} succeed"),
        ("states", recorded.size),
        ("parameters", parameters_text(recorded.parameters)),
        ("seed", recorded.seed),
    ]
    return Summary(f"Dataset of {recorded.task}", rows)


def named(metric: str) -> str:
    """A metric with its unit."""
    return f"{metric} [{unit(metric)}]" if unit(metric) else metric


def parameters_text(values: Mapping[str, Any]) -> str:
    """Parameters in words; None is one that is drawn at random for each trajectory."""
    given = values.items()
    parts = (f"{n} drawn at random" if v is None else f"{n} = {short(v)}" for n, v in given)
    return ", ".join(parts) or "nothing"


def short(value: Any) -> str:
    """A setting's value."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def stacked(cell: em.evaluation.Cell | None) -> str:
    """A value, and below it its intervals."""
    return DASH if cell is None else "\n".join((cell.value(), *cell.intervals()))
