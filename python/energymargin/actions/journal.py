"""Batches of trials, each kept in a file once it is done, so that the same search goes on.

A batch is known by what it asked: its question, its draws and the problems of its candidates. So a
search that has become another one by a changed constraint or plan runs its own batches. A function
looks like any other in a file, so none is kept there: not as disturbance, not as set.
"""

from __future__ import annotations

import copyreg
import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Problem
from energymargin.actions.trials import Draws, Question, Trial, Trials
from energymargin.arguments import shown
from energymargin.limits import Limit
from energymargin.replacing import replace_text

__all__ = ["Journal", "digest_of", "text_of"]

DIGITS = 16  # of a checksum


class Journal:
    """Trials that are run once; the batches of an earlier search of the same kind are read.

    A line is a batch. The first line says what the search is; a line that a kill left unfinished is
    cut. Each line begins with a checksum of the rest.
    """

    def __init__(
        self,
        trials: Trials,
        path: Path | None,
        what: dict[str, Any],
        on_draws: Callable[[Draws], None],
    ) -> None:
        """`what`: all that the batches depend on. `on_draws`: called with draws that are read.

        Raises ValueError on a file of another search, and on a line that has changed.
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
                file.write(_line([key, plain]))
        return found


def digest_of(problem: Problem) -> str:
    """SHA-256 of all that a problem says. Raises ValueError on a set that has no text."""
    try:
        text = problem.to_json()
    except ValueError as error:
        raise ValueError(
            f"file keeps batches by the text of their problems: {error}, or leave file out"
        ) from error
    return hashlib.sha256(text.encode()).hexdigest()


def text_of(disturbance: Any) -> str:
    """A model as JSON text, the same for equal ones alone, to the last bit; "null" for None.

    Raises ValueError on a function: two of one name may do different things.
    """
    if disturbance is None:
        return json.dumps(None)
    reduce: Any = copyreg.dispatch_table.get(type(disturbance))
    if reduce is None:
        raise ValueError(
            f"disturbance is {shown(disturbance)}, which a file cannot tell from another function: "
            "use a model of em.disturbances, or leave file out"
        )
    make, arguments = reduce(disturbance)
    return json.dumps([make.__name__, *arguments], default=lambda array: np.asarray(array).tolist())


def _key(question: Question, trials: Sequence[Trial]) -> str:
    """SHA-256 of a batch; the particles of a candidate follow from the first one, their numbers
    and the search's seed."""
    asked = [
        (trial.first, trial.count, trial.particles, digest_of(trial.problems[0]))
        for trial in trials
    ]
    text = repr((question.metric, question.seed, text_of(question.disturbance), asked))
    return hashlib.sha256(text.encode()).hexdigest()


def _drawn(values: list[float], times: list[float], steps: int) -> Draws:
    return Draws(np.array(values), np.array(times), steps)


def _lines(path: Path, what: dict[str, Any]) -> list[tuple[str, list[Any]]]:
    """The batches of a file by their keys; it is made if there is none."""
    if path.is_dir():
        raise ValueError(f"file is {path}, which is a folder, expected the name of a file")
    if not path.exists():
        replace_text(path, _line(what))
        return []
    try:
        head, *batches, unfinished = path.read_bytes().split(b"\n")
        known = dict(_content(head))
    except (TypeError, ValueError):
        raise ValueError(f"file is {path}, which is no file of a search: name another") from None
    _require_same_search(path, known, json.loads(json.dumps(what)))
    found = [_batch(path, number, line) for number, line in enumerate(batches, start=2)]
    if unfinished:
        replace_text(path, b"\n".join([head, *batches, b""]).decode())
    return found


def _require_same_search(path: Path, known: dict[str, Any], asked: dict[str, Any]) -> None:
    names = sorted({*known.keys(), *asked})
    different = [name for name in names if known.get(name) != asked.get(name)]
    if different:
        name = different[0]
        raise ValueError(
            f"file is {path}, of a search whose {name} is {shown(known.get(name))}, here "
            f"{shown(asked.get(name))}: name another file, or remove it"
        )


def _batch(path: Path, number: int, line: bytes) -> tuple[str, list[Any]]:
    """The key and the draws of a line."""
    try:
        key, draws = _content(line)
    except (TypeError, ValueError):
        raise ValueError(
            f"file is {path}, whose line {number} is not as it was written: take the line out, and "
            "its trials run again"
        ) from None
    return key, draws


def _line(content: Any) -> str:
    """What is written of a content: with a checksum."""
    text = json.dumps(content, sort_keys=True)
    return f'["{hashlib.sha256(text.encode()).hexdigest()[:DIGITS]}", {text}]\n'


def _content(line: bytes) -> Any:
    """What a line was written of; TypeError or ValueError if it has changed since."""
    _, content = json.loads(line)
    if _line(content).encode() != line + b"\n":
        raise ValueError("the checksum is another")
    return content
