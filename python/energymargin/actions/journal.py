"""Batches of trials, each kept in a file once it is done, so that the same search goes on.

A batch is known by what it asked: its question, its draws and the problems of its candidates. So a
search that has become another one by a changed constraint or plan runs its own batches.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Problem, regions
from energymargin.actions.trials import Draws, Question, Trial, Trials
from energymargin.arguments import shown
from energymargin.limits import Limit
from energymargin.replacing import replace_text

__all__ = ["Journal", "digest_of", "said_of"]

FAR = 1e9  # m


class Journal:
    """Trials that are run once; the batches of an earlier search of the same kind are read.

    A line is a batch. The first line says what the search is; a line that a kill left unfinished is
    cut.
    """

    def __init__(
        self,
        trials: Trials,
        path: Path | None,
        what: dict[str, Any],
        on_draws: Callable[[Draws], None],
    ) -> None:
        """`what`: all that the batches depend on. `on_draws`: called with draws that are read.

        Raises ValueError on a file of another search.
        """
        self._trials, self._path, self._on_draws = trials, path, on_draws
        self._known: dict[str, list[Any]] = {} if path is None else dict(_lines(path, what))

    def run(self, question: Question, trials: Sequence[Trial], limit: Limit) -> list[Draws | None]:
        """As Trials.run."""
        if self._path is None:
            return self._trials.run(question, trials, limit)
        key = _key(question, trials)
        if key in self._known:
            draws = [_drawn(*columns) for columns in self._known[key]]
            for one in draws:
                self._on_draws(one)
            return list(draws)
        found = self._trials.run(question, trials, limit)
        if None not in found:
            plain = [[d.values.tolist(), d.times.tolist(), d.steps] for d in found if d is not None]
            with self._path.open("a") as file:
                file.write(json.dumps([key, plain]) + "\n")
        return found


def digest_of(problem: Problem) -> str:
    """Of all that a problem says, but for the sets if one is a Python predicate, which has no
    text."""
    try:
        text = problem.to_json()
    except ValueError:
        objects = (body.name for body in problem.scene.bodies if body.role == "object")
        anywhere = regions.HalfSpace(next(objects), (0.0, 0.0, 1.0), FAR)
        text = problem.replace(captured=anywhere, succeeded=None).to_json()
    return hashlib.sha256(text.encode()).hexdigest()


def _key(question: Question, trials: Sequence[Trial]) -> str:
    """Of a batch; the particles of a candidate follow from the first one, their numbers and the
    search's seed."""
    asked = [
        (trial.first, trial.count, trial.particles, digest_of(trial.problems[0]))
        for trial in trials
    ]
    text = repr((question.metric, question.seed, said_of(question.disturbance), asked))
    return hashlib.sha256(text.encode()).hexdigest()


def said_of(disturbance: Any) -> str:
    """A disturbance in words that are the same in another process."""
    name = getattr(disturbance, "__qualname__", None)
    return repr(disturbance) if name is None else f"{disturbance.__module__}.{name}"


def _drawn(values: list[float], times: list[float], steps: int) -> Draws:
    return Draws(np.array(values), np.array(times), steps)


def _lines(path: Path, what: dict[str, Any]) -> list[tuple[str, list[Any]]]:
    """The batches of a file by their keys; it is made if there is none."""
    head = json.dumps(what, sort_keys=True)
    if path.is_dir():
        raise ValueError(f"file is {path}, which is a folder, expected the name of a file")
    if not path.exists():
        replace_text(path, head + "\n")
        return []
    try:
        lines = path.read_text().splitlines(keepends=True)
        whole = [line for line in lines if line.endswith("\n")]
        known, *batches = [json.loads(line) for line in whole]
        names = {*known.keys(), *what}
        found = [(str(key), draws) for key, draws in batches]
    except (AttributeError, TypeError, ValueError):
        raise ValueError(f"file is {path}, which is no file of a search: name another") from None
    asked = json.loads(head)
    different = [name for name in sorted(names) if known.get(name) != asked.get(name)]
    if different:
        name = different[0]
        raise ValueError(
            f"file is {path}, of a search whose {name} is {shown(known.get(name))}, here "
            f"{shown(asked.get(name))}: name another file, or remove it"
        )
    if whole != lines:
        replace_text(path, "".join(whole))
    return found
