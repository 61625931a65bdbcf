"""Makes the page of a run, and puts it where it is wanted, whole or not at all."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from energymargin.evaluation import Among, Evaluation, LabelledScores, evaluate
from energymargin.evaluation.curves import target_name
from energymargin.evaluation.labelled import AMONG
from energymargin.evaluation.wrongness import by_trajectory, wrongness
from energymargin.interrupts import raise_if_interrupted, remembered_interrupts
from energymargin.metrics import TIMED
from energymargin.replacing import replaced
from energymargin.report.about import facts, notices, time_facts, version_facts
from energymargin.report.along import along
from energymargin.report.curves import curves, distributions
from energymargin.report.page import ReportPage, rendered, tables
from energymargin.report.subject import Data, Options, Subject, read_data, read_subject
from energymargin.report.worst import worst

__all__ = ["write"]

SUFFIXES = (".html", ".htm")
READ, DRAWN = 0.05, 0.5  # of all: what is done when the file is read, and when the tables are there
ENOUGH = 10  # trajectories; a bootstrap of fewer gives intervals that are too narrow

Progress = Callable[[str, float], None]


def write(
    scores: str | os.PathLike[str],
    output: str | os.PathLike[str],
    run: int | None = None,
    options: Options | None = None,
    *,
    data: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> list[str]:
    """Writes a report of a file of scores: one HTML file that needs no network. Returns what the
    page lacks, a text each, as it says at its top.

    `run` is its number, None the only one. `options` None is Options(). `data` is the dataset of
    the run, for the times and the pictures; None takes the one beside the scores (push.h5 of
    push-scores.db), and without any the page says what it lacks. `progress(what, share)` hears what
    is being done, and the share that is done of all.

    The same files, by the same names, give the same bytes. The page is there whole, or as it was.
    Raises ValueError if `scores` is no file of scores or has no run, if there are several and none
    is chosen, if `options` are not Options or their horizon is longer than any trajectory, if
    `data` is another dataset, or `output` does not end in .html or is one of these files; OSError
    if a file cannot be read or written.
    """
    chosen = Options() if options is None else options
    if not isinstance(chosen, Options):
        raise ValueError(f"options is {options!r}, expected a report.Options")
    output = Path(output)
    _check_place(output, {"scores": scores, "data": data})
    with remembered_interrupts(), replaced(output) as file:

        def tell(what: str, share: float) -> None:
            raise_if_interrupted()
            if progress is not None:
                progress(what, share)

        subject = read_subject(scores, run)
        with read_data(subject, data) as found:
            page = _page(subject, found, chosen, output, tell)
        file.write_text(rendered(page), encoding="utf-8")
        raise_if_interrupted()
    return [" ".join(filter(None, (n.text, n.command))) for n in page.notices]


def _page(
    subject: Subject, data: Data, options: Options, output: Path, tell: Progress
) -> ReportPage:
    """All that the page says, computed."""
    labelled, last = subject.labelled, options.last
    future = subject.future
    horizon = options.horizon_of(
        int(subject.ahead.max()), None if future is None else future.horizon
    )
    result, of_captured = (
        _evaluated(labelled, options, among, place, tell) for place, among in enumerate(AMONG)
    )
    every = wrongness(subject.labelled, horizon, last)
    wrong = by_trajectory(every, len(subject.members))
    lacking = {metric: int(np.isnan(own).sum()) for metric, own in labelled.scores.items()}
    return ReportPage(
        title=f"Scores of {labelled.task}",
        notices=notices(subject, data, result, output),
        facts=facts(subject, data),
        times=time_facts(subject),
        versions=version_facts(subject),
        result=result,
        draws=options.draws,
        enough=ENOUGH,
        target=target_name(horizon=horizon),
        tables=tables((result, of_captured)),
        along=along(subject, data, wrong, options.trajectories),
        curves=curves(labelled, horizon, last),
        distributions=distributions(every),
        pictures=options.pictures,
        worst=worst(
            *(subject, data, every),
            each=options.pictures,
            progress=lambda share: tell("Pictures", DRAWN + (1 - DRAWN) * share),
        ),
        several=labelled.captured_any is not None,
        timed=any(metric in TIMED for metric in subject.metrics),
        asks=None if future is None else str(future),
        states=len(labelled.captured),
        unscored={metric: count for metric, count in lacking.items() if count},
    )


def _check_place(output: Path, read: Mapping[str, str | os.PathLike[str] | None]) -> None:
    """Said before anything is computed; `read` are the files that the page must not replace."""
    if output.suffix not in SUFFIXES:
        raise ValueError(f"output is {str(output)!r}, expected a name with {' or '.join(SUFFIXES)}")
    if output.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(output))
    if not output.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such folder", str(output.parent))
    for name, path in read.items():
        if path is not None and _same(output, Path(path)):
            raise ValueError(
                f"output is {str(output)!r}, which is the file of {name}, {str(path)!r}: "
                "expected another place for the page"
            )


def _same(one: Path, other: Path) -> bool:
    """Whether both are one file, be it by a link."""
    if one.exists() and other.exists():
        return one.samefile(other)
    return one.resolve() == other.resolve()


def _evaluated(
    labelled: LabelledScores, options: Options, among: Among, place: int, tell: Progress
) -> Evaluation:
    """The tables of some of the states, which is the part number `place` of that work."""

    def progress(done: int, total: int) -> None:
        share = (place + done / total) / len(AMONG)
        tell("AUC and AP", READ + (DRAWN - READ) * share)

    return evaluate(
        labelled,
        draws=options.draws,
        seed=options.seed,
        last=options.last,
        among=among,
        progress=progress,
    )
