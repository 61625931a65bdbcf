"""What was scored, how, and by which versions: the first tables of a report."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator
from importlib.metadata import version

import numpy as np

from energymargin.future_text import disturbance_in_words
from energymargin.metrics import TIMED
from energymargin.report.subject import Data, Subject

__all__ = ["Fact", "facts", "time_facts", "version_facts"]

Fact = tuple[str, str]
"""What it is, and its value."""

PACKAGES = ("numpy", "scikit-learn", "matplotlib", "plotly")


def facts(subject: Subject, data: Data) -> list[Fact]:
    """Which run it is, of which states, with which settings."""
    return list(_facts(subject, data))


def time_facts(subject: Subject) -> list[Fact]:
    """The mean computing time of a state, by metric."""
    found, total = [], 0.0
    for metric, seconds in subject.seconds.items():
        scored = int((~np.isnan(subject.labelled.scores[metric])).sum())
        if scored:
            mean = seconds / scored
            found.append((metric, _duration(mean) if mean else "from a search above"))
            total += mean
    return [*found, ("all of them", _duration(total))] if found else []


def version_facts(subject: Subject) -> list[Fact]:
    """Of the scores, and of what made this page."""
    packages = [f"{name} {version(name)}" for name in PACKAGES]
    page = [f"energymargin {version('energymargin')}", f"Python {platform.python_version()}"]
    return [
        ("Scores", f"algorithm {subject.algorithm} (the version since which they have these bits)"),
        ("This page", ", ".join([*page, *packages])),
    ]


def _facts(subject: Subject, data: Data) -> Iterator[Fact]:
    labelled = subject.labelled
    yield "Task", labelled.task
    if subject.parameters is not None:
        yield "Parameters", ", ".join(map(_parameter, subject.parameters.items())) or "none"
    last = [states[-1] for states in subject.members]
    won = int(labelled.success[last].sum())
    yield "Trajectories", f"{len(last)}, of which {won} are successful"
    captured = int(labelled.captured.sum())
    yield "States", f"{len(labelled.captured)}, of which {captured} lie in their capture set"
    if labelled.captured_any is not None:
        yield "At least one object", f"is captured in {int(labelled.captured_any.sum())} states"
    yield "Scores", ", ".join(subject.metrics)
    if subject.future is not None:
        yield "Asked about", f"the frames to come: {subject.future}"
    if any(metric in TIMED for metric in subject.metrics):
        yield "Probabilities", disturbance_in_words(subject.settings)
    yield "Settings", ", ".join(map(_setting, subject.settings.items()))
    yield "Run", f"{subject.number} of {subject.path.name}"
    if data.path is not None:
        yield "Dataset", data.path.name


def _parameter(named: tuple[str, object]) -> str:
    """Of a task; what it has not, is drawn for each trajectory."""
    name, value = named
    return _setting(named) if value is not None else f"{name} drawn at random"


def _setting(named: tuple[str, object]) -> str:
    name, value = named
    return f"{name} = {json.dumps(value)}"


def _duration(seconds: float) -> str:
    """ "1.03 s", "12.5 ms"; never as a power of ten."""
    value, unit = (seconds, "s") if seconds >= 1 else (1e3 * seconds, "ms")
    return f"{value:.3g} {unit}" if value < 999.5 else f"{value:.0f} {unit}"
