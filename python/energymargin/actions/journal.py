"""Batches of trials, each kept in a file once it is done, so that the same search goes on."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from energymargin.actions.trials import Draws, Question, Trial, Trials
from energymargin.limits import Limit
from energymargin.replacing import replace_text

__all__ = ["Journal"]


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
        key = _key(question, trials)
        if key in self._known:
            draws = [Draws(np.array(v), np.array(t), steps) for v, t, steps in self._known[key]]
            for one in draws:
                self._on_draws(one)
            return list(draws)
        found = self._trials.run(question, trials, limit)
        if self._path is not None and None not in found:
            plain = [[d.values.tolist(), d.times.tolist(), d.steps] for d in found if d is not None]
            with self._path.open("a") as file:
                file.write(json.dumps([key, plain]) + "\n")
        return found


def _key(question: Question, trials: Sequence[Trial]) -> str:
    """Of a batch: each stage of a search has a seed of its own, and so has each generation."""
    draws = {(trial.first, trial.count) for trial in trials}
    return f"{question.seed}: {len(trials)} candidates, draws {sorted(draws)}"


def _lines(path: Path, what: dict[str, Any]) -> list[tuple[str, list[Any]]]:
    """The batches of a file by their keys; it is made if there is none."""
    head = json.dumps(what, sort_keys=True)
    if not path.exists():
        replace_text(path, head + "\n")
        return []
    lines = path.read_text().splitlines(keepends=True)
    whole = [line for line in lines if line.endswith("\n")]
    try:
        known, *batches = [json.loads(line) for line in whole]
        names = {*known, *what}
    except (TypeError, ValueError):
        raise ValueError(f"file is {path}, which is no file of a search: name another") from None
    asked = json.loads(head)
    different = sorted(name for name in names if known.get(name) != asked.get(name))
    if different:
        raise ValueError(
            f"file is {path}, of a search with another {different[0]}: name another file, or "
            "remove it"
        )
    if whole != lines:
        replace_text(path, "".join(whole))
    return [(key, draws) for key, draws in batches]
