"""Pages of problems, datasets, tasks and grasps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from html import escape
from typing import Any

import numpy as np

import energymargin as em
from energymargin.base.aliases import AnyPath
from energymargin.base.checks import whole_number
from energymargin.base.plausibility import kept_warnings
from energymargin.datasets import Future
from energymargin.look.viewer import sources, texts
from energymargin.look.viewer.page import Page
from energymargin.look.viewer.shots import Blobs, Shot
from energymargin.look.viewer.sources import Scored, ShareProgress, score_state

MOST_GRASPS = 24  # grasps on a page


def view(
    what: sources.Viewable | em.grasps.GraspScores,
    *,
    parameters: Mapping[str, Any] | None = None,
    trajectory: int | None = None,
    frame: int | None = None,
    every: int | None = None,
    nodes: int | None = None,
    seed: int | None = None,
    future: Future | None = None,
    scores: AnyPath | None = None,
    run: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    scoring: ShareProgress | None = None,
) -> Page:
    """A page that shows a state with its scores, its search tree, its sets and its escape: it
    turns and plays, in one file.

    Args:
        what: a problem, a dataset, a path to the file of one, the name of a task, of which
            trajectories are generated, a MarginProfile, whose moments are the frames, or scores of
            grasps: then the page shows the ranked grasps, and takes no other argument.
        parameters: of the task.
        trajectory: the one that is shown, from 0. None takes the first one that ends outside of its
            capture set, or else the first.
        frame: of that trajectory, from 0. None takes one a quarter of all frames before its last
            loss, the middle one without a loss, or the weakest moment of a MarginProfile.
        every: also every so many frames of the trajectory, from its first on. Each is scored.
        nodes: nodes of each search tree. None takes those of `scores` or of a MarginProfile, or
            else 1000.
        seed: of searches and of a task's trajectories. None takes that of `scores`
            or of a MarginProfile, or else 0.
        future: the horizon and plan of the states of a dataset or a task:
            `em.datasets.Future(5, "hold")` asks whether they stay captured over the next five
            frames while the robot goes on as it moves. None takes that of `scores`, or else asks
            about each state as it is.
        scores: a file of scores of the dataset, to compare with.
        run: which of its runs, if there are several.
        progress: progress(done, total) counts the trajectories of a task that are generated.
        scoring: scoring(share) is called with the share of the scoring that is done.

    Returns:
        The page: `save` writes it, and a notebook shows it.

    Raises:
        ValueError: on bad input.
        OSError: on files that cannot be read.
    """
    if isinstance(what, em.grasps.GraspScores):
        return page_of_grasps(what, scoring)
    if run is not None and scores is None:
        raise ValueError(f"run is {run}, but there are no scores that it is of")
    for name, number in {"trajectory": trajectory, "frame": frame}.items():
        if number is not None:
            whole_number(name, number, 0)
    if every is not None:
        whole_number("every", every, 1)
    given = {name: n for name, n in {"nodes": nodes, "seed": seed}.items() if n is not None}
    source = sources.source_of(what, parameters, seed=seed or 0, progress=progress)
    try:
        stored = None if scores is None else _stored(source, scores, run)
        if stored is not None and stored.dataset is not None:
            source = replace(source, what=stored.dataset)
        source = replace(source, future=_asked(source, future, stored))
        if isinstance(what, em.MarginProfile):
            stored = sources.profile_scores(what)
        settings = em.searches.SearchSettings(**({} if stored is None else stored.search) | given)
        trajectory, frame = sources.first_frame(source, trajectory, frame)
        frames = source.frames(trajectory)
        if not frame < len(frames.times):
            raise ValueError(f"frame is {frame}, expected 0 to {len(frames.times) - 1}")
        title = source.title + f", trajectory {trajectory}" * (source.trajectories > 1)
        others = () if every is None else range(0, len(frames.times), every)
        numbers = sorted({frame, *others})
        blobs, scored, shots = Blobs(), list[Scored](), []
        for number in numbers:

            def tell(share: float, done: int = len(scored)) -> None:
                if scoring is not None:
                    scoring((done + share) / len(numbers))

            place = None if frames.numbers is None else frames.numbers[number]
            asked = frames.problem(number), settings, place, tell
            scored.append(score_state(*asked, disturbance=frames.disturbance))
            beside = [] if stored is None else stored.at(frames.first + number)
            shots.append(_shot(blobs, frames, number, scored[-1], beside))
        return Page(title, shots, blobs.texts(), first=numbers.index(frame), scored=scored)
    finally:
        source.close()


def _shot(
    blobs: Blobs, frames: sources.Frames, frame: int, scored: Scored, stored: sources.Columns
) -> dict[str, Any]:
    """A frame of a trajectory with its scores, beside those of a file."""
    problem, times = scored.problem, frames.times
    name = f"{times[frame]:.2f} s"
    name += "".join(f", {metric} {value:.2f}" for metric, value in [*scored.values.items()][:1])
    shot = Shot(blobs, name, problem, frames.states)
    drawn, (dots, edges) = shot.add_sets(), shot.add_search(scored)
    words, future = [texts.frame_text(frames, frame)], None
    if problem.horizon is not None:
        why = ""
        try:
            future = em.futures.undisturbed(problem)
            shot.add_future(future)
        except RuntimeError as error:  # it diverges
            why = str(error)
        words.append(texts.future_text(problem, future, why))
    if len(times) > 1 and np.isfinite(frames.states).all():
        captions = [f"t = {time:.2f} s" for time in times]
        shot.add_track("trajectory", frames.states, times - times[0], captions)
    words += [texts.score_table(scored, stored), texts.escape_text(scored)]
    words += [texts.legend(problem, scored, future), texts.drawn_text(dots, edges)]
    words.append(texts.sets_text(problem, drawn))
    return shot.content | {"words": "".join(words)}


def _stored(source: sources.StateSource, scores: AnyPath, run: int | None) -> sources.FrameScores:
    """The scores of a file; ValueError if the source is no dataset, or not theirs."""
    if not isinstance(source.what, em.datasets.Dataset):
        kind = "a MarginProfile" if isinstance(source.what, em.MarginProfile) else "a problem"
        raise ValueError(f"scores are {str(scores)!r}, of no use with {kind} alone")
    name = source.title if source.opened else "DATASET"
    return sources.stored_scores(scores, source.what, run, name)


def _asked(
    source: sources.StateSource, future: Future | None, stored: sources.FrameScores | None
) -> Future | None:
    """What is asked of the states' future: that of their scores in a file, or the given one.

    Raises ValueError if both are there and differ, and without a dataset."""
    if stored is not None and future is not None and future != stored.future:
        asks = "states as they are" if stored.future is None else f"the future: {stored.future}"
        text = f"what is asked is {future}, but the scores are about {asks}"
        raise ValueError(f"{text}: leave the horizon out, or give another run")
    if future is not None and not isinstance(source.what, em.datasets.Dataset):
        raise ValueError(
            f"the horizon is {future.frames} frames, but there is no dataset that has them: give a "
            "problem its horizon in seconds, problem.replace(horizon=...)"
        )
    return future if stored is None else stored.future


def page_of_grasps(scores: em.grasps.GraspScores, scoring: ShareProgress | None = None) -> Page:
    """The page of all grasps, the best first; of more than MOST_GRASPS of ranks evenly from the
    best to the worst. Raises ValueError if none has a score."""
    _ = scores.best
    ranks = np.unique(np.linspace(0, len(scores.ranked) - 1, MOST_GRASPS).astype(int))
    blobs, shots = Blobs(), []
    for done, rank in enumerate(ranks):
        with kept_warnings():
            shots.append(_grasp_shot(blobs, scores, int(rank)))
        if scoring is not None:
            scoring((done + 1) / len(ranks))
    return Page(f"{len(scores.grasps)} grasps", shots, blobs.texts(), scored=[None] * len(shots))


def _grasp_shot(blobs: Blobs, scores: em.grasps.GraspScores, rank: int) -> dict[str, Any]:
    number = int(scores.ranked[rank])
    name, (problem, why) = scores.grasps.names[number], scores.shown(number)
    future = None if why else em.futures.undisturbed(problem)
    states = problem.state[None] if future is None else future.states
    holds = f"{scores.probabilities[number]:.2f}"
    shot = Shot(blobs, f"{rank + 1}. {name}: {holds}", problem, states)
    drawn = shot.add_sets()
    if future is not None:
        shot.add_future(future)
    low, high = scores.interval()[number]
    lines = [f"<b>{escape(name)}</b>, rank {rank + 1} of {len(scores.ranked)}"]
    lines.append(f"held with probability {holds} ({low:.2f} to {high:.2f})")
    if lost := scores.how_lost(number):
        lines.append(f"lost: {escape(lost)}")
    if why:
        lines.append(f"The hand {why}: this is the open hand.")
    words = [texts.box("<br>".join(lines))]
    if future is not None:
        words.append(texts.future_text(problem, future))
    words += [texts.legend(problem, None, future), texts.sets_text(problem, drawn)]
    return shot.content | {"words": "".join(words)}
