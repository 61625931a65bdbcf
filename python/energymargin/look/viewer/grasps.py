"""The page of a ranking of grasps: each as the hand has closed on it, and what becomes of it."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np

import energymargin as em
from energymargin.base.plausibility import kept_warnings
from energymargin.look.viewer import texts
from energymargin.look.viewer.page import Page
from energymargin.look.viewer.search import ShareProgress
from energymargin.look.viewer.shots import Blobs, Shot

MOST = 24  # grasps on a page


def page_of_grasps(scores: em.grasps.GraspScores, scoring: ShareProgress | None = None) -> Page:
    """The page of all grasps, the best first; of more than MOST of ranks evenly from the best to
    the worst. Raises ValueError if none has a score."""
    _ = scores.best
    ranks = np.unique(np.linspace(0, len(scores.ranked) - 1, MOST).astype(int))
    blobs, shots = Blobs(), []
    for done, rank in enumerate(ranks):
        with kept_warnings():
            shots.append(_shot(blobs, scores, int(rank)))
        if scoring is not None:
            scoring((done + 1) / len(ranks))
    return Page(f"{len(scores.grasps)} grasps", shots, blobs.texts(), scored=[None] * len(shots))


def _shot(blobs: Blobs, scores: em.grasps.GraspScores, rank: int) -> dict[str, Any]:
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
