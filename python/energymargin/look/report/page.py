"""A report is a page in one file: of a file of scores, with tables of AUC and AP, or of scores of
grasps, with pictures of the best, the most doubtful, and the worst."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

import energymargin as em
from energymargin.base.aliases import AnyPath
from energymargin.base.checks import check_type, whole_number
from energymargin.base.interrupts import raise_if_interrupted, remembered_interrupts
from energymargin.base.metrics import TIMED
from energymargin.base.replacing import PAGES, replaced, require_suffix
from energymargin.evaluation import curves
from energymargin.look.plots.companions import figure_grasp, plot_grasps
from energymargin.look.report import pictures
from energymargin.look.report.subject import Subject, notices, read_subject, view_command

READ, DRAWN = 0.05, 0.5  # of all: what is done when the file is read, and when the tables are there
PACKAGES = ("energymargin", "numpy", "scikit-learn", "matplotlib")
ENOUGH = 10  # trajectories; a bootstrap of fewer gives intervals that are too narrow

Progress = Callable[[str, float], None]
_LEAST = {"trajectories": 1, "pictures": 0, "last": 1, "draws": 1, "seed": 0}
_AMONG = {"all": "all states", "captured": "states that are captured now"}
SIZE = (10.0, 4.0)  # inch, of the probabilities by rank
MOST_ROWS = 2000  # of the table of all grasps


@dataclass(frozen=True)
class Options:
    """The choices of who writes a report. Raises ValueError on what cannot be."""

    trajectories: int = 30
    """At most so many are shown, half of them those that the scores get most wrong."""
    pictures: int = 2
    """So many states of each score and label have a picture, for which their search is repeated."""
    frames: int | None = None
    """Frames that the label "captured" of curves, histograms and pictures looks ahead; None looks
    as far as the scores do, which is HORIZON for those without one of their own, or as far as the
    longest trajectory goes."""
    last: int = em.evaluation.LAST_FRAMES
    """As of `evaluate`; so are the next two."""
    draws: int = em.evaluation.DRAWS
    seed: int = 0

    def __post_init__(self) -> None:
        """Checks each of them."""
        for name, least in _LEAST.items():
            whole_number(name, getattr(self, name), least)
        if self.frames is not None:
            whole_number("frames", self.frames, 0)

    def frames_of(self, ahead: int, scored: int | None = None) -> int:
        """Frames to look ahead, of scores that look `scored` frames ahead. Raises ValueError on
        more than `ahead`, the most frames that a state has after its own."""
        if self.frames is None:
            return min(em.evaluation.HORIZON if scored is None else scored, ahead)
        if self.frames > ahead:
            text = f"the horizon is {self.frames} frames, expected 0 to {ahead}"
            raise ValueError(f"{text}: the longest trajectory has {ahead + 1} frames")
        return self.frames


def write(
    scores: AnyPath,
    output: AnyPath,
    *,
    run: int | None = None,
    options: Options | None = None,
    data: AnyPath | None = None,
    progress: Progress | None = None,
) -> list[str]:
    """Writes a report of a file of scores: one HTML file that needs no network.

    The same files with the same names give the same bytes. On an error, `output` is as it was.

    Args:
        scores: the file of scores.
        output: the page, a path that ends in .html or .htm.
        run: as of `ScoreStore.run`.
        options: None is Options().
        data: the dataset of the run, for times and pictures. None takes the one beside the scores
            (push.h5 of push-scores.db); without a dataset the page notes what is missing.
        progress: progress(what, share) is called with what is done now, and the share that is done.

    Returns:
        What the page lacks, a text each, as at its top.

    Raises:
        ValueError: if `scores` is no file of scores or has no run, or several and none is chosen;
            if `options` are not Options, or their `frames` are more than any trajectory; if `data`
            is another dataset; if `output` has another suffix or is one of these files.
        OSError: if a file cannot be read or written.
    """
    chosen = Options() if options is None else options
    check_type("options", chosen, Options, "a report.Options")
    output = Path(output)
    require_suffix("output", output, PAGES)
    for name, path in {"scores": scores, "data": data}.items():
        if path is not None and output.resolve() == Path(path).resolve():
            text = f"output is {str(output)!r}, which is the file of {name}, {str(path)!r}"
            raise ValueError(f"{text}: expected another place for the page")
    with remembered_interrupts(), replaced(output) as file:

        def tell(what: str, share: float) -> None:
            raise_if_interrupted()
            if progress is not None:
                progress(what, share)

        with read_subject(scores, run, data) as subject:
            page = _page(subject, chosen, output, tell)
        file.write_text(rendered("page.html", page), encoding="utf-8")
        raise_if_interrupted()
    return [" ".join(filter(None, notice)) for notice in page["notices"]]


def _page(subject: Subject, options: Options, output: Path, tell: Progress) -> dict[str, Any]:
    """Computes what the template shows, by its names there."""
    labelled, future = subject.labelled, subject.run.future
    frames = options.frames_of(int(subject.ahead.max()), None if future is None else future.frames)
    asked: dict[str, Any] = {"last": options.last, "draws": options.draws, "seed": options.seed}
    results: list[em.evaluation.Evaluation] = []
    for scores, among, horizons in em.evaluation.tables_of(labelled, subject.now):

        def counted(done: int, total: int, before: int = len(results)) -> None:
            tell("AUC and AP", READ + (DRAWN - READ) / 2 * (before + done / total))

        asked |= {"among": among, "frames": horizons, "progress": counted}
        results.append(em.evaluation.evaluate(scores, **asked))
    every = curves.wrongness(labelled, frames, options.last)
    wrong = curves.by_trajectory(every, len(subject.members))
    mistakes, lacking = pictures.worst(
        *(subject, every),
        each=options.pictures,
        progress=lambda share: tell("Pictures", DRAWN + (1 - DRAWN) * share),
    )
    return {
        "title": f"Scores of {labelled.task}",
        "subject": subject,
        "options": options,
        "notices": notices(subject, output),
        "labels": em.summary.summary(labelled).notes[0],
        "algorithm": subject.run.algorithm,
        "enough": ENOUGH,
        "target": curves.target_name(frames=frames),
        "tables": list(tables(results)),
        "along": pictures.along(subject, wrong, options.trajectories),
        "endless": any(np.isposinf(values).any() for values in labelled.scores.values()),
        "view": view_command(subject),
        "curves": pictures.both_curves(labelled, frames, options.last),
        "distributions": pictures.distributions(every),
        "mistakes": mistakes,
        "lacking": lacking,
        "timed": any(metric in TIMED for metric in subject.metrics),
    }


def tables(results: Iterable[em.evaluation.Evaluation]) -> Iterator[em.summary.Summary]:
    """A table of each result, or two if there are several objects: of all, and of at least one."""
    for result in results:
        table: em.summary.Summary | None = em.summary.summary(result)
        while table is not None:
            title = f"{table.title or 'AUC/AP of each score'}; {_AMONG[result.among]}"
            yield replace(table, title=title, lead=result.counted)
            table = table.further


def rendered(name: str, page: Mapping[str, Any]) -> str:
    """A page as HTML, by a template of this package that fills base.html. Whatever comes from files
    is escaped by it."""
    loader, strict = PackageLoader("energymargin.look", "report"), {"undefined": StrictUndefined}
    blocks: dict[str, Any] = {"trim_blocks": True, "lstrip_blocks": True, **strict}
    environment = Environment(loader=loader, autoescape=True, **blocks)
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return environment.get_template(name).render(page, versions=versions)


def write_grasps(
    scores: em.grasps.GraspScores,
    output: AnyPath,
    *,
    title: str = "Grasps",
    progress: Progress | None = None,
) -> None:
    """Writes a report of scores of grasps: one HTML file that needs no network.

    Args:
        scores: of `em.grasps.score`.
        output: the page, a path that ends in .html or .htm; what is there is replaced.
        title: of the page.
        progress: progress(what, share) is called with what is done now, and the share that is done.

    Raises ValueError on other scores and another suffix, and OSError if it cannot be written.
    """
    output = Path(output)
    require_suffix("output", output, PAGES)
    table, found = scores.table(), em.summary.summary(scores)
    with remembered_interrupts(), replaced(output) as file:
        figure = Figure(figsize=SIZE, layout="constrained")
        plot_grasps(scores, figure.subplots())
        page = {
            "title": title,
            "lead": found.lead.partition(";")[0],
            "notes": found.notes,
            "about": em.summary.summary(scores.trials),
            "ranking": pictures.svg(figure),
            "cards": list(_cards(scores, progress)),
            "head": list(table),
            "rows": list(zip(*table.values(), strict=True))[:MOST_ROWS],
            "more": len(scores.grasps) - MOST_ROWS,
            "algorithm": em.searches.algorithm(),
        }
        file.write_text(rendered("grasps.html", page), encoding="utf-8")


def _cards(scores: em.grasps.GraspScores, progress: Progress | None) -> Iterator[pictures.Card]:
    if not len(scores.ranked):
        return
    chosen = {scores.best: "", scores.doubtful: "The most doubtful", scores.worst: "The worst"}
    chosen[scores.best] = "The best"
    for place, (k, which) in enumerate(chosen.items()):
        if progress is not None:
            progress("Pictures", place / len(chosen))
        title, image = f"{which}: {scores.grasps.names[k]}", pictures.png(figure_grasp(scores, k))
        yield pictures.Card(title, _text(scores, k), [image])


def _text(scores: em.grasps.GraspScores, k: int) -> str:
    """The figures of a grasp, in a sentence."""
    low, high = scores.interval()[k]
    label, effort = scores.grasps.labels[k], scores.efforts[k]
    ways = ", ".join(f"{count} {ending}" for ending, count in scores.losses(k).items())
    text = f"Holds in {scores.probabilities[k]:.2f} of its trials "
    text += f"({low:.2f} to {high:.2f} with 95 % confidence): {ways}."
    text += "" if np.isnan(effort) else f" Effort of escape {effort:.2g} J."
    return text + ("" if np.isnan(label) else f" Label {label:g}.")
