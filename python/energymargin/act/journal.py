"""A file of evaluations, by the digests of their questions: what was run once is read.

A line is a checksum and an evaluation: its digest, and what came of its draws. The digest is of all
that the draws depend on. So any search may go on with the file, and one that has become another by
a changed plan, constraint or seed runs its own. A function looks like any other in a file, so none
is kept there: not as disturbance, not as set.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Problem
from energymargin.act.trials import Draws, Gathered, Question, Trial, Trials
from energymargin.base.checks import check_type, shown
from energymargin.base.limits import Limit
from energymargin.base.locks import Lock
from energymargin.base.replacing import replace_text
from energymargin.disturbances import Disturbance, text_of
from energymargin.evaluate.executors import Executor

DIGITS = 16  # of a checksum
CHECKSUM = b"0123456789abcdef"


class Journal(Trials):
    """Trials that are run once."""

    def __init__(
        self,
        file: str | Path,
        common: Sequence[object],
        executor: Executor | None,
        threads: int | None,
        on_draws: Callable[[Draws], None],
    ) -> None:
        """`common`: all that the draws depend on beside question and trial. `on_draws`: called with
        draws that are read too.

        Raises ValueError on another file, on a line that has changed, and with the number of
        another process that has it.
        """
        check_type("file", file, str | Path, "the name of a file, or None")
        self._path, self._common = Path(file), common
        self._digests: dict[int, str] = {}  # of the candidates that are run
        self._lock = Lock(self._path, "writing evaluations into")
        try:
            self._known = _evaluations(self._path)
            super().__init__(executor, threads, on_draws)
        except BaseException:
            self._lock.close()
            raise

    def close(self) -> None:
        """As Trials.close; another process may have the file then."""
        try:
            super().close()
        finally:
            self._lock.close()

    def run(self, question: Question, trials: Sequence[Trial], limit: Limit) -> list[Draws | None]:
        """As Trials.run."""
        self._digests = {trial.candidate: self._digest(question, trial) for trial in trials}
        known = [digest for digest in self._digests.values() if digest in self._known]
        for digest in known:
            self._on_draws(self._known[digest])
        new = [trial for trial in trials if self._digests[trial.candidate] not in known]
        super().run(question, new, limit)
        return [self._known.get(digest) for digest in self._digests.values()]

    def _keep(self, done: Gathered) -> None:
        """Writes it at once. Raises OSError with the file's name, as of a full disk."""
        draws, digest = done.whole, self._digests[done.trial.candidate]
        assert draws is not None
        columns = [draws.values.tolist(), draws.times.tolist(), draws.steps]
        try:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(_line([digest, *columns]))
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self._path)) from error
        self._known[digest] = draws

    def _digest(self, question: Question, trial: Trial) -> str:
        """The particles of a candidate follow from the first one, their numbers and `common`."""
        first = trial[0]
        disturbance = _disturbance_text(question.disturbance)
        asked = (question.metric, question.seed, question.nodes, disturbance)
        own = [] if trial.particles is None else [trial.particles[k] for k in trial.numbers]
        particles = tuple(one.number for one in own)
        draws = (first.number, len(trial), particles, _problem_text(first.problem))
        return hashlib.sha256(repr((*self._common, *asked, *draws)).encode()).hexdigest()


def _disturbance_text(disturbance: Any) -> str | None:
    if disturbance is None:
        return None
    if not isinstance(disturbance, Disturbance):
        raise ValueError(
            f"disturbance is {shown(disturbance)}, which a file cannot tell from another function: "
            "use a model of em.disturbances, or leave file out"
        )
    return text_of(disturbance)


def _problem_text(problem: Problem) -> str:
    try:
        return problem.to_json()
    except ValueError as error:
        raise ValueError(
            f"file keeps evaluations by the text of their problems: {error}, or leave file out"
        ) from error


def _evaluations(path: Path) -> dict[str, Draws]:
    """Those of a file by their digests; a line that a kill left unfinished is cut."""
    if path.is_dir():
        raise ValueError(f"file is {path}, which is a folder, expected the name of a file")
    if not path.exists():
        return {}
    *lines, unfinished = path.read_bytes().split(b"\n")
    known = dict(_evaluation(path, number, line) for number, line in enumerate(lines, start=1))
    if unfinished:
        if unfinished[:DIGITS].strip(CHECKSUM):  # a line of something else
            _evaluation(path, len(lines) + 1, unfinished)
        replace_text(path, b"\n".join([*lines, b""]).decode())
    return known


def _evaluation(path: Path, number: int, line: bytes) -> tuple[str, Draws]:
    try:
        digest, values, times, steps = content = json.loads(line.partition(b" ")[2])
        same = _line(content).encode() == line + b"\n"
    except (TypeError, ValueError):
        same = False
    if not same:
        raise ValueError(
            f"file is {path}, whose line {number} is no evaluation as it was written: name another "
            "file, or take the line out, and it runs again"
        )
    return digest, Draws(np.array(values), np.array(times), steps)


def _line(evaluation: list[Any]) -> str:
    text = json.dumps(evaluation)
    return f"{hashlib.sha256(text.encode()).hexdigest()[:DIGITS]} {text}\n"
