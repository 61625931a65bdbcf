"""Scores of many grasps on any executor. A file of scores resumes where it ended."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from energymargin import Cancel, Cancelled, margin_profile
from energymargin.base.checks import check_type, one_of, positive_number, seed_number, whole_number
from energymargin.base.limits import Limit
from energymargin.base.plausibility import kept_warnings, warn
from energymargin.disturbances import Disturbance, text_of
from energymargin.executors import Executor, Kept, ask
from energymargin.grasps.belief import GraspBelief, lab
from energymargin.grasps.grasp_object import GraspObject
from energymargin.grasps.grasp_set import GraspSet
from energymargin.grasps.hands import Hand, HandFile, preset
from energymargin.grasps.outcomes import ENDINGS, Grasp, Outcome
from energymargin.grasps.protocols import Protocol, protocol_of
from energymargin.grasps.scores import GraspScores, grasp_of
from energymargin.grasps.trials import COLLIDING, STEP, GraspTrials
from energymargin.store import AnswerFile

ROLLOUTS = 30
EVERY = 0.5  # s between the moments whose efforts are searched
OF_TRIALS = ("hand", "object", "protocol", "belief")


def score(
    grasps: GraspSet,
    hand: Hand | str,
    object: GraspObject,
    protocol: Protocol | str = "hold",
    *,
    belief: GraspBelief | str | None = None,
    disturbance: Disturbance | None = None,
    rollouts: int = ROLLOUTS,
    colliding: str = "lost",
    effort: int | None = None,
    seed: int = 0,
    step: float = STEP,
    store: str | Path | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> GraspScores:
    """Which of these grasps hold, and how sure is that?

    Each grasp has `rollouts` trials. In a trial the hand closes where a draw of the belief puts it,
    and goes through the protocol under a random disturbance. Trial k of every grasp has the same
    draw and the same disturbance, so that grasps can be compared.

    Args:
        grasps: of `em.grasps.read`, or made from poses.
        hand: a gripper by numbers, a hand of a file, or a preset: "panda", "robotiq_2f85",
            "robotiq_2f140" or "wsg_50".
        object: what is gripped.
        protocol: what is done with it, or a preset: "hold", "lift", "shake", "graspa" or "acronym".
        belief: what is not known; "lab": poses to 7 mm and .05 rad, friction from half to one and
            a half times what is said, mass to a tenth, force to a fifth, that of a HandFile
            exactly; None: everything is known.
        disturbance: of em.disturbances, within the protocol's bounds; None: Uniform().
        rollouts: trials of each grasp.
        colliding: what is done with a draw that puts the hand into the object or the table: "lost"
            counts it as lost; "redraw" draws another pose, at most 20 times, and then moves the
            hand back along its approach; "retreat" moves it back at once. A hand that is not free
            4 cm farther back is lost. The last two ask how a grasp does once the hand is in place:
            they make one better whose hand is often in the object.
        effort: nodes of a search for the least effort of escape at the weakest moment of the
            undisturbed motion; None: none.
        seed: of all draws.
        step: of the simulation [s]. A longer one is faster, and holds too much: a grip at its
            limit slips and sticks in whole steps.
        store: a file of scores. What it has already is not made again.
        threads: None takes all cores that this process may use. Scores do not depend on them.
        executor: in place of threads, of `em.executors`.
        progress: progress(done, total) counts grasps.
        timeout: after so many seconds the grasps count that are finished.
        cancel: the same once it is set.

    Raises ValueError on bad arguments, and on a file of something else. Warns, as
    PlausibilityWarning, of what speaks against the scores; `warnings` has the same texts.
    """
    asked: Any = {"belief": belief, "disturbance": disturbance, "colliding": colliding}
    trials = trials_of(grasps, hand, object, protocol, **asked, seed=seed, step=step)
    count = whole_number("rollouts", rollouts, 1)
    nodes = None if effort is None else whole_number("effort", effort, 1)
    limit, there = Limit(timeout, cancel), 0
    scores = GraspScores.before(grasps, trials, count)
    where: Any = {"threads": threads, "executor": executor, "progress": progress}

    def note(rows: Sequence[tuple[Grasp, GraspRow]]) -> None:
        nonlocal scores, there
        scores, there = scores.writable(), there + len(rows)
        for _, row in rows:
            _put(scores, row)

    with kept_rows(store, trials, count, nodes, read=_read, written=_written) as kept:
        every = [grasp_of(grasps, number) for number in range(len(grasps))]
        work = partial(score_grasps, trials, count, nodes)
        ask([every], work, note, kept=kept, total=len(every), **where, **limit.rest())
    if there == 0:
        limit.require("a grasp has its score")
    warn([(text, text) for text in scores.warnings], None)
    return scores


def trials_of(
    grasps: GraspSet, hand: Hand | str, object: GraspObject, protocol: Protocol | str, **asked: Any
) -> GraspTrials:
    """What all trials have in common, `asked` as of `score`; raises ValueError on bad arguments."""
    check_type("grasps", grasps, GraspSet, "an em.grasps.GraspSet, as of em.grasps.read(path)")
    check_type("object", object, GraspObject, "an em.grasps.GraspObject")
    hand = preset(hand) if isinstance(hand, str) else hand
    check_type("hand", hand, Hand, "a hand of em.grasps or the name of a preset")
    usual = {name for name in ("belief", "disturbance") if asked.get(name) is None}
    given = {name: value for name, value in asked.items() if name not in usual}
    if isinstance(belief := given.get("belief"), str):
        one_of("belief", belief, ("lab",))
        given["belief"] = replace(lab(), force=None) if isinstance(hand, HandFile) else lab()
    given["seed"] = seed_number(asked.get("seed", 0))
    given["step"] = positive_number("step", asked.get("step", STEP))
    trials = GraspTrials(hand, object, protocol_of(protocol), **given)
    check_type("belief", trials.belief, GraspBelief, "an em.grasps.GraspBelief, or 'lab'")
    one_of("colliding", trials.colliding, COLLIDING)
    trials.check(grasps)
    return trials


def score_grasps(
    trials: GraspTrials, rollouts: int, nodes: int | None, grasps: Sequence[Grasp], cancel: Cancel
) -> list[GraspRow]:
    """The rows of some grasps; once it is cancelled, those that are finished."""
    rows: list[GraspRow] = []
    with kept_warnings():  # which each of many trials would repeat
        for grasp in grasps:
            start = time.perf_counter()
            try:
                row = _row(trials, rollouts, nodes, grasp, cancel)
            except (ValueError, RuntimeError) as error:
                if cancel.is_set:  # what was stopped half-way counts as not begun
                    break
                row = GraspRow(grasp.number, error=str(error))
            rows.append(replace(row, seconds=time.perf_counter() - start))
    return rows


def _row(
    trials: GraspTrials, rollouts: int, nodes: int | None, grasp: Grasp, cancel: Cancel
) -> GraspRow:
    """All that is asked about a grasp. Raises Cancelled if it is stopped before its end."""
    outcomes = tuple(trials.outcomes(grasp, range(rollouts), cancel))
    likely = trials.run(grasp, -1, cancel)
    effort = math.nan
    if nodes is not None and likely.ending not in ("not gripped", "collided", "diverged"):
        sizes: Any = {"rollouts": 1, "nodes": nodes, "seed": trials.seed, "threads": 1}
        problem = trials.likely_problem(grasp, cancel)
        profile = margin_profile(problem, every=EVERY, cancel=cancel, **sizes)
        if not profile.complete:
            raise Cancelled("cancelled within the search of an effort")
        effort = float(np.nanmin(profile.efforts))  # 0 if it is lost without a disturbance
    return GraspRow(grasp.number, outcomes, likely, effort)


def _put(scores: GraspScores, row: GraspRow) -> None:
    k = row.number
    scores.seconds[k] = row.seconds
    if row.error is not None or row.likely is None:
        scores.errors[k] = row.error or "it was not made"
        return
    scores.errors.pop(k, None)
    scores.efforts[k], scores.likely[k] = row.effort, ENDINGS.index(row.likely.ending)
    endings, times, redrawn, back, *sums = zip(*row.outcomes, strict=True)
    scores.endings[k] = [ENDINGS.index(ending) for ending in endings]
    scores.times[k], scores.redrawn[k], scores.back[k] = times, redrawn, back
    scores.steps[k], scores.unconverged[k], scores.lost_time[k] = map(sum, sums)


@dataclass(frozen=True)
class GraspRow:
    """What a worker found out about a grasp."""

    number: int
    outcomes: tuple[Outcome, ...] = ()
    likely: Outcome | None = None
    effort: float = math.nan
    seconds: float = 0.0
    error: str | None = None


@contextmanager
def kept_rows(
    store: str | Path | None,
    trials: GraspTrials,
    *more: Any,
    read: Callable[[Grasp, bytes], Any],
    written: Callable[[Any], bytes | None],
) -> Iterator[Kept[Grasp, Any] | None]:
    """The rows of a store, known by what they depend on; None without a store.

    `more`: what is asked besides. `read` and `written`: rows as bytes. Errors: as AnswerFile.
    Raises ValueError on a disturbance or a belief that cannot be written down.
    """
    if store is None:
        yield None
        return
    known = {name: getattr(trials, name).text for name in OF_TRIALS}
    known |= {name: getattr(trials, name) for name in ("colliding", "seed", "step")}
    asked = json.dumps([known, text_of(trials.disturbance), *more])
    with AnswerFile(store, create=True) as file:

        def digest(grasp: Grasp) -> bytes:
            return file.key(asked, grasp.opening, grasp.pose.tobytes(), grasp.placed.tobytes())

        yield Kept(file, digest, read, written)


def _read(grasp: Grasp, content: bytes) -> GraspRow:
    outcomes, likely, *others = json.loads(content)
    made = tuple(Outcome(*one) for one in outcomes)
    return GraspRow(grasp.number, made, Outcome(*likely), *others)


def _written(row: GraspRow) -> bytes | None:
    return None if row.error is not None else json.dumps(astuple(row)[1:]).encode()
