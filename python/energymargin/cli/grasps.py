"""The command `energymargin grasps`: which grasps of a file hold, and how sure is that?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from rich.markup import escape

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.base.bars import bar
from energymargin.base.interrupts import on_interrupt
from energymargin.base.plausibility import kept_warnings
from energymargin.base.replacing import replace_text
from energymargin.base.table_text import markdown_table
from energymargin.cli import grasp_words as words, terminal
from energymargin.cli.options import Outputs, Where, given, panel
from energymargin.cli.terminal import TIMED_OUT, loading, out, say, share_bar, warn

COARSE = 0.002  # m; parts that are farther from the mesh are felt by fingers
SUFFIXES = (terminal.STORE, *terminal.TEXTS, terminal.PAGE, *terminal.PICTURES)


def grasps(
    file: Path,
    /,
    *,
    hand: str,
    protocol: str = "hold",
    belief: str | None = None,
    strength: Annotated[float, Parameter(group=words.TRIAL.group)] = 1.0,
    baselines: Annotated[bool, panel("More figures")] = False,
    output: Outputs = None,
    write: Path | None = None,
    view: Path | None = None,
    overwrite: bool = False,
    rows: words.Rows = words.Rows(),
    thing: words.Thing = words.Thing(),
    trial: words.TrialOptions = words.TrialOptions(),
    runs: Where = Where(),
) -> None:
    """Rank the grasps of a file: which of them hold on this hand, and how sure is that?

    Each grasp is tried `--rollouts` times: the hand closes, goes through a protocol, and random
    forces push the object. All grasps meet the same draws. The table has 95 % intervals.

    Example: `energymargin grasps mug.h5 --hand panda --object mug.obj --mass 0.2`

    Poses that are off by 7 mm and 3 degrees, a shake, a page with pictures: `energymargin grasps
    mug.h5 --hand panda --protocol shake --belief '{"pose": [0.007, 0.007, 0.007, 0.05, 0.05,
    0.05]}' -o mug.html`

    A night of 10,000 grasps, which goes on where it was stopped: `energymargin grasps FILE ... -o
    scores.db`

    Args:
        file: Grasps of ACRONYM (.h5), GraspGen (.json), isaac_grasp (.yaml), or a table of poses
            (.csv).
        hand: panda, robotiq_2f85, robotiq_2f140, wsg_50, or numbers, as JSON or a file: '{"preset":
            "panda", "force": 20}', '{"opening": 0.1, "pad": [0.02, 0.03]}'.
        protocol: What is done once the hand has closed: hold, lift, shake, graspa, acronym, or JSON
            or a file of it: '{"preset": "lift", "radius": 0.03}'.
        belief: What is not known exactly: lab, what a laboratory knows that has measured nothing,
            or JSON or a file of it: pose (3 errors in m, 3 in rad), friction, mass, force.
        strength: Of the random forces, 1: up to half the object's weight along each axis; 0: none.
        baselines: Also what is commonly computed in place of a simulation, as Ferrari-Canny
            epsilon: columns of .csv and --write, and their AUC where there are labels.
        output: .db keeps the scores, and the same command goes on from there; .csv and .md are
            tables, .html is a page with pictures, .png, .pdf and .svg are pictures. May be
            repeated.
        write: The grasps with their scores, for other tools: .h5 (ACRONYM), .json (GraspGen), .yaml
            (isaac_grasp), .csv.
        view: A page (.html) on which the grasps turn and play, the best first.
        overwrite: Replace files that exist; a .db of scores never is.
    """
    outputs = output or []
    if view is not None:
        terminal.require_free(view, overwrite=overwrite, option="--view", suffixes=[terminal.PAGE])
    store = _store(outputs)
    executor = runs.executor()
    with loading():
        import energymargin.grasps

        terminal.require_outputs(outputs, overwrite=overwrite, suffixes=SUFFIXES)
        if view is not None:
            import energymargin.viewer  # noqa: F401
    if write is not None:
        formats = em.grasps.SUFFIXES
        terminal.require_free(write, overwrite=overwrite, option="--write", suffixes=formats)
    disturbance, known = em.disturbances.Uniform(strength), words.chosen_belief(belief)
    tried = words.chosen_hand(hand), words.chosen_protocol(protocol)
    found = rows.read(file)
    with words.arguments_as_options(words.OF_OBJECT):
        object = em.grasps.GraspObject.of(found.object, **given(thing))
    _say_read(file, found, object)
    with (
        _cancelled_by_interrupt() as cancel,
        words.arguments_as_options(words.OF_OBJECT),
        kept_warnings(),
        bar("Scoring", "grasps") as progress,
    ):
        scores = em.grasps.score(
            *(found, tried[0], object, tried[1]),
            belief=known,
            disturbance=disturbance,
            store=store,
            executor=executor,
            progress=progress,
            timeout=runs.timeout,
            cancel=cancel,
            **given(trial),
        )
    out.print(em.summary.summary(scores))
    columns = _baselines(scores) if baselines else {}
    _write(scores, columns, file, [path for path in outputs if path != store], write)
    if not scores.complete:
        _say_stopped(scores, store)
        if cancel.is_set:
            raise KeyboardInterrupt
        raise SystemExit(TIMED_OUT)
    if view is not None:
        _view(scores, view)


def _store(outputs: Sequence[Path]) -> Path | None:
    """The file of scores among the outputs. Raises ValueError on two."""
    stores = [path for path in outputs if path.suffix == terminal.STORE]
    if len(stores) > 1:
        raise ValueError(f"-o has {stores[0]} and {stores[1]}, expected one file of scores")
    return stores[0] if stores else None


def _say_read(file: Path, grasps: em.grasps.GraspSet, object: em.grasps.GraspObject) -> None:
    labels = grasps.labels[~np.isnan(grasps.labels)]
    held = f", {np.mean(labels >= 0.5):.0%} of them recorded as held" if len(labels) else ""
    say(f"{escape(str(file))}: {len(grasps)} grasps{held}; object: {object}")
    deviation = getattr(object.shape, "deviation", None)
    if deviation is not None and deviation.distance > COARSE:
        say(f"With --accuracy {COARSE:g} its parts are closer to the mesh.")


@contextmanager
def _cancelled_by_interrupt() -> Iterator[em.Cancel]:
    """Ctrl-C sets the Cancel, so that what is finished is shown; before that it stops at once."""
    cancel = em.Cancel()
    try:
        with on_interrupt(cancel.set):
            yield cancel
    except em.Cancelled:
        raise KeyboardInterrupt from None


def _baselines(scores: em.grasps.GraspScores) -> dict[str, Floats]:
    """The columns of the baselines; their table is printed where labels say who is right."""
    with bar("Baselines", "grasps") as progress:
        columns = em.grasps.baselines(scores, progress=progress)
    known = scores.grasps.labels[~np.isnan(scores.grasps.labels) & (scores.counted > 0)] >= 0.5
    if known.any() and not known.all():
        out.print()
        found = em.grasps.compare({"the object": scores}, columns={"the object": columns})
        out.print(em.summary.summary(found))
    return columns


def _write(
    scores: em.grasps.GraspScores,
    columns: dict[str, Floats],
    file: Path,
    outputs: Sequence[Path],
    grasps: Path | None,
) -> None:
    """Writes tables, pictures, the page, and the file of grasps."""
    for path in outputs:
        if path.suffix in terminal.TEXTS:
            csv = path.suffix == ".csv"
            replace_text(path, scores.to_csv(columns) if csv else _markdown(scores))
        elif path.suffix == terminal.PAGE:
            title = f"Grasps of {file.name}"
            with share_bar() as progress:
                em.report.write_grasps(scores, path, title=title, progress=progress)
        else:
            terminal.write_plot(path, em.plots.plot_grasps(scores))
    if grasps is not None and not (scores.counted > 0).any():
        warn(f"{grasps} is not written: no grasp has a score")
    elif grasps is not None:
        _write_grasps(scores, columns, grasps)
        outputs = [*outputs, grasps]
    terminal.say_written(outputs)


def _write_grasps(scores: em.grasps.GraspScores, more: dict[str, Floats], path: Path) -> None:
    """The grasps that have scores, with them."""
    scored = scores.counted > 0
    low, high = scores.interval()[scored].T
    columns = {"probability": scores.probabilities[scored], "low": low, "high": high}
    columns["mean_time"] = scores.mean_time[scored]
    for name, column in {"effort": scores.efforts, **more}.items():
        if np.isfinite(column[scored]).all():
            columns[name] = column[scored]
    if not scored.all():
        warn(f"{path} lacks {(~scored).sum()} grasps that have no score")
    em.grasps.write(path, scores.grasps[scored], columns, overwrite=True)


def _say_stopped(scores: em.grasps.GraspScores, store: Path | None) -> None:
    done = f"{(scores.counted > 0).sum()} of {len(scores.grasps)} grasps are scored"
    none = ", and kept in no file: with -o scores.db the same command can go on"
    kept = f" and kept in {store}; the same command goes on from there."
    say(escape(done + (none if store is None else kept)))


def _view(scores: em.grasps.GraspScores, path: Path) -> None:
    """Writes the page on which the grasps turn and play."""
    with kept_warnings(), share_bar() as tell:
        em.viewer.view(scores, scoring=lambda share: tell("The page", share)).save(path)
    terminal.say_written([path])


def _markdown(scores: em.grasps.GraspScores) -> str:
    """The table of all grasps, and what was asked."""
    table = scores.table()
    ranked = markdown_table(list(table), zip(*table.values(), strict=True))
    return "\n".join((em.summary.summary(scores.trials).to_markdown(), ranked, ""))
